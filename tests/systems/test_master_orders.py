"""Orders of the master algorithms: two oscillators coupled by a spring, as two FMUs.

Errors are the Euclidean norm over both positions and speeds at T = 2. FMI lets the force that feeds
through be read only after a step; computed by blocks from both positions it belongs to t_k.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railcosim import Diagram, Fmu, Gain, Run, Sum
from railcosim.base.errors import DiagramError
from railcosim.cosim.algorithms import GaussSeidel, Iterated, Jacobi, Newton, TwoPhase
from railcosim.fmus import build
from tests import coupled_plants
from tests.coupled_diagrams import oscillator, wired
from tests.systems import master_references as references

STATES = ("one.x", "one.v", "two.x", "two.v")
EXACT = np.array([0.40031472, 0.46767615, 0.50435828, -0.58377053])
STEPS = (0.01, 0.005, 0.0025, 0.00125)
T = 2.0


def with_blocks(step: float) -> Diagram:
    """Neither FMU feeds through; blocks compute the force from positions and speeds."""
    blocks = {
        "one": Fmu(build(coupled_plants.driven_mass()), x=1.0),
        "two": Fmu(build(coupled_plants.silent_sprung_mass())),
        "stretch": Sum("+-"),
        "rate": Sum("+-"),
        "spring": Gain(100.0, input_unit="m", unit="N"),
        "damper": Gain(1.0, input_unit="m/s", unit="N"),
        "force": Sum("++"),
    }
    wires = (
        "one.x two.far stretch.u2", "two.x stretch.u1", "stretch.y spring.u", "spring.y force.u1",
        "one.v two.far_speed rate.u2", "two.v rate.u1", "rate.y damper.u", "damper.y force.u2",
        "force.y one.force",
    )  # fmt: skip
    return wired(Diagram("oscillator", step=step), blocks, *wires)


def states(run: Run) -> np.ndarray:
    return np.column_stack([run[name] for name in STATES])


def errors(make: Callable[[float], Diagram], algorithm: Any) -> tuple[np.ndarray, float]:
    """Return the errors at all steps, and the order that the finest pair shows."""
    ends = [states(make(h).run(T, algorithm=algorithm))[-1] for h in STEPS]
    found = np.array([np.linalg.norm(end - EXACT) for end in ends])
    return found, float(np.log2(found[-2] / found[-1]))


def test_the_solution_is_that_of_the_sheet() -> None:
    assert references.whole(references.oscillator(), np.array([T]))[0] == pytest.approx(
        EXACT, abs=5e-9
    )


@pytest.mark.parametrize(
    ("algorithm", "make", "coarse", "fine"),
    [
        (TwoPhase(), with_blocks, 1.07, 9.6e-2),
        (TwoPhase(extrapolation=1), with_blocks, 8.0e-2, 1.2e-3),
        (GaussSeidel(order=("one", "two")), oscillator, 0.82, 8.5e-2),
        (GaussSeidel(order=("one", "two")), with_blocks, 0.82, 8.5e-2),
        (GaussSeidel(order=("one", "two"), extrapolation=1), oscillator, 4.9e-2, 7.0e-4),
        (GaussSeidel(order=("one", "two"), extrapolation=1), with_blocks, 4.9e-2, 7.0e-4),
    ],
)
def test_errors_of_the_sheet(algorithm, make, coarse: float, fine: float) -> None:
    """Those of Jacobi belong to a force that both FMUs' outputs give at t_k."""
    found, order = errors(make, algorithm)
    assert found[0] == pytest.approx(coarse, rel=0.05)
    assert found[-1] == pytest.approx(fine, rel=0.05)
    assert order == pytest.approx(algorithm.extrapolation + 1, abs=0.1)


def rows_of(reference: Callable[..., np.ndarray], order: int, **options: int) -> np.ndarray:
    return reference(references.oscillator(), STEPS[0], round(T / STEPS[0]), order, **options)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(
    ("algorithm", "make", "reference", "options"),
    [
        (TwoPhase(), oscillator, references.parallel, {}),
        (Jacobi(), oscillator, references.parallel, {}),
        (TwoPhase(), with_blocks, references.parallel_with_outside_coupling, {}),
        (GaussSeidel(), oscillator, references.in_order, {}),
        (GaussSeidel(order=("one", "two")), with_blocks, references.in_order, {"first": 0}),
        (GaussSeidel(order=("two", "one")), oscillator, references.in_order, {"first": 1}),
        (Iterated(solver=Newton()), oscillator, references.iterated, {}),
        (Iterated(solver=Newton()), with_blocks, references.iterated, {}),
    ],
)
def test_every_row_is_that_of_the_algorithm(algorithm, make, reference, options, order) -> None:
    """Against exact halves; what is left is the FMUs' own solver, with inner steps of 2 ms."""
    expected = rows_of(reference, order, **options)
    run = make(STEPS[0]).run(T, algorithm=replace(algorithm, extrapolation=order))
    assert states(run) == pytest.approx(expected[:, :4], abs=3e-7 * np.abs(expected).max())
    if make is oscillator:
        size = np.abs(expected[:, 4]).max()
        assert run["two.force"] == pytest.approx(expected[:, 4], abs=1e-6 * size)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("algorithm", [Jacobi(), Iterated()])
def test_orders_of_the_others(algorithm, order: int) -> None:
    """Jacobi of FMUs that must be read after their step; it has its order only at 1.25 ms."""
    algorithm = replace(algorithm, extrapolation=order)
    ends = [states(oscillator(h).run(T, algorithm=algorithm))[-1] for h in (1 / 800, 1 / 1600)]
    coarse, fine = (np.linalg.norm(end - EXACT) for end in ends)
    assert np.log2(coarse / fine) == pytest.approx(order + 1, abs=0.1)


def test_the_coupling_as_blocks_is_three_hits_late_under_jacobi() -> None:
    """Difference, gain and sum are three slaves in a row, of which each adds a step."""
    run = with_blocks(STEPS[0]).run(0.5, algorithm=Jacobi())
    stretch, rate = run["two.x"] - run["one.x"], run["two.v"] - run["one.v"]
    assert run["force.y"][3:] == pytest.approx((100.0 * stretch + rate)[:-3], abs=1e-12)
    assert run["force.y"][0] == -100.0


def test_gauss_seidel_steps_first_what_feeds_nothing_through() -> None:
    """By default; whatever the order in which the FMUs were added."""
    turned = Diagram("turned", step=0.01)
    for name, block in reversed(list(oscillator(0.01).blocks.items())):
        turned.add(name, block)
    for target, source in oscillator(0.01).connections.items():
        turned.connect(str(source), str(target))
    run = turned.run(0.1, algorithm=GaussSeidel())
    assert list(run.info["order"]) == ["one", "two"]
    other = turned.run(0.1, algorithm=GaussSeidel(order=("two", "one")))
    assert list(other.info["order"]) == ["two", "one"]
    assert np.abs(states(run) - states(other)).max() > 1e-3


@pytest.mark.parametrize(
    ("order", "named"), [(("one",), "two"), (("one", "two", "tow"), "tow"), (("one", "one"), "one")]
)
def test_a_wrong_order_is_refused_by_name(order, named: str) -> None:
    with pytest.raises(DiagramError, match=named):
        oscillator(0.01).run(0.1, algorithm=GaussSeidel(order=order))
