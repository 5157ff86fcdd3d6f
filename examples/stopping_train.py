"""A train that brakes to standstill and holds: a hybrid plant, exported and run alone."""

import casadi as ca

from railcosim.fmus import export
from railcosim.fmus.simulate import simulate
from railcosim.models import Plant, RungeKutta4

MOVING, STANDING = 0, 1


def stopping_train() -> Plant:
    """Return a train with a traction and braking force, drag, and friction that holds it.

    All values are our choice: 200 t, 12 N s²/m² of drag, 6 kN of running and static resistance.
    """
    with Plant(
        "stopping_train",
        description="A train that stops, stands, and goes again when driven",
        stop=60.0,
        step=0.1,
        solver=RungeKutta4(inner_step=0.01),
    ) as plant:
        force = plant.input("force", unit="N", start=-1e5, minimum=-2e5, maximum=2e5)
        mass = plant.parameter("mass", 2e5, unit="kg", minimum=1.0)
        drag = plant.parameter("drag", 12.0, unit="kg/m", minimum=0.0)
        resistance = plant.parameter("resistance", 6e3, unit="N", minimum=0.0)
        position = plant.state("position", unit="m", output=True)
        speed = plant.state("speed", unit="m/s", start=20.0, nominal=10.0, output=True)
        mode = plant.mode(
            "mode", minimum=0, maximum=1, output=True, description="0 moving, 1 standing"
        )
        push = force - resistance - drag * speed * speed
        plant.der(position, speed)
        plant.der(speed, ca.if_else(mode == MOVING, push / mass, 0.0))
        plant.event(
            "stop",
            speed,
            direction="falling",
            when=mode == MOVING,
            changes={mode: STANDING, speed: 0.0},
        )
        plant.event(
            "go",
            force - resistance,
            direction="rising",
            when=mode == STANDING,
            changes={mode: MOVING},
        )
    return plant


if __name__ == "__main__":
    path = export(stopping_train(), "stopping_train.fmu")
    run = simulate(path, stop=60.0, step=0.1)
    print(run.frame.iloc[::60])
