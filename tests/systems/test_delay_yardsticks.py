"""Delay differential equations whose solutions are known, over an FMU, a gain and a delay."""

import math

import numpy as np
import pytest

from railcosim import Delay, Diagram, Fmu, Gain, Run
from railcosim.fmus import build
from tests import plants


def retarded(gain: float, step: float, stop: float, *, delay: float = 1.0) -> Run:
    """x' = −gain · x(t − delay), history 1, with the input held over each step."""
    diagram = Diagram("retarded", step=step)
    diagram.add("plant", Fmu(build(plants.integrator(start=1.0))))
    diagram.add("link", Delay(delay, initial=1.0))
    diagram.add("minus", Gain(-gain, input_unit="1", unit="1/s"))
    diagram.connect("plant.x", "link.u")
    diagram.connect("link.y", "minus.u")
    diagram.connect("minus.y", "plant.u")
    return diagram.run(stop)


def test_method_of_steps_with_order_one() -> None:
    """x(3) = −1/6: x = 1 − t, then 1/2 − t + … by integrating the piece before."""
    errors = []
    for step in (0.1, 0.05, 0.025, 0.0125):
        errors.append(abs(retarded(1.0, step, 3.0)["plant.x"][-1] + 1.0 / 6.0))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(1.0, abs=0.05)
    assert errors[-1] < 0.01


def test_the_first_second_is_exact() -> None:
    """Until t = 1 the input is the constant history: x = 1 − t."""
    run = retarded(1.0, 0.05, 1.0)
    assert run["plant.x"] == pytest.approx(1.0 - run.time, abs=1e-14)


def boundary(step: float) -> float:
    """Return the gain at which oscillations neither grow nor decay, by bisection."""

    def grows(gain: float) -> bool:
        x = np.abs(retarded(gain, step, 400.0)["plant.x"])
        third = len(x) // 3
        return float(x[-third:].max()) > float(x[third : 2 * third].max())

    low, high = 1.3, 1.7
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return 0.5 * (low + high)


def test_the_stability_boundary_shows_no_hidden_step() -> None:
    """K = (2/h) sin(π / (2 (2d + 1))) with d = 20 steps; one hidden step would make it d = 21."""
    h, d = 0.05, 20
    expected = 2.0 / h * math.sin(math.pi / (2.0 * (2 * d + 1)))
    assert expected == pytest.approx(1.5321, abs=1e-4)
    hidden = 2.0 / h * math.sin(math.pi / (2.0 * (2 * (d + 1) + 1)))
    assert hidden == pytest.approx(1.4609, abs=1e-4)
    assert boundary(h) == pytest.approx(expected, abs=2e-4)
