"""A train of many vehicles as an FMU: against independent code, and what must hold exactly."""

from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp

from benchmarks.chain import chain
from railcosim.fmus import build
from railcosim.fmus.code import plant_c
from railcosim.fmus.functions import Functions
from railcosim.fmus.layout import Layout
from railcosim.models.solver import RungeKutta4
from tests.instances import FMU2Named


def start(n: int) -> np.ndarray:
    """Return speeds and positions of a train that swings."""
    i = np.arange(n)
    return np.concatenate([2.0 + 0.3 * np.sin(0.7 * i), 0.03 * np.cos(1.3 * i)])


def slopes(state: np.ndarray, traction: float, mass: np.ndarray) -> np.ndarray:
    """Return the chain's derivatives, retyped: SI units, V in km/h only in Davis' formula."""
    n = len(mass)
    v, x = state[:n], state[n:]
    stretch = x[:-1] - x[1:]
    force = 5e6 * stretch + 3.15e8 * stretch**3 + 5e4 * (v[:-1] - v[1:])
    km_h = 3.6 * np.abs(v)
    newton_per_kilonewton = 0.92 + 0.0048 * km_h + 0.000125 * km_h**2
    resistance = mass * 9.81e-3 * newton_per_kilonewton * v / np.hypot(v, 0.1)
    total = np.append(traction, force) - np.append(force, 0.0) - resistance
    return np.concatenate([total / mass, v])


def swinging(path: Path, n: int, folder: Path, **parameters: float) -> FMU2Named:
    slave = FMU2Named(path, folder)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal([*range(2 * n)], [*start(n)])
    for name, value in parameters.items():
        slave.set(name, value)
    slave.exitInitializationMode()
    return slave


def states(slave: FMU2Named, n: int) -> np.ndarray:
    return np.array(slave.getReal([*range(2 * n)]))


def test_102_vehicles_against_scipy(tmp_path: Path) -> None:
    n, traction, stop = 102, 600e3, 4.0
    mass = np.array([200e3] + [100e3] * (n - 1))
    path = build(chain(n), solver=RungeKutta4(inner_step=5e-4))
    slave = swinging(path, n, tmp_path, traction=traction)
    slave.run(stop, 0.1)
    exact = solve_ivp(
        lambda _, state: slopes(state, traction, mass),
        (0.0, stop),
        start(n),
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    ).y[:, -1]
    np.testing.assert_allclose(states(slave, n), exact, rtol=1e-9, atol=1e-10)
    x, v = exact[n:], exact[:n]
    stretch = x[:-1] - x[1:]
    force = 5e6 * stretch + 3.15e8 * stretch**3 + 5e4 * (v[:-1] - v[1:])
    assert slave.get("coupler.maximum") == pytest.approx(np.max(force), rel=1e-7)
    assert slave.get("coupler.first") == pytest.approx(force[0], rel=1e-7)
    assert slave.get("rear.position") == pytest.approx(x[-1], rel=1e-9)
    slave.freeInstance()


def test_momentum_without_external_forces(tmp_path: Path) -> None:
    n = 102
    none = dict.fromkeys(("constant", "linear", "quadratic"), 0.0)
    parameters = {f"resistance.{name}": value for name, value in none.items()}
    slave = swinging(build(chain(n)), n, tmp_path, **parameters)
    mass = np.array(slave.getReal([slave.vr[f"vehicle[{i + 1}].mass"] for i in range(n)]))
    before = float(mass @ states(slave, n)[:n])
    slave.run(10.0, 0.1)
    assert float(mass @ states(slave, n)[:n]) == pytest.approx(before, rel=1e-14)
    slave.freeInstance()


def test_a_coupler_pulls_what_hangs_on_it(tmp_path: Path) -> None:
    """Without resistance and after all swings: traction by trailing mass over total mass."""
    slave = FMU2Named(build(chain(4)), tmp_path)
    for name in ("constant", "linear", "quadratic"):
        slave.set(f"resistance.{name}", 0.0)
    slave.set("coupler.damping", 5e5)
    slave.set("traction", 500e3)
    slave.initialize()
    slave.run(60.0, 0.5)
    assert slave.get("coupler.first") == pytest.approx(500e3 * 300 / 500, rel=1e-6)
    assert slave.get("coupler.maximum") == slave.get("coupler.first")
    slave.freeInstance()


@pytest.mark.slow  # FMPy parses each of 5000 names by a grammar
def test_fmpy_finds_nothing_to_report_on_a_thousand_vehicles() -> None:
    assert validate_fmu(str(build(chain(1000)))) == []


def test_a_thousand_vehicles(tmp_path: Path) -> None:
    path = build(chain(1000))
    read_model_description(str(path), validate_model_structure=True)  # all but the names
    slave = FMU2Named(path, tmp_path)
    expected = {f"vehicle[{i}].{name}" for i in (1, 1000) for name in ("speed", "position", "mass")}
    assert expected <= slave.vr.keys()
    slave.set("traction", 500e3)
    slave.initialize()
    slave.run(0.5, 0.1)
    assert slave.get("vehicle[1].speed") > slave.get("vehicle[2].speed") > 0.0
    assert slave.get("vehicle[1000].speed") == 0.0  # the pull is not there yet
    slave.freeInstance()


def test_the_c_grows_slowly() -> None:
    lengths = [len(plant_c(Functions(Layout(chain(n))))) for n in (100, 1000)]
    assert lengths[1] < 1.5 * lengths[0]
