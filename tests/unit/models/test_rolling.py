"""Dry friction, standstill and departure, against motions that can be written down."""

import math
from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models import Plant
from railcosim.models.rolling import motion, roll
from tests.instances import FMU2Named


def sledge(*, spring: bool = False) -> Plant:
    """A body under a drive and dry friction, or on a spring (1/s²: rate squared)."""
    with Plant("sledge", stop=20.0, step=0.1) as plant:
        drive = plant.input("drive", unit="m/s2")
        friction = plant.input("friction", unit="m/s2", minimum=0.0)
        body = motion(plant)
        pull = drive - 4.0 * body.position if spring else drive
        roll(plant, body, pull, friction)
    return plant


@pytest.fixture
def body(tmp_path: Path):
    made: list[FMU2Named] = []

    def start(*, spring: bool = False, **values: float) -> FMU2Named:
        slave = FMU2Named(build(sledge(spring=spring)), tmp_path / str(len(made)))
        for name, value in values.items():
            slave.set(name, value)
        slave.setDebugLogging(True, ["logEvents"])
        slave.initialize()
        made.append(slave)
        return slave

    yield start
    for slave in made:
        slave.freeInstance()


def events(slave: FMU2Named) -> list[tuple[str, float]]:
    """Names and times of what happened, from the log."""
    parts = [line.split("'") for line in slave.log if "event '" in line]
    return [(p[1], float(p[2].split("t = ")[1])) for p in parts]


def where(slave: FMU2Named) -> tuple[float, float]:
    return slave.get("position"), slave.get("speed")


@pytest.mark.parametrize("sign", [1, -1])
def test_it_stops_and_stands(body, sign: int) -> None:
    """From 3 m/s at 0.5 − 0.2 m/s² to the place v²/2a, then held for an hour."""
    slave = body(speed=3.0 * sign, friction=0.5, drive=0.2 * sign)
    assert (slave.get("direction"), slave.get("standstill")) == (sign, 0)
    assert slave.get("acceleration") == pytest.approx(-0.3 * sign, rel=1e-15)
    slave.run(20.0, 0.1)
    place = slave.get("position")
    assert place == pytest.approx(sign * 15.0, rel=0, abs=1e-11)
    assert events(slave) == [("start_in_motion", 0.0), ("stop", pytest.approx(10.0, abs=1e-12))]
    slave.doStep(20.0, 3600.0)
    assert where(slave) == (place, 0.0)
    assert (slave.get("direction"), slave.get("standstill")) == (0, 1)
    assert slave.get("acceleration") == 0.0
    assert len(events(slave)) == 2


def test_it_departs_only_when_the_drive_exceeds_the_friction(body) -> None:
    slave = body(friction=0.5, drive=0.5)
    slave.doStep(0.0, 10.0)
    assert (*where(slave), events(slave)) == (0.0, 0.0, [])
    slave.set("drive", 0.75)
    slave.doStep(10.0, 4.0)
    assert where(slave) == pytest.approx((2.0, 1.0), rel=1e-12)
    assert events(slave) == [("depart", 10.0)]


@pytest.mark.parametrize("sign", [1, -1])
def test_a_drive_beyond_the_friction_turns_it_round_without_a_rest(body, sign: int) -> None:
    """Down at 1 + 0.5 m/s², off at 1 − 0.5 m/s² the other way, in the same instant."""
    slave = body(speed=3.0 * sign, drive=-1.0 * sign, friction=0.5)
    slave.run(10.0, 0.1)
    place = 3.0 - 0.25 * 8.0 * 8.0
    assert where(slave) == pytest.approx((sign * place, -4.0 * sign), abs=1e-11)
    (_, stop, depart) = events(slave)
    assert stop == ("stop", pytest.approx(2.0, abs=1e-12))
    assert depart == ("depart", stop[1])


@pytest.mark.parametrize("step", [0.1, 0.7, 10.0])
def test_without_friction_the_equations_are_linear(body, step: float) -> None:
    """x'' = −4 x passes through standstill twice in each period of π s."""
    slave = body(spring=True, position=0.3, speed=-1.0)
    for k in range(round(40.0 / step)):
        slave.doStep(k * step, step)
        t = (k + 1) * step
        x = 0.3 * math.cos(2.0 * t) - 0.5 * math.sin(2.0 * t)
        v = -0.6 * math.sin(2.0 * t) - 1.0 * math.cos(2.0 * t)
        assert where(slave) == pytest.approx((x, v), abs=1e-9)
    names = [name for name, _ in events(slave)]
    assert names.count("stop") == math.ceil(40.0 / (math.pi / 2.0) - 0.5)
    assert len(names) == 1 + 2 * names.count("stop")


def test_dry_friction_takes_the_same_from_each_swing(body) -> None:
    """On a spring ω² = 4 the turning points lie 2μ/ω² nearer each time, π/ω apart.

    It rests at the first one within the dead band, where the spring holds no more than μ.
    """
    friction, rate = 0.26, 2.0
    slave = body(spring=True, position=1.0, friction=friction)
    slave.run(20.0, 0.05)
    band = friction / rate**2
    turns = [1.0]
    while abs(turns[-1]) > band:
        turns.append(math.copysign(2.0 * band, turns[-1]) - turns[-1])
    stops = [time for name, time in events(slave) if name == "stop"]
    assert stops == pytest.approx([math.pi / rate * k for k in range(1, len(turns))], abs=1e-9)
    assert where(slave) == (pytest.approx(turns[-1], abs=1e-9), 0.0)
    assert slave.get("standstill") == 1


def test_it_starts_from_rest_when_the_drive_rises_from_exactly_zero(body) -> None:
    """Without friction: x'' = 4 (0.25 − x) with x = 0.25 to begin with, then let go at 0.5."""
    slave = body(spring=True, position=0.25, drive=1.0)
    slave.doStep(0.0, 1.0)
    assert (*where(slave), slave.get("standstill")) == (0.25, 0.0, 1)
    slave.set("drive", 2.0)
    slave.doStep(1.0, 0.5)
    assert slave.get("position") == pytest.approx(0.5 - 0.25 * math.cos(1.0), abs=1e-11)


def test_random_drives_do_not_chatter(body) -> None:
    """Drives held around the friction, stepped exactly: constant acceleration in pieces."""
    random = np.random.default_rng(7)
    slave = body(friction=0.5)
    x = v = 0.0
    for k in range(400):
        drive = random.choice([-0.5, 0.5, 0.0, *random.uniform(-0.9, 0.9, 4)])
        slave.set("drive", drive)
        slave.doStep(0.25 * k, 0.25)
        x, v = held(x, v, drive, 0.5, 0.25)
        assert where(slave) == pytest.approx((x, v), abs=1e-9)
        assert slave.get("direction") == np.sign(v)
    assert len(events(slave)) < 400


def held(x: float, v: float, drive: float, friction: float, time: float) -> tuple[float, float]:
    """Return place and speed after a time under a constant drive and dry friction."""
    while time > 0.0:
        if abs(v) < 1e-12:
            v = 0.0
            if abs(drive) <= friction:
                return x, 0.0
        way = math.copysign(1.0, v or drive)
        a = drive - way * friction
        part = min(time, -v / a) if a * way < 0.0 else time
        x, v = x + v * part + 0.5 * a * part * part, v + a * part
        time -= part
    return x, v if abs(v) > 1e-12 else 0.0
