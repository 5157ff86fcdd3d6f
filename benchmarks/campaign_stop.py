"""The work of campaign.py: a train's stop, and what is drawn anew for each.

There are two, with the same loop: "metro" is the train and a controller of the precise braking
study; "light" is a train of four lags with a controller of a few lines, so that what is measured is
the master.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from campaign_law import law

from railcosim import Block, Delay, Diagram, Fmu
from railcosim.controllers.braking_profile import BrakingProfile
from railcosim.controllers.smarc import SMARC
from railcosim.controllers.tracked_stop import TrackedStop
from railcosim.fmus import build
from railcosim.models import Plant, RungeKutta4, metro_train

STEP = 0.01  # s, the base step
PERIOD = 0.2  # s, of the controller
STOP = 25.0  # s: 2500 steps
TICKS, EVERY = round(STOP / STEP), round(PERIOD / STEP)
KEPT = ["train.position", "train.speed"]
DELAYS = {"electric_delay.time": (0.9, 0.13), "air_delay.time": (0.8, 0.16)}

Values = dict[str, Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class Small(Block):
    """The law of campaign_law.py, sampled."""

    period: float = PERIOD
    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"command": "m/s2"}

    def step(self, x: Any, position: float, speed: float) -> tuple[float, Any]:
        return law(position, speed), x


def four_lags() -> Plant:
    """Return a train with a lag for each brake, a rolling resistance, and no events."""
    solver = RungeKutta4(inner_step=STEP)
    with Plant("four_lags", stop=STOP, step=STEP, solver=solver) as plant:
        position = plant.state("position", unit="m", output=True)
        speed = plant.state("speed", unit="m/s", output=True)
        total = -0.01
        for name, share, lag in (("electric", 0.7, 0.83), ("air", 0.3, 1.741)):
            command = plant.input(f"{name}_command", unit="m/s2")
            time_constant = plant.parameter(f"{name}_lag", lag, unit="s", minimum=0.01)
            effort = plant.state(name, unit="m/s2")
            plant.der(effort, (share * command - effort) / time_constant)
            total = total + effort
        plant.der(position, speed)
        plant.der(speed, total)
    return plant


@dataclass(frozen=True)
class Case:
    """A train, its controller and start values, and what is drawn: (middle, half the width)."""

    fmu: Path
    controller: Block
    start: Mapping[str, float]
    drawn: Mapping[str, tuple[float, float]]

    def loop(self) -> Diagram:
        """Return the loop of train, controller and the two delays of its command."""
        made = Diagram("stop", step=STEP)
        made.add("controller", self.controller)
        made.add("train", Fmu.with_values(self.fmu, self.start))
        for name in ("position", "speed"):
            made.connect(f"train.{name}", f"controller.{name}")
        for name in ("electric", "air"):
            made.add(f"{name}_delay", Delay(0.8, interpolation="hold"))
            made.connect("controller.command", f"{name}_delay.u")
            made.connect(f"{name}_delay.y", f"train.{name}_command")
        return made

    def draws(self, count: int, *, on_grid: bool, seed: int = 7) -> list[Values]:
        """Return the values of some stops: delays of whole steps, or of whole microseconds."""
        random = Random(seed)
        digits = 2 if on_grid else 6
        found = []
        for _ in range(count):
            values = {n: random.uniform(m - w, m + w) for n, (m, w) in self.drawn.items()}
            for name, (m, w) in DELAYS.items():
                values[name] = round(random.uniform(m - w, m + w), digits)
            found.append(values)
        return found


@cache
def case(name: str) -> Case:
    """Return the work "metro" or "light"."""
    lags = {"train.electric_lag": (0.83, 0.12), "train.air_lag": (1.741, 0.35)}
    if name == "light":
        start = {"position": -160.0, "speed": 14.0}
        return Case(build(four_lags()), Small(), start, lags)
    law = SMARC(surface=0.4, reaching=0.4, robust=0.02, adaptation=0.02, boundary=0.2)
    controller = TrackedStop(law=law, profile=BrakingProfile(speed=14.0, lead_in=1.0))
    start = {"position": controller.profile.start_position, "speed": 14.0}
    drawn = {**lags, "train.electric_coefficient": (0.85, 0.05)}
    return Case(build(metro_train(gradients=2)), controller, start, drawn)
