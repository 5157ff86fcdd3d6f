"""Solvers that an FMU can carry, each as a frozen value: which method, and its start settings.

The numbers become parameters of the FMU (`solver.inner_step`, `solver.relative_tolerance`,
`solver.absolute_tolerance`), which a user may change before a run.
"""

from dataclasses import dataclass, fields

from ..base.errors import ParameterError


@dataclass(frozen=True, kw_only=True)
class Solver:
    """What all solvers have: `inner_step`, the largest inner step in s (from 1e-9 up)."""

    inner_step: float = 0.002

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            low = 1e-9 if field.name == "inner_step" else 1e-15
            if field.type is not float and field.type != "float":
                continue
            if not isinstance(value, int | float) or not low <= value < float("inf"):
                raise ParameterError(
                    f"{type(self).__name__}: {field.name} must be a number from {low:g} up, "
                    f"not {value!r}"
                )

    @property
    def settings(self) -> dict[str, float]:
        """The FMU's solver parameters (without their prefix) and their start values."""
        names = ("inner_step", "relative_tolerance", "absolute_tolerance")
        return {name: float(getattr(self, name)) for name in names if hasattr(self, name)}


@dataclass(frozen=True, kw_only=True)
class RungeKutta4(Solver):
    """The classical Runge-Kutta method of order 4 with fixed inner steps: the default."""


@dataclass(frozen=True, kw_only=True)
class SemiImplicitEuler(Solver):
    """Semi-implicit (symplectic) Euler for mechanical chains, fixed inner steps, order 1.

    First all other states advance by x + h f(x), then those named in `positions` with the
    others' new values. One evaluation of the equations each half; energy does not drift.
    """

    inner_step: float = 0.001
    positions: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class DormandPrince(Solver):
    """Dormand-Prince 5(4): explicit, with error control.

    The error of a step is kept below relative_tolerance · |x| + absolute_tolerance · nominal in
    the root mean square over the states. `inner_step` bounds the step.
    """

    inner_step: float = 0.1
    relative_tolerance: float = 1e-6
    absolute_tolerance: float = 1e-9


@dataclass(frozen=True, kw_only=True)
class Rodas(Solver):
    """RODAS 4(3) for stiff plants: a linearly implicit (Rosenbrock) method with error control.

    L-stable and stiffly accurate; six stages on one factorisation of 1/(hγ) − ∂f/∂x, whose
    Jacobian CasADi generates exactly, so that there is no Newton iteration that could fail
    (Hairer & Wanner, Solving Ordinary Differential Equations II, section IV.7). The matrix is
    dense: for plants of up to some hundred states. Error control as in `DormandPrince`.
    """

    inner_step: float = 1.0
    relative_tolerance: float = 1e-6
    absolute_tolerance: float = 1e-9
