"""The DC drive and the identified train on the line: what each says by itself."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from railcosim.fmus import build
from railcosim.models import Plant, dc_drive_train, second_order_train_on_line
from tests.instances import FMU2Named

G = 9.80665
M, L, R, C, KU, LAG, ADHESION = 16000.0, 2.5, 1.089, 36.0, 79.2, 0.4, 0.15
BOTH = pytest.mark.parametrize("plant", [dc_drive_train, second_order_train_on_line])


def started(plant: Callable[[], Plant], folder: Path, **values: float) -> FMU2Named:
    slave = FMU2Named(build(plant()), folder)
    for name, value in values.items():
        slave.set(name, value)
    slave.initialize()
    return slave


def test_the_numbers_are_the_identified_plant_s(tmp_path: Path) -> None:
    """0.07128, 0.4356 and 0.0324 to the last digits, from the FMU's start values."""
    p = started(dc_drive_train, tmp_path).get
    mass = p("mass") * p("rotary_mass_factor")
    assert mass == p("accelerated_mass") == 16000.0
    inertia = p("inductance") * mass
    gain = p("voltage_per_notch") * p("force_constant") / inertia
    assert gain == pytest.approx(0.07128, rel=1e-15)
    assert p("resistance") / p("inductance") == pytest.approx(0.4356, rel=1e-15)
    stiffness = p("emf_constant") * p("force_constant") / inertia
    assert stiffness == pytest.approx(0.0324, rel=1e-15)
    assert p("voltage_per_notch") / p("emf_constant") == pytest.approx(2.2, rel=1e-15)


def test_energy_from_the_wire_goes_into_heat_field_and_motion(tmp_path: Path) -> None:
    """∫ u i dt = ∫ R i² dt + ½ L i² + ½ M v² + brake work, by Simpson's rule at 10 ms."""
    slave = started(dc_drive_train, tmp_path, notch=7.0)
    step, rows = 0.01, []
    for k in range(6000):
        rows.append([slave.get(n) for n in ("current", "speed", "brake_force")])
        slave.set("brake", 12e3 if k >= 3000 else 0.0)
        slave.doStep(k * step, step)
    rows.append([slave.get(n) for n in ("current", "speed", "brake_force")])
    i, v, brake = np.array(rows).T
    power = KU * 7.0 * i - R * i * i - brake * v
    work = sum(simpson(power[a : a + 3001], step) for a in (0, 3000))  # a jump in between
    stored = 0.5 * L * i[-1] ** 2 + 0.5 * M * v[-1] ** 2
    assert v[-1] > 1.0
    assert work == pytest.approx(stored, rel=1e-9)
    assert slave.get("tractive_force") == pytest.approx(C * i[-1], rel=1e-15)
    slave.freeInstance()


def simpson(values: np.ndarray, step: float) -> float:
    inner = 4.0 * values[1:-1:2].sum() + 2.0 * values[2:-1:2].sum()
    return float(step / 3.0 * (values[0] + inner + values[-1]))


@BOTH
@pytest.mark.parametrize("brake", [8e3, 22e3, 32e3])
def test_the_brake_stops_it_as_its_equations_say(
    tmp_path: Path, plant: Callable[[], Plant], brake: float
) -> None:
    """Against scipy at 1e-12: the demand held within adhesion, then a lag, then dry friction."""
    held = min(brake, ADHESION * G * M)

    def slope(t: float, y: np.ndarray) -> list[float]:
        x, v, i, force = y
        del x
        friction = min(force, ADHESION * G * M)
        return [v, (C * i - friction) / M, (KU * 0.5 - C * v - R * i) / L, (held - force) / LAG]

    def standstill(t: float, y: np.ndarray) -> float:
        return y[1]

    standstill.terminal, standstill.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    found = solve_ivp(
        slope, (0.0, 60.0), [0.0, 15.0, 0.0, 0.0], "DOP853", events=standstill,
        rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    state = {"current": 0.0} if plant is dc_drive_train else {"traction": 0.0}
    slave = started(plant, tmp_path, speed=15.0, notch=0.5, brake=brake, **state)
    slave.run(60.0, 0.1)
    assert slave.get("position") == pytest.approx(found.y[0, -1], rel=0, abs=1e-9)
    assert (slave.get("speed"), slave.get("standstill")) == (0.0, 1)
    assert found.t[-1] < 60.0
    slave.freeInstance()


@BOTH
def test_the_friction_deceleration_stays_within_adhesion(
    tmp_path: Path, plant: Callable[[], Plant]
) -> None:
    """Also at once when the rail turns slippery under braking."""
    slave = started(plant, tmp_path, speed=20.0, brake=32e3, notch=20.0 / 2.2, adhesion=0.1)
    slave.run(3.0, 0.1)
    force = slave.get("brake_force")
    assert force / M == pytest.approx(0.1 * G, rel=1e-3)
    assert force <= 0.1 * G * M
    before = slave.get("acceleration")
    slave.set("adhesion", 0.05)
    assert slave.get("acceleration") - before == pytest.approx(force / M - 0.05 * G, rel=1e-12)
    slave.run(6.0, 0.1, start=3.0)
    assert slave.get("brake_force") >= 0.05 * G * M
    slave.freeInstance()


@BOTH
@pytest.mark.parametrize("lag", [0.0, 1e-4, 0.019])
def test_a_lag_that_the_step_cannot_follow_is_refused(
    tmp_path: Path, plant: Callable[[], Plant], lag: float
) -> None:
    slave = FMU2Named(build(plant()), tmp_path)
    slave.set("brake_lag", lag)
    slave.fails(slave.initialize, "brake_lag")
    slave.freeInstance()


@BOTH
def test_a_negative_brake_demand_is_none(tmp_path: Path, plant: Callable[[], Plant]) -> None:
    slave = started(plant, tmp_path, brake=-5e3, speed=2.0, notch=2.0 / 2.2)
    slave.run(5.0, 0.1)
    assert slave.get("brake_force") == 0.0


@BOTH
def test_the_line_breaker_ends_traction_at_once(plant: Callable[[], Plant], tmp_path: Path) -> None:
    """Open from 3 to 5 s: speed stays without a brake; then as from rest of the current."""
    slave = started(plant, tmp_path, notch=10.0, speed=4.0)
    traction = "current" if plant is dc_drive_train else "traction"
    for k in range(3):
        slave.doStep(float(k), 1.0)
    speed = slave.get("speed")
    assert slave.get(traction) > 0.0
    slave.set("trip", 1.0)
    slave.doStep(3.0, 1.0)
    slave.doStep(4.0, 1.0)
    assert slave.get("tripped") == 1
    assert slave.get(traction) == 0.0
    assert slave.get("acceleration") == 0.0
    assert slave.get("speed") == speed
    slave.set("trip", 0.0)
    slave.doStep(5.0, 0.7)
    assert slave.get("tripped") == 0
    a = np.array([[0.0, 1.0, 0.0], [-0.0324, -0.4356, 0.07128], [0.0, 0.0, 0.0]])
    expected = expm(0.7 * a) @ np.array([speed, 0.0, 10.0])
    assert slave.get("speed") == pytest.approx(expected[0], abs=1e-11)
    assert slave.get("acceleration") == pytest.approx(expected[1], abs=1e-11)
    slave.freeInstance()
