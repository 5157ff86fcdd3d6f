"""Exported DaeBuilders, run in fmpy, against scipy and written-down solutions."""

import math
from pathlib import Path
from typing import Any

import casadi as ca
import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp

from railcosim.base.errors import DeclarationError
from railcosim.fmus import build, export
from tests.daes import ball, chain, damper, thermostat


def simulate(fmu: Path, stop: float, step: float, **options: Any) -> np.ndarray:
    return fmpy.simulate_fmu(
        str(fmu),
        fmi_type="CoSimulation",
        stop_time=stop,
        step_size=step,
        output_interval=step,
        **options,
    )


def test_a_damper_follows_scipy() -> None:
    run = simulate(build(damper()), 4.0, 0.02, start_values={"force": 3.0, "mass": 1.5})

    def right(_: float, x: np.ndarray) -> list[float]:
        return [x[1], (3.0 - (8.0 * x[0] + 0.5 * x[1])) / 1.5]

    exact = solve_ivp(
        right, (0, 4), [1.0, 0.0], "DOP853", t_eval=run["time"], rtol=1e-12, atol=1e-12
    ).y
    np.testing.assert_allclose(run["position"], exact[0], atol=1e-9)
    np.testing.assert_allclose(run["pull"], 8.0 * exact[0] + 0.5 * exact[1], atol=1e-8)


def falling_from(start: float, restitution: float, time: np.ndarray) -> list[np.ndarray]:
    """Height, speed and bounces of a ball dropped at rest."""
    bounce, speed = math.sqrt(2.0 * start / 9.81), 0.0
    height, begun, count = start, 0.0, 0
    rows = []
    for t in time:
        while t > bounce:
            speed = -restitution * (speed - 9.81 * (bounce - begun))
            height, begun, count = 0.0, bounce, count + 1
            bounce = begun + 2.0 * speed / 9.81
        s = t - begun
        rows.append((height + speed * s - 4.905 * s * s, speed - 9.81 * s, count))
    return list(np.array(rows).T)


@pytest.mark.parametrize(("restitution", "stop"), [(0.8, 5.0), (0.6, 3.5)])
def test_a_ball_bounces_as_computed(restitution: float, stop: float) -> None:
    run = simulate(build(ball()), stop, 0.01, start_values={"restitution": restitution})
    height, speed, bounces = falling_from(5.0, restitution, run["time"])
    np.testing.assert_allclose(run["height"], height, atol=1e-7)
    np.testing.assert_allclose(run["speed"], speed, atol=1e-7)
    np.testing.assert_array_equal(run["bounces"], bounces)
    assert bounces[-1] >= 3


def test_a_thermostat_switches_when_it_must() -> None:
    run = simulate(build(thermostat()), 240.0, 0.5)
    time, warmth, heating, begun, begun_at = run["time"], 290.0, True, 0.0, []
    expected, on = [], []

    def level() -> float:
        return 310.0 if heating else 280.0

    def due() -> float:
        """When the warmth reaches its next limit."""
        limit = 295.0 if heating else 289.0
        return begun + 100.0 * math.log((warmth - level()) / (limit - level()))

    for t in time:
        while t > due():
            begun, warmth, heating = due(), 295.0 if heating else 289.0, not heating
            begun_at.append(begun)
        expected.append(level() + (warmth - level()) * math.exp(-(t - begun) / 100.0))
        on.append(heating)
    assert len(begun_at) > 4
    np.testing.assert_allclose(run["warmth"], expected, atol=1e-7)
    np.testing.assert_array_equal(run["heating"], on)
    ticks = np.flatnonzero(np.isclose(time % 10.0, 0.0) & (time > 0))
    np.testing.assert_allclose(run["seen"][ticks], run["warmth"][ticks], atol=1e-9)


def test_a_chain_of_vectors_follows_scipy() -> None:
    run = simulate(build(chain()), 3.0, 0.01, start_values={"k": 0.4, "m[2]": 4.0})
    m, u = np.array([1.0, 4.0, 3.0]), np.array([1.0, 2.0, 3.0])

    def rate(t: float, v: np.ndarray) -> np.ndarray:
        return (u * math.sin(t) - 1.2 * v * np.abs(v)) / m

    def right(t: float, x: np.ndarray) -> np.ndarray:
        return np.append(rate(t, x[:3]), u @ x[:3])

    exact = solve_ivp(
        right, (0, 3), [0.5, 0, -0.5, 0], "DOP853", t_eval=run["time"], rtol=1e-12, atol=1e-13
    ).y
    for i in range(3):
        # |v| has a kink, which costs the fixed step some accuracy
        np.testing.assert_allclose(run[f"v[{i + 1}]"], exact[i], atol=1e-6)
    np.testing.assert_allclose(run["work"], exact[3], atol=1e-6)
    jerk = np.array([2.0 * rate(t, v) for t, v in zip(run["time"], exact[:3].T, strict=True)])
    np.testing.assert_allclose(run["jerk[2]"], jerk[:, 1], atol=1e-5)


def test_an_exported_fmu_is_valid(tmp_path: Path) -> None:
    path = export(ball(), tmp_path / "ball.fmu")
    assert validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    assert description.modelName == "ball"
    experiment = description.defaultExperiment
    assert experiment is not None and float(experiment.stopTime or 0.0) == 6.0
    units = {v.name: v.unit for v in description.modelVariables}
    assert units["height"] == "m"


def test_what_cannot_be_exported_is_refused(tmp_path: Path) -> None:
    dae = ca.DaeBuilder("implicit")
    z = dae.add("z", "output")
    dae.eq(0, z**3 + z - 1)
    with pytest.raises(DeclarationError, match="DaeBuilder 'implicit'.*gives z implicitly"):
        export(dae, tmp_path / "implicit.fmu")
    assert not list(tmp_path.iterdir())
