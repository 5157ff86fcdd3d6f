"""The train before its stopping mark against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from railcosim.fmus import build
from railcosim.models import stopping_train
from tests.instances import FMU2Named

G = 9.80665


def started(folder: Path, **values: float) -> FMU2Named:
    slave = FMU2Named(build(stopping_train()), folder)
    for name, value in values.items():
        slave.set(name, value)
    slave.setDebugLogging(True, ["logEvents"])
    slave.initialize()
    return slave


def stop_time(slave: FMU2Named) -> float:
    (line,) = [line for line in slave.log if "event 'stop'" in line]
    return float(line.split("t = ")[1])


def stop_of(x0: float, v0: float, brake: float, lag: float, drag: float) -> tuple[float, float]:
    """Time and place of standstill where the deceleration is drag + brake (1 − exp(−t/lag))."""

    def speed(t: float) -> float:
        return v0 - drag * t - brake * (t + lag * math.expm1(-t / lag))

    time = float(brentq(speed, 0.0, v0 / (drag + brake) + lag + 1.0, xtol=1e-15, rtol=1e-15))  # pyright: ignore
    lost = time * time / 2.0 - lag * time - lag * lag * math.expm1(-time / lag)
    return time, x0 + v0 * time - drag * time * time / 2.0 - brake * lost


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("step", [0.1, 0.35])
def test_random_stops(tmp_path: Path, seed: int, step: float) -> None:
    """Lag, effectiveness, mass, drag, start and demand as the study draws them, and wider."""
    random = np.random.default_rng(seed)
    v0, lag, demand = random.uniform(4.0, 8.0), random.uniform(0.2, 0.5), random.uniform(0.4, 1.2)
    effectiveness, drag = random.uniform(0.9, 1.1), random.uniform(0.0, 0.03)
    x0, mass = -v0 * v0 / 1.6 + random.uniform(-0.5, 0.5), random.uniform(1.6e5, 2.4e5)
    slave = started(
        tmp_path, speed=v0, position=x0, lag=lag, effectiveness=effectiveness, drag=drag,
        mass=mass, demand=-demand,
    )  # fmt: skip
    slave.run(35.0, step)
    limited = min(effectiveness * demand * 2e5 / mass, 0.15 * G)
    time, place = stop_of(x0, v0, limited, lag, drag)
    assert time < 35.0
    assert stop_time(slave) == pytest.approx(time, rel=0, abs=1e-9)
    assert slave.get("position") == pytest.approx(place, rel=0, abs=1e-9)
    assert (slave.get("speed"), slave.get("standstill")) == (0.0, 1)
    slave.freeInstance()


@pytest.mark.parametrize(("adhesion", "deceleration"), [(0.15, 1.4), (0.08, 0.08 * G)])
def test_the_emergency_brake_has_its_own_lag_and_the_same_rail(
    tmp_path: Path, adhesion: float, deceleration: float
) -> None:
    """It overrides a driving demand."""
    slave = started(tmp_path, position=0.0, speed=8.0, adhesion=adhesion, emergency=1.0, demand=1.0)
    slave.run(20.0, 0.1)
    time, place = stop_of(0.0, 8.0, deceleration, 0.2, 0.0)
    assert stop_time(slave) == pytest.approx(time, rel=0, abs=1e-9)
    assert slave.get("position") == pytest.approx(place, rel=0, abs=1e-9)
    slave.freeInstance()


def test_the_brake_s_work_is_the_kinetic_energy(tmp_path: Path) -> None:
    """∫ effectiveness · nominal mass · |effort| v dt = ½ m v0², by Simpson's rule to the stop."""
    values = {"mass": 2.3e5, "effectiveness": 0.93, "speed": 7.0, "demand": -0.9, "lag": 0.4}
    slave = started(tmp_path / "a", **values)
    slave.run(20.0, 1.0)
    time, count = stop_time(slave), 4000
    step = time / count
    slave.freeInstance()
    slave = started(tmp_path / "b", **values)
    power = []
    for k in range(count + 1):
        power.append(-0.93 * 2e5 * slave.get("effort") * slave.get("speed"))
        slave.doStep(k * step, step)
    weights = np.array([1.0, *[4.0, 2.0] * (count // 2 - 1), 4.0, 1.0])
    work = step / 3.0 * float(weights @ np.array(power))
    assert work == pytest.approx(0.5 * 2.3e5 * 7.0**2, rel=1e-9)
    slave.freeInstance()


def test_the_brake_holds_and_does_not_push_back(tmp_path: Path) -> None:
    slave = started(tmp_path, speed=0.5, position=-1.0, demand=-1.2)
    slave.run(5.0, 0.1)
    place = slave.get("position")
    assert -1.0 < place < 0.0
    slave.doStep(5.0, 3600.0)
    assert (slave.get("position"), slave.get("speed")) == (place, 0.0)
    assert slave.get("effort") == pytest.approx(-1.2, rel=1e-9)
    slave.freeInstance()


@pytest.mark.parametrize("sign", [1, -1])
def test_traction_pushes_forwards_whichever_way_it_rolls(tmp_path: Path, sign: int) -> None:
    """Effort without lag to speak of: f held from the start at its demand."""
    slave = started(
        tmp_path, position=0.0, speed=0.4 * sign, effort=0.5, demand=0.5, drag=0.1, mass=4e5
    )
    slave.run(2.0, 0.1)
    # Half the acceleration at twice the mass; drag against the motion.
    if sign > 0:
        expected = 0.4 * 2.0 + 0.5 * 0.15 * 4.0, 0.4 + 0.15 * 2.0
    else:
        turn = 0.4 / 0.35
        expected = -0.2 * turn + 0.075 * (2.0 - turn) ** 2, 0.15 * (2.0 - turn)
    found = slave.get("position"), slave.get("speed")
    assert found == pytest.approx(expected, abs=1e-11)
    slave.freeInstance()


@pytest.mark.parametrize("name", ["lag", "emergency_lag"])
def test_a_lag_that_the_step_cannot_follow_is_refused(tmp_path: Path, name: str) -> None:
    slave = FMU2Named(build(stopping_train()), tmp_path)
    slave.set(name, 0.0)
    slave.fails(slave.initialize, name)
    slave.freeInstance()
