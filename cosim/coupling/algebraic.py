"""Coupled equations z = g(z): Newton's method and fixed-point iteration."""

from collections.abc import Callable, Sequence

import numpy as np

from ...base.errors import ConvergenceError, DiagramError, listing, suggest
from ..algorithms import FixedPoint, Newton, Solver

Map = Callable[[np.ndarray], np.ndarray]

_STEP = 2.0**-26  # of a difference, relative: half the digits of a float
_HALVINGS = 8
_FRESH = 0.1  # a step that leaves more of the residual than this asks for a new Jacobian


def solve(
    g: Map,
    start: np.ndarray,
    solver: Solver,
    *,
    names: Sequence[str],
    where: str,
    begins: bool,
    slopes: Map | None = None,
) -> np.ndarray:
    """Return z with |g(z) − z| ≤ tolerance · max(1, |z|); the last call of g was with that z.

    `slopes` returns the Jacobian of g (default: differences). `names` and `where` are for
    ConvergenceError, raised when there is no such z after the solver's iterations; `begins` says
    whether the start values were a guess and no earlier solution.
    """
    with np.errstate(all="ignore"):  # what runs away is told at the end
        z, residual = _iterated(g, start, solver, slopes)
        if _size(residual, z, solver) <= 1.0:
            return z
    raise ConvergenceError(_message(z, residual, solver, names, where, begins))


def _iterated(
    g: Map, start: np.ndarray, solver: Solver, slopes: Map | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the last z and its residual."""
    z = np.array(start, dtype=float)
    residual = _residual(g, z)
    jacobian: np.ndarray | None = None
    for _ in range(solver.iterations):
        if _size(residual, z, solver) <= 1.0:
            break
        if isinstance(solver, FixedPoint):
            z = z + solver.relaxation * residual
            residual = _residual(g, z)
            continue
        if not np.isfinite(residual).all():
            break
        if jacobian is None:
            jacobian = _jacobian(g, z, residual, slopes)
        try:
            move = np.linalg.solve(jacobian, -residual)
        except np.linalg.LinAlgError:
            break
        before = _size(residual, z, solver)
        z, residual = _damped(g, z, move, before, solver)
        if not _size(residual, z, solver) <= _FRESH * before:
            jacobian = None
    return z, residual


def _residual(g: Map, z: np.ndarray) -> np.ndarray:
    return g(z) - z


def _size(residual: np.ndarray, z: np.ndarray, solver: Solver) -> float:
    """Return the largest residual in units of what is tolerated; nan stays nan."""
    return float(np.max(np.abs(residual) / (solver.tolerance * np.maximum(1.0, np.abs(z)))))


def _jacobian(g: Map, z: np.ndarray, residual: np.ndarray, slopes: Map | None) -> np.ndarray:
    n = len(z)
    if slopes is not None:
        return slopes(z) - np.eye(n)
    columns = np.empty((n, n))
    for i in range(n):
        h = _STEP * max(1.0, abs(z[i]))
        shifted = z.copy()
        shifted[i] += h
        try:
            columns[:, i] = (_residual(g, shifted) - residual) / (shifted[i] - z[i])
        except (ArithmeticError, ValueError):
            shifted[i] = z[i] - h
            columns[:, i] = (_residual(g, shifted) - residual) / (shifted[i] - z[i])
    return columns


def _damped(
    g: Map, z: np.ndarray, move: np.ndarray, before: float, solver: Newton
) -> tuple[np.ndarray, np.ndarray]:
    """Return the next point: the whole move, or a part of it that stays in the equations' domain.

    Where no part makes the residual smaller, the smallest is taken: Newton may have to climb.
    """
    part, failure = 1.0, None
    point, residual = z, np.full_like(z, np.nan)
    for attempt in range(_HALVINGS + 1):
        point = z + part * move
        try:
            residual = _residual(g, point)
        except (ArithmeticError, ValueError) as error:
            failure = error
        else:
            size = _size(residual, point, solver)
            if size < before or (attempt == _HALVINGS and np.isfinite(size)):
                return point, residual
        part *= 0.5
    if failure is not None:
        raise failure
    return point, residual


def _message(
    z: np.ndarray,
    residual: np.ndarray,
    solver: Solver,
    names: Sequence[str],
    where: str,
    begins: bool,
) -> str:
    triples = zip(names, z, residual, strict=True)
    shown = [f"{n} = {v:.6g} (residual {r:.2g})" for n, v, r in triples]
    remedies = ["use Newton()"] if isinstance(solver, FixedPoint) else []
    remedies.append(
        "give a start value by guess" if begins else "take a smaller step or a larger tolerance"
    )
    return (
        f"{where}: {type(solver).__name__} does not converge in {solver.iterations} iterations to "
        f"a tolerance of {solver.tolerance:g}: {listing(shown, 6)}; {' or '.join(remedies)}"
    )


def check_guess(solver: Solver | None, signals: Sequence[str]) -> None:
    """Raise DiagramError for a guess of a signal that is not among those that may be unknown."""
    for name in solver.guess if solver is not None else ():
        if name not in signals:
            raise DiagramError(
                f"guess: '{name}' is no signal to be solved for; those in algebraic loops and FMU "
                f"outputs are: {listing(signals)}{suggest(name, signals)}"
            )


def start_values(solver: Solver, names: Sequence[str], present: Sequence[float]) -> np.ndarray:
    """Return start values: those that the solver's guess gives, else the present ones."""
    return np.array([solver.guess.get(n, v) for n, v in zip(names, present, strict=True)])
