"""Master algorithms as values: how the FMUs of a diagram are stepped together.

All share the tick: at t_k the outputs of all blocks are computed in feedthrough order and the row
is recorded; then Python blocks are updated and the FMUs go from t_k to t_{k+1}. An algorithm says
what their inputs are over that step:

1. value and, with extrapolation 1, slope of each input are formed from the signals;
2. fmi2SetXXX, fmi2SetRealInputDerivatives (where slopes are given and the FMU takes them, else the
   value in the middle of the step), fmi2DoStep, fmi2GetXXX, for one FMU after the other;
3. `GaussSeidel` carries the outputs at t_{k+1} on to the FMUs that come later; `Iterated` restores
   the FMUs' states and repeats 1 and 2 until inputs and outputs agree at t_{k+1}.

Only what belongs to a continuous signal has a slope (see Block.continuous), all else is held. FMUs
with a period longer than the base step take their inputs at their own hits and hold them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ..base.errors import ParameterError


def _require(value: object, condition: bool, what: str) -> None:
    if not condition:
        raise ParameterError(f"{type(value).__name__}: {what}")


def _is_positive(number: object) -> bool:
    return isinstance(number, float | int) and math.isfinite(number) and number > 0


@dataclass(frozen=True, kw_only=True)
class Newton:
    """Newton's method on coupled equations y = g(y).

    Converged when each |g(y) − y| ≤ tolerance · max(1, |y|). Derivatives are differences, or the
    FMUs' directional derivatives ("directional", where all FMUs concerned provide them; during
    the run these are the direct feedthrough alone). `guess` gives start values by "block.port".
    """

    tolerance: float = 1e-10
    iterations: int = 20
    derivatives: Literal["finite", "directional"] = "finite"
    guess: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_solver(self, self.tolerance, self.iterations, self.guess)
        good = self.derivatives in ("finite", "directional")
        _require(self, good, f"derivatives are 'finite' or 'directional': {self.derivatives!r}")


@dataclass(frozen=True, kw_only=True)
class FixedPoint:
    """Fixed-point iteration y ← y + relaxation · (g(y) − y); convergence as in Newton."""

    tolerance: float = 1e-10
    iterations: int = 200
    relaxation: float = 1.0
    guess: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_solver(self, self.tolerance, self.iterations, self.guess)
        good = _is_positive(self.relaxation) and self.relaxation <= 2.0
        _require(self, good, f"relaxation must lie in (0, 2], not {self.relaxation!r}")


Solver = Newton | FixedPoint


def _check_solver(value: Solver, tolerance: float, iterations: int, guess: object) -> None:
    _require(value, _is_positive(tolerance), f"tolerance must be positive, not {tolerance!r}")
    good = isinstance(iterations, int) and iterations > 0
    _require(value, good, f"iterations must be a whole number from 1, not {iterations!r}")
    good = isinstance(guess, Mapping) and all(
        isinstance(v, float | int) and math.isfinite(v) for v in guess.values()
    )
    _require(value, good, f'guess maps "block.port" to finite numbers, not {guess!r}')


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """What all algorithms share.

    `extrapolation` is the order of the polynomial that inputs follow over a step. `loops` solves
    algebraic loops of blocks and coupled initial equations; without it they are refused.
    """

    extrapolation: int = 0
    loops: Solver | None = None

    def __post_init__(self) -> None:
        good = self.extrapolation in (0, 1) and not isinstance(self.extrapolation, bool)
        _require(self, good, f"extrapolation is 0 or 1, not {self.extrapolation!r}")
        good = self.loops is None or isinstance(self.loops, Newton | FixedPoint)
        _require(self, good, f"loops is Newton(…), FixedPoint(…) or None, not {self.loops!r}")


@dataclass(frozen=True, kw_only=True)
class TwoPhase(Algorithm):
    """All FMUs step in parallel from the signals at t_k: the default, and Simulink's semantics."""


@dataclass(frozen=True, kw_only=True)
class Jacobi(Algorithm):
    """All blocks with direct feedthrough are stepped in parallel too, Python blocks and all.

    What such a block computes from its inputs at t_k shows at its next hit: one more step of delay
    than `TwoPhase` has, as in masters that know slaves only (libcosim, Ecos). Blocks without
    feedthrough, sources and `Delay` are as in `TwoPhase`, and so are diagrams of FMUs alone.
    """


@dataclass(frozen=True, kw_only=True)
class GaussSeidel(Algorithm):
    """FMUs step one after the other; later ones read the outputs at t_{k+1} of earlier ones.

    `order` names the FMUs, first to last (default: those that feed through come after what drives
    them, as far as they can, else the order in which they were added). What a later FMU reads is
    held at that value with extrapolation 0, and a line from y(t_k) to it with 1.
    """

    order: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        good = self.order is None or (
            isinstance(self.order, tuple | list) and all(isinstance(n, str) for n in self.order)
        )
        _require(self, good, f"order names FMU blocks, not {self.order!r}")
        if self.order is not None:
            object.__setattr__(self, "order", tuple(self.order))


@dataclass(frozen=True, kw_only=True)
class Iterated(Algorithm):
    """The step of FMUs that drive each other is repeated until inputs and outputs agree at its end.

    Inputs are held at u(t_{k+1}) with extrapolation 0, and a line from u(t_k) to it with 1. FMUs
    outside such a circle are stepped once, after what drives them. `solver` also solves
    algebraic loops of blocks and coupled initial equations. FMUs in a circle must be able to
    restore their state.
    """

    solver: Solver = field(default_factory=Newton)

    def __post_init__(self) -> None:
        if self.loops is None:
            object.__setattr__(self, "loops", self.solver)
        super().__post_init__()
        good = isinstance(self.solver, Newton | FixedPoint)
        _require(self, good, f"solver is Newton(…) or FixedPoint(…), not {self.solver!r}")


@dataclass(frozen=True, kw_only=True)
class StepDoubling:
    """Step-size control: a step of h against two of h/2, from a saved state.

    Where the difference of a signal exceeds tolerance · scale, both are undone and h is halved;
    where it would do so by far, the next h is doubled, up to the base step. `scale` gives the size
    of FMU outputs by "block.port" (default 1 of the port's unit). `smallest` is the least h as a
    part of the base step, a power of 1/2. All FMUs must be able to restore their state. Rows are
    those of the base step.
    """

    inner: TwoPhase | GaussSeidel | Iterated = field(
        default_factory=lambda: GaussSeidel(extrapolation=1)
    )
    tolerance: float = 1e-4
    scale: Mapping[str, float] = field(default_factory=dict)
    smallest: float = 2.0**-20

    def __post_init__(self) -> None:
        good = isinstance(self.inner, TwoPhase | GaussSeidel | Iterated)
        _require(self, good, f"inner is TwoPhase, GaussSeidel or Iterated, not {self.inner!r}")
        good = _is_positive(self.tolerance)
        _require(self, good, f"tolerance must be positive, not {self.tolerance!r}")
        good = isinstance(self.scale, Mapping) and all(map(_is_positive, self.scale.values()))
        _require(self, good, f'scale maps "block.port" to positive numbers, not {self.scale!r}')
        good = _is_positive(self.smallest) and self.smallest <= 1 and self.depth <= 40
        _require(self, good, f"smallest must be a power of 1/2 from 2**-40, not {self.smallest!r}")
        good = 2.0**-self.depth == self.smallest
        _require(self, good, f"smallest must be a power of 1/2, not {self.smallest!r}")

    @property
    def loops(self) -> Solver | None:
        """The solver of the inner algorithm."""
        return self.inner.loops

    @property
    def extrapolation(self) -> int:
        """The extrapolation of the inner algorithm."""
        return self.inner.extrapolation

    @property
    def depth(self) -> int:
        """How often the base step may be halved."""
        return -math.frexp(self.smallest)[1] + 1


Master = TwoPhase | Jacobi | GaussSeidel | Iterated | StepDoubling
