"""Many runs with controllers that fail: under ATP no train passes the limit curve.

A train with a lagged brake behind a delay, its mass, adhesion, brake, lags and delay drawn anew for
each run, follows a braking pattern until a fault. The margin to the curve is computed here, by
another formula, at every step of the diagram; the ATP samples at every second one.
"""

import math
import random
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Freeze, Gain, Override, Run, Scenario
from railcosim.controllers import PID
from railcosim.controllers.atp import ATP
from railcosim.controllers.braking_pattern import BrakingPattern
from railcosim.controllers.limit_curve import LimitCurve
from railcosim.fmus import build
from railcosim.models import stopping_train

STEP, PERIOD, STOP = 0.1, 0.2, 75.0  # s
TRACTION = 1.2  # m/s² at the nominal mass, all that there is
MASSES = (0.8, 1.2)  # of the nominal mass
EFFECTIVENESS = (0.85, 1.1)
ADHESION = (0.1, 0.2)
DELAYS = (0.1, 0.6)  # s, of the emergency brake
LAGS = (0.1, 0.4)  # s, of both brakes
EMERGENCY = 1.4  # m/s² at the nominal mass

GUARANTEED = 0.8  # m/s²
ACCELERATION = TRACTION / MASSES[0]
CURVE = LimitCurve(
    maximum=18.0,
    braking=GUARANTEED,
    restrictions=((180.0, 300.0, 13.0), (310.0, 311.0, 12.5)),
    stops=(560.0,),
    train_length=20.0,
)
ATP_OF_THE_LINE = ATP(
    curve=CURVE,
    acceleration=ACCELERATION,
    emergency_time=1.75,
    service_time=2.2,
    warning_time=2.5,
    service_command=-0.7,
    emergency_command=0.0,
    period=PERIOD,
)
STOPPING = 0.4  # m/s², of the ATO
OVERLAP = 45.0  # m, the least one and some more, as the ATO lags behind its pattern
KINDS = ("full_traction", "ignores_the_curve", "stuck", "traction_cannot_be_cut")


def longest_time() -> float:
    """Return how long the emergency brake takes to give what is guaranteed, at the worst corner.

    From full traction the effort falls to its end D as D − (D + traction) exp(−t/lag).
    """
    worst = 0.0
    for mass in MASSES:
        for effectiveness in EFFECTIVENESS:
            for adhesion in ADHESION:
                gain = effectiveness / mass
                end = min(EMERGENCY * gain, adhesion * 9.80665)
                ratio = (end - GUARANTEED) / (TRACTION * gain + end)
                worst = max(worst, DELAYS[1] - LAGS[1] * math.log(ratio))
    return worst


@dataclass(frozen=True)
class Drawn:
    """What is different from run to run."""

    train: dict[str, Any]
    delay: float
    at: float
    kind: str

    @classmethod
    def of(cls, number: int) -> "Drawn":
        generator = random.Random(f"atp-{number}")
        mass = generator.uniform(*MASSES) * 2e5
        train: dict[str, Any] = {
            "mass": mass,
            "effectiveness": generator.uniform(*EFFECTIVENESS),
            "adhesion": generator.uniform(*ADHESION),
            "lag": generator.uniform(*LAGS),
            "emergency_lag": generator.uniform(*LAGS),
            "speed": generator.uniform(0.0, 12.0),
        }
        if generator.random() < 0.2:  # corners as well, not the inside alone
            train |= {"mass": generator.choice(MASSES) * 2e5, "adhesion": ADHESION[0]}
            train |= {"emergency_lag": LAGS[1], "effectiveness": generator.choice(EFFECTIVENESS)}
        delay = generator.choice([generator.uniform(*DELAYS), DELAYS[1]])
        at = STEP * generator.randrange(round(50.0 / STEP))
        return cls(train, delay, at, generator.choice(KINDS))

    def scenario(self) -> Scenario:
        """Return the fault."""
        if self.kind == "stuck":
            return Scenario([Freeze("controller.u", at=self.at)])
        if self.kind == "ignores_the_curve":
            return Scenario([Override("pattern.target", 30.0, at=self.at)])
        faults = [Override("controller.u", TRACTION, at=self.at)]
        if self.kind == "traction_cannot_be_cut":  # the emergency brake alone is left
            faults.append(Override("train.demand", TRACTION, at=self.at))
        return Scenario(faults)


@cache
def train() -> Path:
    return build(stopping_train())


def line(drawn: Drawn, *, protected: bool) -> Diagram:
    """Return the train on its line; unprotected, nothing listens to the ATP."""
    mark = CURVE.stops[0] - OVERLAP
    loop = Diagram("campaign", step=STEP)
    pattern = BrakingPattern(
        cruise=12.0, regulated=8.0, regulation_from=60.0, stop=mark, braking=STOPPING, period=PERIOD
    )
    loop.add("pattern", pattern)
    loop.add(
        "controller", PID(kp=2.0, ti=20.0, td=0.0, limits=(-TRACTION, TRACTION), period=PERIOD)
    )
    loop.add("release", Constant(0.0))
    loop.add("atp", ATP_OF_THE_LINE)
    loop.add("effort", Gain(1.0, input_unit="1", unit="m/s2"))
    loop.add("pipe", Delay(drawn.delay, interpolation="hold"))
    loop.add("train", Fmu(train(), position=0.0, emergency_deceleration=EMERGENCY, **drawn.train))
    for target in ("pattern.position", "atp.position"):
        loop.connect("train.position", target)
    for target in ("controller.measurement", "atp.speed"):
        loop.connect("train.speed", target)
    loop.connect("pattern.target", "controller.reference")
    loop.connect("controller.u", "atp.demand")
    loop.connect("release.y", "atp.release")
    loop.connect("atp.command" if protected else "controller.u", "effort.u")
    loop.connect("effort.y", "train.demand")
    loop.connect("atp.emergency" if protected else "release.y", "pipe.u")
    loop.connect("pipe.y", "train.emergency")
    return loop


RECORD = ["train.position", "train.speed", "atp.emergency", "atp.service", "atp.warning"]


def run(drawn: Drawn, scenario: Scenario | None, *, protected: bool = True) -> Run:
    return line(drawn, protected=protected).run(
        STOP, scenario=scenario, record=RECORD, progress=False
    )


def margins(run: Run) -> np.ndarray:
    """Return v_lim − v at all steps; v_lim from its definition, without the code under test."""
    s, b = run["train.position"], 2.0 * CURVE.braking
    found = np.full_like(s, CURVE.maximum)
    for start, end, speed in CURVE.restrictions:
        before = np.sqrt(speed**2 + b * np.maximum(start - s, 0.0))
        found = np.where(s <= end + CURVE.train_length, np.minimum(found, before), found)
    for stop in CURVE.stops:
        found = np.minimum(found, np.sqrt(b * np.maximum(stop - s, 0.0)))
    return found - run["train.speed"]


@dataclass
class Count:
    """What a share of the campaign found."""

    runs: int = 0
    least: float = math.inf  # m/s
    violations: int = 0
    emergencies: int = 0
    services: int = 0
    kinds: frozenset[str] = frozenset()

    def add(self, drawn: Drawn, found: Run) -> None:
        """Count a run in."""
        least = float(np.min(margins(found)))
        self.runs += 1
        self.least = min(self.least, least)
        self.violations += least < 0.0
        self.emergencies += bool(np.any(found["atp.emergency"] > 0.5))
        self.services += bool(np.any(found["atp.service"] > 0.5))
        self.kinds |= {drawn.kind}


def campaign(numbers: range, *, protected: bool) -> Count:
    count = Count()
    for number in numbers:
        drawn = Drawn.of(number)
        count.add(drawn, run(drawn, drawn.scenario(), protected=protected))
    print(f"protected={protected}, runs {numbers}: {count}")
    return count


def shares(runs: int, parts: int) -> list[Any]:
    starts = range(0, runs, runs // parts)
    return [pytest.param(range(n, n + runs // parts), id=f"{n}") for n in starts]


def under_atp(numbers: range) -> None:
    count = campaign(numbers, protected=True)
    assert count.least >= 0.0, count
    assert count.violations == 0
    assert count.kinds == set(KINDS)
    assert count.emergencies > 0.1 * count.runs
    assert count.services > 0.5 * count.runs


def without_atp(numbers: range) -> None:
    count = campaign(numbers, protected=False)
    assert count.least < -5.0, count
    assert count.violations > 0.5 * count.runs


def test_the_times_are_those_of_the_worst_train() -> None:
    assert 0.95 * ATP_OF_THE_LINE.emergency_time < longest_time() < ATP_OF_THE_LINE.emergency_time


def test_without_a_fault_there_is_not_even_a_warning() -> None:
    drawn = Drawn.of(0)
    drawn.train["speed"] = 10.0
    found = run(drawn, None)
    assert found["atp.warning"].max() == 0.0
    assert found["train.speed"][-1] == 0.0
    assert margins(found).min() > 0.0


@pytest.mark.parametrize("numbers", shares(160, 2))
def test_no_train_passes_the_curve(numbers: range) -> None:
    under_atp(numbers)


@pytest.mark.parametrize("numbers", shares(50, 1))
def test_without_atp_they_do(numbers: range) -> None:
    without_atp(numbers)


@pytest.mark.slow
@pytest.mark.parametrize("numbers", shares(10_000, 10))
def test_no_train_in_ten_thousand_passes_the_curve(numbers: range) -> None:
    under_atp(numbers)


@pytest.mark.slow
@pytest.mark.parametrize("numbers", shares(10_000, 10))
def test_without_atp_ten_thousand_do(numbers: range) -> None:
    without_atp(numbers)
