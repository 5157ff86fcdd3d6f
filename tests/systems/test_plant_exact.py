"""The train's FMU against the exact solution of its differential equation."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from railcosim import Diagram, Fmu, Profile, Step

# Retyped from the sheet: s² + 0.4356 s + 0.0324, numerator 0.07128.
A = np.array([[0.0, 1.0], [-0.0324, -0.4356]])
B = np.array([0.0, 0.07128])


def exact(times: np.ndarray, inputs: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """Return the states under inputs held from each time to the next."""
    m = np.zeros((3, 3))
    m[:2, :2], m[:2, 2] = A, B
    rows, x = [x0], x0
    for k in range(len(times) - 1):
        x = (expm(m * (times[k + 1] - times[k])) @ np.append(x, inputs[k]))[:2]
        rows.append(x)
    return np.array(rows)


@pytest.mark.parametrize("step", [0.002, 0.05, 0.1, 1.0, 10.0])
def test_step_response_over_100_s(train_fmu: Path, step: float) -> None:
    diagram = Diagram("exact", step=step)
    diagram.add("u", Step(to=1.0))
    diagram.add("train", Fmu(train_fmu, speed=3.0, acceleration=-0.5))
    diagram.connect("u.y", "train.u")
    run = diagram.run(100.0)
    expected = exact(run.time, run["u.y"], np.array([3.0, -0.5]))
    assert np.max(np.abs(run["train.speed"] - expected[:, 0])) <= 1e-11
    assert np.max(np.abs(run["train.acceleration"] - expected[:, 1])) <= 1e-11


@pytest.mark.parametrize("step", [0.05, 1.0])
def test_inputs_over_the_whole_range(train_fmu: Path, step: float) -> None:
    diagram = Diagram("exact", step=step)
    points = ((0.0, 10.0), (20.0, -10.0), (20.0, 5.0), (60.0, 10.0), (100.0, -10.0))
    diagram.add("u", Profile(points))
    diagram.add("train", Fmu(train_fmu))
    diagram.connect("u.y", "train.u")
    run = diagram.run(100.0)
    expected = exact(run.time, run["u.y"], np.zeros(2))
    assert np.max(np.abs(run["train.speed"] - expected[:, 0])) <= 1e-11


def test_runge_kutta_has_order_four(train_fmu: Path) -> None:
    """At inner steps large enough for the error to stand out of the rounding."""
    errors = []
    for inner in (1.0, 0.5, 0.25):
        diagram = Diagram("order", step=2.0)
        diagram.add("train", Fmu.with_values(train_fmu, {"u": 1.0, "solver.inner_step": inner}))
        run = diagram.run(20.0)
        expected = exact(run.time, np.ones(len(run.time)), np.zeros(2))
        errors.append(np.max(np.abs(run["train.speed"] - expected[:, 0])))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([4.0, 4.0], abs=0.3)


def test_parameters_mean_what_they_say(train_fmu: Path) -> None:
    """Steady speed is K u, and wn sets the time scale."""
    diagram = Diagram("gain", step=1.0)
    diagram.add("train", Fmu(train_fmu, u=2.0, gain=2.64, natural_frequency=0.36))
    run = diagram.run(200.0)
    assert run["train.speed"][-1] == pytest.approx(2.0 * 2.64, rel=1e-9)
    slow = Diagram("slow", step=2.0)
    slow.add("train", Fmu(train_fmu, u=2.0, gain=2.64))
    assert slow.run(400.0)["train.speed"] == pytest.approx(run["train.speed"], abs=1e-9)
