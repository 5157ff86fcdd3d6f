"""a + b + c = s, 2 a − 3 b + 2 c = 9, a² + b² + c² = 5, as blocks, as FMUs, by repeated steps."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from railcosim import (
    Block,
    Constant,
    Diagram,
    Fmu,
    Ramp,
    SimulationError,
)
from railcosim.base.errors import AlgebraicLoopError, DiagramError
from railcosim.cosim.algorithms import (
    FixedPoint,
    GaussSeidel,
    Iterated,
    Jacobi,
    Newton,
    StepDoubling,
    TwoPhase,
)
from railcosim.fmus import build
from tests import coupled_plants

SMALL, LARGE = 0.6354248688935409, 1.1645751311064590  # 0.9 ∓ √0.07, for s = 0


@dataclass(frozen=True)
class First(Block):
    """a = s − b − c."""

    inputs = {"b": "1", "c": "1", "s": "1"}
    outputs = {"a": "1"}

    def step(self, x: Any, b: float, c: float, s: float) -> Any:
        return s - b - c, x


@dataclass(frozen=True)
class Second(Block):
    """b = (2 a + 2 c − 9) / 3."""

    inputs = {"a": "1", "c": "1"}
    outputs = {"b": "1"}

    def step(self, x: Any, a: float, c: float) -> Any:
        return (2.0 * a + 2.0 * c - 9.0) / 3.0, x


@dataclass(frozen=True)
class Third(Block):
    """c = √(5 − a² − b²)."""

    inputs = {"a": "1", "b": "1"}
    outputs = {"c": "1"}

    def step(self, x: Any, a: float, b: float) -> Any:
        return max(5.0 - a * a - b * b, 1e-12) ** 0.5, x


LOOP = (
    ("b", "first"), ("c", "first"), ("a", "second"), ("c", "second"), ("a", "third"), ("b", "third")
)  # fmt: skip
HOME = {"a": "first", "b": "second", "c": "third"}


def connected(diagram: Diagram, source: Block) -> Diagram:
    diagram.add("s", source)
    diagram.connect("s.y", "first.s")
    for unknown, reader in LOOP:
        diagram.connect(f"{HOME[unknown]}.{unknown}", f"{reader}.{unknown}")
    return diagram


def of_fmus(source: Block, *, step: float = 0.1) -> Diagram:
    diagram = Diagram("loop", step=step)
    for name in ("first", "second", "third"):
        diagram.add(name, Fmu(build(getattr(coupled_plants, f"{name}_equation")())))
    return connected(diagram, source)


def of_blocks(source: Block, *, step: float = 0.1) -> Diagram:
    diagram = Diagram("loop", step=step)
    diagram.add("first", First())
    diagram.add("second", Second())
    diagram.add("third", Third())
    return connected(diagram, source)


def unknowns(run: Any) -> np.ndarray:
    return np.column_stack([run["first.a"], run["second.b"], run["third.c"]])


def solution(s: Any) -> Any:
    """Return b and the pair {a, c} in ascending order for a given s."""
    s = np.asarray(s, dtype=float)
    b = (2.0 * s - 9.0) / 5.0
    total, squares = s - b, 5.0 - b * b
    half_gap = np.sqrt(0.5 * squares - 0.25 * total * total)
    return b, 0.5 * total - half_gap, 0.5 * total + half_gap


def assert_solved(rows: np.ndarray, s: Any, within: float = 1e-8) -> None:
    b, small, large = solution(s)
    assert rows[:, 1] == pytest.approx(b, abs=within)
    assert np.min(rows[:, [0, 2]], axis=1) == pytest.approx(small, abs=within)
    assert np.max(rows[:, [0, 2]], axis=1) == pytest.approx(large, abs=within)


def test_the_sheets_solution() -> None:
    b, small, large = solution(0.0)
    assert (b, small, large) == pytest.approx((-1.8, 0.635425, 1.164575), abs=5e-7)
    assert (small, large) == pytest.approx((SMALL, LARGE), abs=1e-15)


GUESS = {"first.a": 0.6, "second.b": -1.7, "third.c": 1.2}


@pytest.mark.parametrize("solver", [Newton(guess=GUESS), FixedPoint(relaxation=0.5, guess=GUESS)])
@pytest.mark.parametrize("algorithm", [TwoPhase, GaussSeidel, Iterated])
def test_as_blocks(solver, algorithm) -> None:
    """At every row, with s moving."""
    chosen = algorithm(solver=solver) if algorithm is Iterated else algorithm(loops=solver)
    run = of_blocks(Ramp(slope=0.1)).run(1.0, algorithm=chosen)
    assert_solved(unknowns(run), 0.1 * run.time)
    residual = run["first.a"] + run["second.b"] + run["third.c"] - 0.1 * run.time
    assert np.abs(residual).max() < 1e-8


@pytest.mark.parametrize("solver", [Newton(guess=GUESS), FixedPoint(relaxation=0.5, guess=GUESS)])
@pytest.mark.parametrize("algorithm", [TwoPhase, Jacobi, GaussSeidel, Iterated])
def test_as_fmus_in_initialization_mode(solver, algorithm) -> None:
    chosen = algorithm(solver=solver) if algorithm is Iterated else algorithm(loops=solver)
    run = of_fmus(Constant(0.0)).run(0.1, algorithm=chosen)
    assert_solved(unknowns(run)[:1], np.zeros(1))


@pytest.mark.parametrize("extrapolation", [0, 1])
@pytest.mark.parametrize("solver", [Newton(guess=GUESS), FixedPoint(relaxation=0.5, guess=GUESS)])
def test_as_fmus_by_repeated_steps(solver, extrapolation: Any) -> None:
    algorithm = Iterated(solver=solver, extrapolation=extrapolation)
    run = of_fmus(Ramp(slope=0.1)).run(1.0, algorithm=algorithm)
    # Held inputs: b comes from s as it was at the step's begin, the line has it at its end.
    late = run.time if extrapolation == 1 else np.maximum(run.time - 0.1, 0.0)
    assert_solved(unknowns(run), 0.1 * late)


def test_repeated_steps_with_directional_derivatives() -> None:
    algorithm = Iterated(solver=Newton(derivatives="directional", guess=GUESS), extrapolation=1)
    run = of_fmus(Ramp(slope=0.1)).run(1.0, algorithm=algorithm)
    assert_solved(unknowns(run), 0.1 * run.time)


def test_the_guess_chooses_between_two_solutions() -> None:
    for first, third in ((SMALL, LARGE), (LARGE, SMALL)):
        guess = {"first.a": first + 0.05, "second.b": -1.75, "third.c": third + 0.05}
        for make in (of_blocks, of_fmus):
            run = make(Constant(0.0)).run(0.1, algorithm=TwoPhase(loops=Newton(guess=guess)))
            assert unknowns(run)[0] == pytest.approx([first, -1.8, third], abs=1e-8)


def test_without_a_solver_fmus_that_need_each_other_at_the_start_are_refused() -> None:
    with pytest.raises(AlgebraicLoopError) as refused:
        of_fmus(Constant(0.0)).run(0.1)
    message = str(refused.value)
    assert sum(f"{HOME[n]}.{n}" in message for n in "abc") >= 2, message


def test_where_the_equations_lose_their_solution_the_rows_so_far_are_kept() -> None:
    """Beyond s = 1.35 there is no real a and c."""
    algorithm = Iterated(solver=Newton(guess=GUESS), extrapolation=1)
    with pytest.raises(SimulationError, match="third") as failed:
        of_fmus(Ramp(slope=1.0)).run(3.0, algorithm=algorithm)
    run = failed.value.run
    assert run.time[-1] == 1.3
    assert_solved(unknowns(run), run.time)


def test_a_guess_of_no_signal_is_refused() -> None:
    with pytest.raises(DiagramError, match="thrid"):
        of_blocks(Constant(0.0)).run(0.1, algorithm=TwoPhase(loops=Newton(guess={"thrid.c": 1.0})))


def test_step_doubling_with_an_inner_iteration_solves_the_loop() -> None:
    algorithm = StepDoubling(inner=Iterated(solver=Newton(guess=GUESS), extrapolation=1))
    run = of_fmus(Ramp(slope=0.1)).run(0.5, algorithm=algorithm)
    assert_solved(unknowns(run), 0.1 * run.time)
