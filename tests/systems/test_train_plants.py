"""The trains on the line against each other, the matrix exponential, and scipy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from railcosim.fmus import build
from railcosim.models import (
    Plant,
    dc_drive_train,
    second_order_train,
    second_order_train_on_line,
    stopping_train,
)
from tests.instances import FMU2Named

ON_LINE = [dc_drive_train, second_order_train_on_line]
Inputs = dict[str, np.ndarray]


def run(
    plant: Callable[[], Plant], folder: Path, step: float, inputs: Inputs, watched: Sequence[str],
    *, start: float = 0.0, **values: float,
) -> np.ndarray:  # fmt: skip
    """Return the watched outputs at each communication point; inputs are held over the step."""
    slave = FMU2Named(build(plant()), folder / plant.__name__)
    for name, value in values.items():
        slave.set(name, value)
    for name, column in inputs.items():
        slave.set(name, column[0])
    slave.initialize(start)
    rows = [[slave.get(name) for name in watched]]
    for k in range(len(next(iter(inputs.values())))):
        for name, column in inputs.items():
            slave.set(name, column[k])
        slave.doStep(start + k * step, step)
        rows.append([slave.get(name) for name in watched])
    slave.freeInstance()
    return np.array(rows)


# Traction alone: the identified transfer function


def notches(kind: str, count: int, step: float) -> np.ndarray:
    times = step * np.arange(count)
    if kind == "steps":
        return np.select([times < 20.0, times < 45.0, times < 70.0], [10.0, -10.0, 4.0], 0.0)
    sine = 10.0 * np.sin(0.2 * times)
    return sine if kind == "sine" else np.round(sine)


@pytest.mark.parametrize("kind", ["steps", "sine", "quantised"])
@pytest.mark.parametrize("step", [0.05, 1.0])
@pytest.mark.parametrize("plant", ON_LINE)
def test_without_the_brake_it_is_the_identified_plant(
    tmp_path: Path, plant: Callable[[], Plant], step: float, kind: str
) -> None:
    """Through standstill and back, against the FMU and the matrix exponential; start at 3 m/s."""
    notch = notches(kind, round(100.0 / step), step)
    found = run(plant, tmp_path, step, {"notch": notch}, ["speed", "acceleration"], speed=3.0)
    other = run(
        second_order_train, tmp_path, step, {"u": notch}, ["speed", "acceleration"], speed=3.0
    )
    m = np.zeros((3, 3))
    m[:2] = [[0.0, 1.0, 0.0], [-0.0324, -0.4356, 0.07128]]  # retyped from the sheet
    over = expm(m * step)
    x = np.array([3.0, 0.0])
    exact = [x, *(x := (over @ np.append(x, u))[:2] for u in notch)]
    assert found[:, 0].min() < -1.0
    assert np.abs(found - other).max() <= 1e-9
    assert np.abs(found[:, 0] - np.array(exact)[:, 0]).max() <= 1e-11
    assert np.abs(found[:, 1] - np.array(exact)[:, 1]).max() <= 1e-11


# Traction and brake: the two plants, and scipy


@pytest.mark.parametrize("seed", range(4))
def test_braked_to_standstill_and_off_again(tmp_path: Path, seed: int) -> None:
    """Random notches and brakes, with stops and departures in both directions."""
    random = np.random.default_rng(seed)
    step, count = 0.1, 1500
    notch = np.repeat(random.integers(-10, 10, count // 50, endpoint=True).astype(float), 50)
    brake = np.repeat(np.maximum(random.uniform(-20e3, 32e3, count // 25), 0.0), 25)
    inputs = {"notch": notch, "brake": brake}
    watched = ["position", "speed", "acceleration", "direction"]
    dc, line = (run(plant, tmp_path, step, inputs, watched) for plant in ON_LINE)
    assert np.abs(dc - line).max() <= 1e-9
    still = dc[:, 3] == 0.0
    assert (np.diff(still.astype(int)) == 1).sum() >= 2  # it came to stand and departed
    assert (np.diff(still.astype(int)) == -1).sum() >= 2
    assert (dc[still, 1] == 0.0).all()
    expected = braked(step, notch, brake)
    assert np.abs(dc[:, :2] - expected).max() <= 1e-9


def braked(step: float, notch: np.ndarray, brake: np.ndarray) -> np.ndarray:
    """Position and speed by scipy, event by event; a is the acceleration by traction."""
    y, way, rows = np.zeros(4), 0, [[0.0, 0.0]]
    for n, b in zip(notch, brake, strict=True):
        now = 0.0
        while now < step:
            now, y, way = until_change(now, step, y, way, n, min(b / 16e3, 0.15 * 9.80665))
        rows.append([y[0], y[1]])
    return np.array(rows)


def until_change(
    now: float, step: float, y: np.ndarray, way: int, notch: float, demand: float
) -> tuple[float, np.ndarray, int]:
    """Advance x, v, a and brake f to standstill, departure, or the step's end."""

    def slope(t: float, y: np.ndarray) -> list[float]:
        x, v, a, f = y
        del x
        moving = [v, a - way * f] if way else [0.0, 0.0]
        return [*moving, 0.0324 * (2.2 * notch - v) - 0.4356 * a, (demand - f) / 0.4]

    def change(t: float, y: np.ndarray) -> float:
        return way * y[1] if way else y[3] - abs(y[2])

    change.terminal, change.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    # Off where the traction exceeds the brake, or is about to; scipy does not see a crossing where
    # it begins.
    if way == 0 and abs(y[2]) >= y[3] - 1e-13:
        rate = slope(now, y)
        side = int(np.sign(y[2] or rate[2]))
        if abs(y[2]) > y[3] + 1e-13 or side * rate[2] > rate[3]:
            way = side
        elif y[3] == 0.0 and rate[3] == 0.0:
            return step, y, 0
    found = solve_ivp(slope, (now, step), y, "DOP853", events=change, rtol=1e-12, atol=1e-13)
    y = found.y[:, -1].copy()
    if found.status == 1 and way:
        y[1], way = 0.0, 0
    return float(found.t[-1]), y, way


@pytest.mark.parametrize("start", [0.0, 1e5])
@pytest.mark.parametrize("seed", range(6))
def test_departures_and_stops_at_any_instant_do_not_chatter(
    tmp_path: Path, seed: int, start: float
) -> None:
    """Where the traction passes the sinking brake only by rounding, it must not stop again.

    Late, when the time's resolution is coarse, that happens more easily.
    """
    random = np.random.default_rng(seed)
    inputs = {
        "notch": np.repeat(random.choice([0.0, 0.5, -0.5, 1.0, -3.0, 10.0, -10.0], 400), 5),
        "brake": np.repeat(random.choice([0.0, 0.0, 1e3, 4e3, 16e3, 32e3], 400), 5),
    }
    watched = ["position", "speed", "acceleration"]
    dc, line = (run(plant, tmp_path, 0.1, inputs, watched, start=start) for plant in ON_LINE)
    assert np.abs(dc - line).max() <= 1e-9


def test_a_braked_train_stands_until_it_is_released(tmp_path: Path) -> None:
    """At notch 0 for an hour, then it departs as the brake is released under traction."""
    for plant in ON_LINE:
        slave = FMU2Named(build(plant()), tmp_path / plant.__name__)
        slave.set("speed", 5.0)
        slave.set("brake", 16e3)
        slave.initialize()
        slave.doStep(0.0, 30.0)
        place = slave.get("position")
        slave.doStep(30.0, 3600.0)
        assert (slave.get("position"), slave.get("speed")) == (place, 0.0)
        slave.set("notch", 1.0)
        slave.doStep(3630.0, 60.0)
        assert (slave.get("position"), slave.get("standstill")) == (place, 1)
        slave.set("brake", 0.0)
        slave.doStep(3690.0, 200.0)
        assert slave.get("speed") == pytest.approx(2.2, abs=1e-6)
        slave.freeInstance()


# The stopping train under any demand


@dataclass(frozen=True)
class Stopping:
    """Parameters of a stopping train and its motion, event by event (scipy at 1e-12)."""

    lag: float
    effectiveness: float
    drag: float
    ratio: float
    emergency_lag: float = 0.2

    def effort(self, t: float, start: float, command: float, lag: float) -> float:
        return command + (start - command) * np.exp(-t / lag)

    def reaches(self, level: float, start: float, command: float, lag: float) -> float:
        """When the effort passes a level under a held command; never if it does not."""
        part = (level - command) / (start - command) if start != command else 0.0
        return -lag * np.log(part) if 0.0 < part < 1.0 else np.inf

    def held(self, x: float, v: float, f: float, demand: float, emergency: bool, time: float):
        """Return place, speed and effort after a time under held inputs."""
        lag = self.emergency_lag if emergency else self.lag
        rail = 0.15 * 9.80665
        least, most = -rail / (self.ratio * self.effectiveness), rail / self.ratio
        command = float(np.clip(-1.4 if emergency else demand, least, most))
        # The effort is known: split where traction and brake change over, and where it departs.
        marks = [self.reaches(level, f, command, lag) for level in (0.0, self.drag / self.ratio)]
        now, f0 = 0.0, f
        for end in sorted({m for m in marks if m < time} | {time}):
            middle = self.effort(0.5 * (now + end), f0, command, lag)
            x, v = self.part(x, v, now, end, middle, lambda t: self.effort(t, f0, command, lag))
            now = end
        return x, v, self.effort(time, f0, command, lag)

    def part(self, x: float, v: float, now: float, end: float, middle: float, effort):
        """Advance where the effort keeps its side of zero and of the drag."""
        gain = self.ratio * (1.0 if middle > 0.0 else self.effectiveness)
        if v == 0.0 and gain * middle <= self.drag:
            return x, 0.0

        def slope(t: float, y: np.ndarray) -> list[float]:
            return [y[1], gain * effort(t) - self.drag]

        def stop(t: float, y: np.ndarray) -> float:
            return y[1]

        stop.terminal, stop.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
        found = solve_ivp(slope, (now, end), [x, v], "DOP853", events=stop, rtol=1e-12, atol=1e-13)
        return float(found.y[0, -1]), 0.0 if found.status == 1 else float(found.y[1, -1])


@pytest.mark.parametrize("seed", range(8))
def test_creeping_to_the_mark(tmp_path: Path, seed: int) -> None:
    """Random demands of both signs: stops, departures and stops again, some by emergency."""
    random = np.random.default_rng(seed)
    train = Stopping(
        lag=random.uniform(0.2, 0.5),
        effectiveness=random.uniform(0.9, 1.1),
        drag=random.choice([0.0, random.uniform(0.0, 0.03)]),
        ratio=random.uniform(0.8, 1.2),
    )
    step, count = 0.05, 800
    demand = np.repeat(random.uniform(-1.7, 1.5, count // 20) * 0.5, 20)
    emergency = np.repeat((random.uniform(size=count // 40) < 0.1).astype(float), 40)
    found = run(
        stopping_train, tmp_path, step, {"demand": demand, "emergency": emergency},
        ["position", "speed", "effort", "standstill"],
        position=-10.0, speed=0.6, lag=train.lag, effectiveness=train.effectiveness,
        drag=train.drag, mass=2e5 / train.ratio,
    )  # fmt: skip
    now, rows = (-10.0, 0.6, 0.0), [(-10.0, 0.6, 0.0)]
    for d, e in zip(demand, emergency, strict=True):
        now = train.held(*now, d, e > 0.5, step)
        rows.append(now)
    assert np.abs(found[:, :3] - np.array(rows)).max() <= 1e-9
    still = found[:, 3] == 1.0
    assert (np.diff(still.astype(int)) == 1).sum() >= 2
    assert (found[still, 1] == 0.0).all()
