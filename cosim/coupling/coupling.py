"""The FMUs of a diagram over one tick, where straight-line code does not do.

That is: at events between ticks, and for algorithms that repeat or divide steps.
"""

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise
from typing import Any

from ...base.errors import FmuError
from ..algorithms import GaussSeidel, Iterated, StepDoubling
from ..fmu.instance import FmuInstance
from ..plan import Plan
from .doubling import Doubled
from .stepping import Fmus, InOrder, Repeated, Stepper, coupled_signals
from .within import Last, Tick

_START, _END = Fraction(0), Fraction(1)
# Of a tick: over less the outputs differ by rounding alone, which is no slope to go by.
_LEAST = Fraction(1, 1 << 30)


class Coupling:
    """Steps the FMUs of a plan that step at every tick.

    `is_always`: every tick comes here, for `tick`; else only those with events, for `split`.
    `extrapolated` are the FMU outputs whose last values are kept for extrapolation.
    """

    def __init__(self, plan: Plan, instances: Mapping[str, FmuInstance]) -> None:
        self.plan = plan
        algorithm = plan.algorithm
        self.is_always = isinstance(algorithm, Iterated | StepDoubling) and bool(plan.network.fmus)
        self.fmus = Fmus(plan, instances)
        inner = algorithm.inner if isinstance(algorithm, StepDoubling) else algorithm
        if isinstance(inner, Iterated):
            stepper: Stepper = Repeated(self.fmus, inner)
        else:
            stepper = InOrder(self.fmus, isinstance(inner, GaussSeidel))
        self.doubled: Doubled | None = None
        if isinstance(algorithm, StepDoubling):
            stepper = self.doubled = Doubled(self.fmus, algorithm, stepper)
        self.stepper = stepper
        self._require_states()
        read = coupled_signals(plan, plan.network.fmus) if algorithm.extrapolation else []
        self.extrapolated = () if self.is_always else tuple(read)
        self._outputs = tuple(
            j
            for i in plan.network.fmus
            for j in plan.nodes[i].outputs
            if plan.signals[j] not in plan.types
        )
        self.extrapolation = algorithm.extrapolation

    def _require_states(self) -> None:
        """Raise FmuError unless all FMUs whose step may be undone can restore their state."""
        plan = self.plan
        places: set[int] = set()
        if isinstance(plan.algorithm, Iterated):
            places = {i for c in plan.network.circles if coupled_signals(plan, c) for i in c}
        if isinstance(plan.algorithm, StepDoubling):
            places = set(plan.network.fmus)
        for i in sorted(places):
            instance = self.fmus.instances[plan.nodes[i].name]
            if not instance.can_restore:
                raise FmuError(
                    f"block '{instance.name}': {instance.path.name} cannot restore its state "
                    f"(canGetAndSetFMUstate), which {type(plan.algorithm).__name__} needs; "
                    "GaussSeidel or TwoPhase do without"
                )

    def tick(self, k: int, memory: tuple[Any, ...], *values: Any) -> tuple[Any, ...]:
        """Step the FMUs over tick k.

        `values` are the signals, then the states of the blocks between FMUs. `memory`, and what is
        returned for the next tick, are the span of the last step as a fraction of the tick, the
        level of step-size control, and the FMUs' outputs before that step.
        """
        last: Last | None = None
        if memory:
            numerator, denominator, level, *before = memory
            last = Last(
                Fraction(numerator, denominator), dict(zip(self._outputs, before, strict=True))
            )
            if self.doubled is not None:
                self.doubled.level = level
        last = self._over(k, last, values)
        level = self.doubled.level if self.doubled is not None else 0
        numbers = (last.values[j] for j in self._outputs)
        return last.span.numerator, last.span.denominator, level, *numbers

    def split(self, k: int, before: tuple[Any, ...], *values: Any) -> None:
        """Step the FMUs over tick k, landing on its events.

        `before` are the values of `extrapolated` signals one tick ago.
        """
        last = Last(_END, dict(zip(self.extrapolated, before, strict=True))) if before else None
        self._over(k, last, values)

    @property
    def counted(self) -> int | None:
        """How many steps the FMUs have made, where that is not the number of ticks."""
        return self.fmus.steps if self.is_always else None

    def release(self) -> None:
        """Free the FMU states that were kept for repeating steps."""
        self.fmus.release()
        if self.doubled is not None:
            self.doubled.release()

    def _over(self, k: int, last: Last | None, values: tuple[Any, ...]) -> Last:
        n = len(self.plan.signals)
        y = list(values[:n])
        tick = Tick(self.plan, k, dict(zip(self.plan.network.between, values[n:], strict=True)))
        for a, b in pairwise([_START, *tick.jumps(), _END]):
            if a:
                y = tick.at(a, y)
            after = self.stepper.over(tick, a, b, y, last)
            if self.doubled is not None and self.doubled.last is not None:
                last = self.doubled.last
            elif b - a > _LEAST:
                last = Last(b - a, {j: y[j] for j in self._outputs})
            y = after
        assert last is not None
        return last
