"""A quarter car in two FMUs, wheel and chassis, against the same car solved as one system.

The errors stated here are those of exact halves under each algorithm (numpy): the largest
difference of both positions (m) over 1 s, the car let go with its springs compressed.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from railcosim import Diagram, Fmu, Run, Step
from railcosim.base.errors import RailcosimError
from railcosim.cosim.algorithms import GaussSeidel, Iterated, Jacobi, StepDoubling, TwoPhase
from railcosim.fmus import build
from tests import coupled_plants
from tests.systems import master_references as references

SIZES = {"wheel.v": 10.0, "chassis.v": 10.0, "chassis.force": 1e4}
WHEEL, CHASSIS = 0.02, 0.05  # m, at the start


def car(step: float) -> Diagram:
    diagram = Diagram("quarter_car", step=step)
    diagram.add("wheel", Fmu(build(coupled_plants.wheel()), x=WHEEL, road=0.0))
    diagram.add("chassis", Fmu(build(coupled_plants.chassis()), x=CHASSIS))
    return coupled(diagram)


def coupled(diagram: Diagram) -> Diagram:
    diagram.connect("wheel.x", "chassis.wheel_x")
    diagram.connect("wheel.v", "chassis.wheel_v")
    diagram.connect("chassis.force", "wheel.force")
    return diagram


def halves(road: float = 0.0, wheel: Any = (WHEEL, 0.0), chassis: Any = (CHASSIS, 0.0)) -> Any:
    return references.quarter_car(road=road, wheel=np.array(wheel), chassis=np.array(chassis))


def positions(run: Run) -> np.ndarray:
    return np.column_stack([run["wheel.x"], run["chassis.x"]])


def error(run: Run) -> float:
    exact = references.whole(halves(), run.time)[:, [0, 2]]
    return float(np.max(np.abs(positions(run) - exact)))


ERRORS = {  # (algorithm, extrapolation): at steps of 10, 5, 2.5 and 1.25 ms
    ("TwoPhase", 0): (8.17e-3, 3.26e-3, 1.50e-3, 7.31e-4),
    ("Jacobi", 0): (8.17e-3, 3.26e-3, 1.50e-3, 7.31e-4),
    ("GaussSeidel", 0): (2.04e-3, 9.84e-4, 4.83e-4, 2.40e-4),
    ("Iterated", 0): (1.88e-3, 9.90e-4, 5.01e-4, 2.52e-4),
    ("TwoPhase", 1): (3.78e-3, 7.66e-4, 1.95e-4, 4.95e-5),
    ("Jacobi", 1): (3.78e-3, 7.66e-4, 1.95e-4, 4.95e-5),
    ("GaussSeidel", 1): (9.04e-4, 2.33e-4, 5.93e-5, 1.49e-5),
    ("Iterated", 1): (2.16e-4, 5.49e-5, 1.37e-5, 3.43e-6),
}
STEPS = (0.01, 0.005, 0.0025, 0.00125)
ALGORITHMS = {
    "TwoPhase": TwoPhase(),
    "Jacobi": Jacobi(),
    "GaussSeidel": GaussSeidel(order=("wheel", "chassis")),
    "Iterated": Iterated(),
}


@pytest.mark.parametrize(("name", "order"), ERRORS)
def test_error_at_each_step(name: str, order: int) -> None:
    algorithm = replace(ALGORITHMS[name], extrapolation=order)
    found = [error(car(h).run(1.0, algorithm=algorithm)) for h in STEPS]
    assert found == pytest.approx(ERRORS[name, order], rel=0.01)
    assert np.log2(found[-2] / found[-1]) == pytest.approx(order + 1, abs=0.1)


@cache
def steps_needed(tolerance: float, stop: float) -> int:
    """Return how many steps of equal size Gauss–Seidel needs, within 5 %."""

    def is_enough(count: int) -> bool:
        rows = references.in_order(halves(), stop / count, count, 1)[:, [0, 2]]
        exact = references.whole(halves(), np.linspace(0.0, stop, count + 1))[:, [0, 2]]
        return bool(np.max(np.abs(rows - exact)) <= tolerance)

    enough = 256
    while not is_enough(enough):
        enough *= 2
    few = enough // 2
    while enough > 1.05 * few:
        middle = (few + enough) // 2
        few, enough = (few, middle) if is_enough(middle) else (middle, enough)
    return few


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5])
@pytest.mark.parametrize("step", [0.05, 0.02])
def test_step_size_control_needs_fewer_steps(tolerance: float, step: float) -> None:
    """Both FMUs' steps are counted, the trial ones too."""
    stop = 3.0
    algorithm = StepDoubling(
        inner=GaussSeidel(order=("wheel", "chassis"), extrapolation=1),
        tolerance=tolerance, scale=SIZES,
    )  # fmt: skip
    run = car(step).run(stop, algorithm=algorithm)
    assert len(run.time) == round(stop / step) + 1
    assert error(run) <= tolerance
    assert run.info["steps"] < 2 * steps_needed(tolerance, stop)
    assert error(car(step).run(stop, algorithm=algorithm.inner)) > 10 * tolerance


@pytest.mark.parametrize(
    "inner", [TwoPhase(extrapolation=1), GaussSeidel(extrapolation=1), Iterated(extrapolation=1)]
)
def test_control_keeps_the_error_below_its_tolerance(inner) -> None:
    for tolerance in (1e-3, 1e-4, 1e-5):
        algorithm = StepDoubling(inner=inner, tolerance=tolerance, scale=SIZES)
        assert error(car(0.05).run(1.0, algorithm=algorithm)) <= tolerance


def test_without_a_scale_each_signal_counts_in_its_unit() -> None:
    """The force, in N, is then the strictest of all: more steps than where it counts in 10 kN."""
    steps = [
        car(0.05).run(0.5, algorithm=StepDoubling(tolerance=1e-2, scale=scale)).info["steps"]
        for scale in ({}, SIZES)
    ]
    assert steps[0] > 2 * steps[1]


def over_a_kerb(step: float, at: float) -> Diagram:
    diagram = Diagram("kerb", step=step)
    diagram.add("wheel", Fmu(build(coupled_plants.wheel())))
    diagram.add("chassis", Fmu(build(coupled_plants.chassis())))
    diagram.add("road", Step(at=at, to=0.05, unit="m"))
    diagram.connect("road.y", "wheel.road")
    return coupled(diagram)


def after_the_kerb(times: np.ndarray, at: float) -> np.ndarray:
    later = halves(0.05, (0.0, 0.0), (0.0, 0.0))
    rows = references.whole(later, np.maximum(times - at, 0.0))[:, [0, 2]]
    rows[times <= at] = 0.0
    return rows


@pytest.mark.parametrize("at", [0.2, 0.2123, 0.2477])
def test_a_kerb_between_two_steps(at: float) -> None:
    """Steps are divided at the kerb, and behind it by the tolerance."""
    algorithm = StepDoubling(tolerance=1e-4, scale=SIZES)
    run = over_a_kerb(0.05, at).run(1.0, algorithm=algorithm)
    assert np.max(np.abs(positions(run) - after_the_kerb(run.time, at))) <= 1e-4


def test_a_tolerance_out_of_reach_is_an_error_that_names_the_signal() -> None:
    algorithm = StepDoubling(tolerance=1e-14, smallest=2.0**-3, scale=SIZES)
    with pytest.raises(RailcosimError, match=r"t = 0(\.\d+)? s.*tolerance") as caught:
        car(0.02).run(0.2, algorithm=algorithm)
    message = str(caught.value)
    assert any(name in message for name in ("wheel.x", "wheel.v", "chassis.x", "chassis.v",
                                            "chassis.force"))  # fmt: skip


@pytest.mark.parametrize("order", [0, 1])
def test_of_a_step_and_two_halves_the_halves_are_kept(order: Any) -> None:
    """With a tolerance that is always met: three steps of each FMU, the rows those of h/2."""
    inner = GaussSeidel(order=("wheel", "chassis"), extrapolation=order)
    algorithm = StepDoubling(inner=inner, tolerance=1e6)
    run = car(0.01).run(0.3, algorithm=algorithm)
    assert run.info["steps"] == 2 * 3 * 30
    expected = references.in_order(halves(), 0.005, 60, order)[::2, [0, 2]]
    assert positions(run) == pytest.approx(expected, abs=1e-7)
