"""The FMUs of master.py: one file for every contender, made by railcosim from small plants.

Their solver makes a single inner step in a communication step of 1 ms, so that what is measured is
the master and not the plant.
"""

from pathlib import Path

import casadi as ca

from railcosim.fmus import build
from railcosim.models import Plant, RungeKutta4, second_order_train

STEP = 0.001  # s, of the communication
SOLVER = RungeKutta4(inner_step=STEP)


def mass(name: str, position: float) -> Plant:
    """Return one of two masses, each on a spring and a damper, with another pair between them.

    Both take the other's position and speed and work out the coupling's force themselves, so that
    no output depends directly on an input. It starts at a position (m), at rest.
    """
    with Plant(name, description="One of two coupled masses", stop=50.0, step=STEP) as plant:
        other_position = plant.input("other_position", unit="m")
        other_speed = plant.input("other_speed", unit="m/s")
        x = plant.state("position", start=position, unit="m", output=True)
        v = plant.state("speed", unit="m/s", output=True)
        coupling = 100.0 * (other_position - x) + 0.1 * (other_speed - v)
        plant.der(x, v)
        plant.der(v, coupling - 10.0 * x - 0.1 * v)
    return plant


def lag() -> Plant:
    """Return a first-order lag, of which any number in a row make a diagram."""
    with Plant("lag", description="A first-order lag", stop=1.0, step=STEP) as plant:
        u = plant.input("u", unit="1")
        y = plant.state("y", start=1.0, unit="1", output=True)
        plant.der(y, 20.0 * (u - y))
    return plant


def wide(count: int) -> Plant:
    """Return a plant with one input and `count` outputs."""
    with Plant("wide", description="Many outputs", stop=1.0, step=STEP) as plant:
        u = plant.input("u", unit="1")
        y = plant.state("y", unit="1")
        plant.der(y, u - y)
        plant.output("outputs", y * ca.DM(range(1, count + 1)), unit="1")
    return plant


def files() -> dict[str, str]:
    """Return the paths of the FMUs by name, built where they are not in the cache yet."""
    plants = {
        "train": second_order_train(),
        "left": mass("left", 1.0),
        "right": mass("right", 0.0),
        "lag": lag(),
        "wide": wide(1000),
    }
    return {name: str(_build(plant)) for name, plant in plants.items()}


def _build(plant: Plant) -> Path:
    return build(plant, solver=SOLVER)
