"""The metro trains against scipy: its equations retyped from the sheet, its events located anew."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.fmus import build
from railcosim.models import coarse_metro_train, metro_train
from tests.instances import FMU2Named

PERIOD = 0.25  # s between changes of the commands
LINE = [(0.0, -3.0), (60.0, 5.0), (110.0, 5.0), (150.0, -12.0)]  # m, per mille
LENGTH = 40.0


@pytest.fixture
def train(tmp_path: Path) -> Iterator[Any]:
    made: list[FMU2Named] = []

    def start(plant: Any, **values: float) -> FMU2Named:
        slave = FMU2Named(build(plant), tmp_path / str(len(made)))
        for name, value in values.items():
            slave.set(name.replace("__", "[") + ("]" if "__" in name else ""), value)
        slave.initialize()
        made.append(slave)
        return slave

    yield start
    for slave in made:
        slave.freeInstance()


def line() -> dict[str, float]:
    places = {f"gradient_position__{k}": x for k, (x, _) in enumerate(LINE, 1)}
    return {**places, **{f"gradient__{k}": i for k, (_, i) in enumerate(LINE, 1)}}


def resisted(s: float, v: float) -> float:
    """Davis and the gradient's mean over the train, by the heights of its ends."""

    def height(x: float) -> float:
        ends = [*(x for x, _ in LINE[1:]), 1e9]
        total, begin = min(x, LINE[1][0]) * LINE[0][1], LINE[1][0]
        for (_, slope), end in zip(LINE[1:], ends[1:], strict=True):
            total += slope * max(0.0, min(x, end) - begin)
            begin = end
        return total

    kmh = 3.6 * v
    slope = (height(s) - height(s - LENGTH)) / LENGTH
    return (2.031 + 0.0622 * kmh + 0.001807 * kmh**2 + slope) * 9.81 / 1000


def reference(commands: np.ndarray, v0: float, p: dict[str, float]) -> tuple[np.ndarray, list[Any]]:
    """Return (position, speed) after each period, and (what, when) of the events."""
    x, t_sw, stands = np.array([0.0, v0, 0.0, 0.0]), None, False
    rows, happened, t = [x[:2]], [], 0.0

    def slope(t: float, x: np.ndarray, ue: float, ua: float, up: float) -> list[float]:
        s, v, be, bp = x
        onset = np.inf if t_sw is None else t_sw + p["t3"]
        w = 1.0 if t < onset else max(0.0, 1.0 - p["kb"] * (t - onset) / 0.7)
        kmh = 3.6 * v
        asked = (min(ua, 0.0) if t >= onset else 0.0) + min(up, 0.0)
        air = p["k"] * (kmh + 150) / (2 * kmh + 150) * asked / p["mu"]
        pull = min(p["p1"] * ue / p["mu"], min(280e3, 2.8e6 / v) / 240e3 if v > 0.1 else 1e9)
        return [v, w * be + bp - resisted(s, v), (pull - be) / p["t2"], (air - bp) / p["t4"]]

    for ue, ua, up in commands:
        end = t + PERIOD
        while t < end and not stands:
            onset = [] if t_sw is None else [t_sw + p["t3"], t_sw + p["t3"] + 0.7 / p["kb"]]
            to = min([end, *(m for m in onset if m > t + 1e-13)])

            def switch(t: float, x: np.ndarray, *_: float, over: bool = t_sw is not None) -> float:
                return 1.0 if over else x[1] - p["vsw"]

            def stop(t: float, x: np.ndarray, *_: float) -> float:
                return x[1]

            switch.terminal = stop.terminal = True  # type: ignore[attr-defined]
            switch.direction = stop.direction = -1.0  # type: ignore[attr-defined]
            # A hair before an instant at which the equations jump, so that no stage lies on it.
            found = solve_ivp(slope, (t + 1e-14, to - 1e-14), x, args=(ue, ua, up), method="DOP853",
                              rtol=1e-12, atol=1e-13, events=[switch, stop])  # fmt: skip
            x = found.y[:, -1]
            t = float(found.t[-1]) if found.status == 1 else to
            if len(found.t_events[0]):
                t_sw = t
                happened.append(("changeover", t))
            if len(found.t_events[1]):
                stands, x[1] = True, 0.0
                happened.append(("stop", t))
        t = end
        rows.append(x[:2].copy())
    return np.array(rows), happened


@pytest.mark.parametrize("probes", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_a_stop_is_the_one_of_scipy(train: Any, seed: int, probes: bool) -> None:
    rng = np.random.default_rng(seed)
    p = {"p1": rng.uniform(0.8, 0.9), "mu": rng.uniform(0.94, 1.06), "t2": rng.uniform(0.7, 0.95),
         "t3": rng.uniform(0.6, 1.0), "t4": rng.uniform(1.4, 2.1), "k": rng.uniform(0.77, 0.93),
         "vsw": rng.uniform(0.8, 3.6), "kb": rng.uniform(0.24, 1.3)}  # fmt: skip
    commands = np.zeros((160, 3))
    commands[:, :2] = rng.uniform(-1.0, -0.5, (160, 2))
    commands[:8, :2] = rng.uniform(-0.2, 0.5, (8, 2))
    v0 = rng.uniform(10.0, 14.0)
    if probes:  # at any time, half of them upwards: those do nothing
        commands[:, 2] = rng.uniform(-0.3, 0.3, 160)
    slave = train(
        metro_train(gradients=4, probe=probes), **line(), speed=v0, length=LENGTH,
        electric_coefficient=p["p1"], mass_ratio=p["mu"], electric_lag=p["t2"],
        air_delay=p["t3"], air_lag=p["t4"], air_numerator=p["k"] * 100 * 0.01191,
        changeover_speed=p["vsw"], fade_rate=p["kb"],
    )  # fmt: skip
    rows = [(0.0, v0)]
    for k, (electric, air, probe) in enumerate(commands):
        slave.set("electric_command", electric)
        slave.set("air_command", air)
        if probes:
            slave.set("air_probe", probe)
        slave.doStep(k * PERIOD, PERIOD)
        rows.append((slave.get("position"), slave.get("speed")))
    expected, happened = reference(commands, v0, p)
    assert [what for what, _ in happened] == ["changeover", "stop"]
    # An inner step of 10 ms passes over the kinks of the gradient: within 1 µm and 1 µm/s.
    assert np.abs(np.array(rows) - expected).max() < 1e-6
    assert slave.get("changeover_time") == pytest.approx(happened[0][1], rel=0, abs=1e-6)
    assert rows[-1][1] == 0.0
    assert slave.get("standstill") == 1


def test_standing_it_holds_until_traction_exceeds_the_resistance(train: Any) -> None:
    """Uphill without brakes it does not roll back, downhill not forwards; then it drives off."""
    for slope in (-30.0, 30.0):
        slave = train(metro_train(gradients=1), gradient__1=slope)
        slave.doStep(0.0, 100.0)
        assert (slave.get("position"), slave.get("speed")) == (0.0, 0.0)
        slave.set("electric_command", 0.5)
        slave.doStep(100.0, 10.0)
        assert slave.get("speed") > 0.0
        assert slave.get("standstill") == 0


def test_a_departure_is_the_linear_equations_own(train: Any) -> None:
    """Downhill, resistance zero: v(t) of a lagged step, and the phase follows the speed."""
    slave = train(metro_train(gradients=1), davis_a=0.0, davis_b=0.0, davis_c=0.0)
    slave.set("electric_command", 0.4)
    slave.doStep(0.0, 20.0)
    pull = 0.85 * 0.4
    v = pull * (20.0 - 0.83 * (1.0 - np.exp(-20.0 / 0.83)))
    assert slave.get("speed") == pytest.approx(v, rel=0, abs=1e-7)
    assert slave.get("phase") == 1
    # Work at the wheel is kinetic energy where nothing resists.
    assert slave.get("traction_energy") == pytest.approx(0.5 * 240e3 * v * v, rel=1e-6)


def test_after_a_stop_it_departs_and_brakes_below_the_changeover_speed(train: Any) -> None:
    slave = train(metro_train(gradients=1), speed=5.0)
    slave.set("electric_command", -0.8)
    slave.set("air_command", -0.8)
    slave.doStep(0.0, 20.0)
    assert (slave.get("standstill"), slave.get("phase")) == (1, 4)
    place = slave.get("position")
    slave.set("electric_command", 0.5)
    slave.set("air_command", 0.5)
    slave.doStep(20.0, 6.0)
    assert 0.0 < slave.get("speed") < 12.0 / 3.6
    assert slave.get("phase") == 0
    assert slave.get("air_brake_on") == 0.0
    slave.set("electric_command", -0.8)
    slave.set("air_command", -0.8)
    slave.doStep(26.0, 20.0)
    assert (slave.get("standstill"), slave.get("phase")) == (1, 4)
    assert slave.get("changeover_time") == 26.0
    assert slave.get("position") > place


def test_traction_is_limited_by_force_and_power(train: Any) -> None:
    for plant in (metro_train, coarse_metro_train):
        slave = train(plant(gradients=1), mass=400e3)
        name = "command" if plant is coarse_metro_train else "electric_command"
        slave.set(name, 1.0)
        slave.doStep(0.0, 8.0)
        v = slave.get("speed")
        r = (2.031 + 0.0622 * 3.6 * v + 0.001807 * (3.6 * v) ** 2) * 9.81e-3
        assert slave.get("acceleration") + r == pytest.approx(280e3 / 400e3, rel=1e-3)
        slave.doStep(8.0, 60.0)
        v = slave.get("speed")
        r = (2.031 + 0.0622 * 3.6 * v + 0.001807 * (3.6 * v) ** 2) * 9.81e-3
        # The lag lets the acceleration follow the falling limit a little late.
        assert slave.get("acceleration") + r == pytest.approx(2.8e6 / v / 400e3, rel=1e-2)


def test_the_coarse_train_is_one_lag(train: Any) -> None:
    """Against the closed form without resistance; a full brake command beyond 1 m/s² is cut."""
    slave = train(
        coarse_metro_train(gradients=1), davis_a=0.0, davis_b=0.0, davis_c=0.0, speed=14.0
    )
    slave.set("command", -1.5)
    slave.doStep(0.0, 10.0)
    v = 14.0 - (10.0 - 0.65 * (1.0 - np.exp(-10.0 / 0.65)))
    assert slave.get("speed") == pytest.approx(v, rel=0, abs=1e-9)
    slave.doStep(10.0, 10.0)
    assert (slave.get("speed"), slave.get("standstill")) == (0.0, 1)
