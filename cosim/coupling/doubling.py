"""Step-size control by step doubling: a step of h against two of h/2, from a saved state."""

from dataclasses import dataclass, field
from typing import Any

from ...base.errors import ConvergenceError, DiagramError, listing, suggest
from ..algorithms import StepDoubling
from .stepping import Fmus, Stepper
from .within import Last, Place, Signals, Tick

_MARGIN = 0.8  # how far below the tolerance the doubled step is expected to lie


@dataclass
class Doubled:
    """Divides a stretch into steps of 2^-level of it, each as long as the tolerance allows."""

    fmus: Fmus
    algorithm: StepDoubling
    inner: Stepper
    level: int = 0
    last: Last | None = None  # at the end of the latest step
    _saved: dict[int, Any] = field(default_factory=dict)
    _worst: int | None = None  # the signal with the largest error in the latest try

    def __post_init__(self) -> None:
        plan = self.fmus.plan
        outputs = [plan.signals[j] for i in plan.network.fmus for j in plan.nodes[i].outputs]
        for name in self.algorithm.scale:
            if name not in outputs:
                raise DiagramError(
                    f"StepDoubling scale: '{name}' is no output of an FMU that steps at every "
                    f"base step; those are: {listing(outputs)}{suggest(name, outputs)}"
                )
        scale, tolerance = self.algorithm.scale, self.algorithm.tolerance
        self._allowed = {
            j: tolerance * scale.get(plan.signals[j], 1.0)
            for i in plan.network.fmus
            for j in plan.nodes[i].outputs
            if plan.signals[j] not in plan.types
        }

    def release(self) -> None:
        """Free the states that were saved."""
        self.fmus.free(self._saved)

    def over(self, tick: Tick, a: Place, b: Place, y: Signals, last: Last | None) -> Signals:
        """Step the FMUs from a to b."""
        depth = self.algorithm.depth
        whole, place = 1 << depth, 0
        while place < whole:
            while place % (whole >> self.level):
                self.level += 1
            size = whole >> self.level
            p, r = (a + (b - a) * n / whole for n in (place, place + size))
            if tick.time((p + r) / 2) in (tick.time(p), tick.time(r)):
                # An event a rounding error away from a tick: there is nothing to divide.
                y, place = self.inner.over(tick, p, r, y, last), place + size
                continue
            error, after, middle = self._try(tick, p, r, y, last)
            if not error <= 1.0:
                self._undo(tick, p, depth, error)
                continue
            last = Last((r - p) / 2, self._values(middle))
            y = tick.at(r, after) if r < b else after
            place += size
            if self.level and error < _MARGIN * 0.5 ** (self.algorithm.extrapolation + 2):
                self.level -= 1
        self.last = last
        return y

    def _try(
        self, tick: Tick, p: Place, r: Place, y: Signals, last: Last | None
    ) -> tuple[float, Signals, Signals]:
        """Return the error in units of what is allowed, the signals at r, and those half-way."""
        fmus, places = self.fmus, self.fmus.plan.network.fmus
        fmus.save(places, self._saved, tick.time(p))
        coarse = self.inner.over(tick, p, r, y, last)
        fmus.restore(places, self._saved)
        half = (p + r) / 2
        middle = tick.at(half, self.inner.over(tick, p, half, y, last))
        then = Last(half - p, self._values(y))
        fine = self.inner.over(tick, half, r, middle, then)
        errors = {j: abs(coarse[j] - fine[j]) / size for j, size in self._allowed.items()}
        self._worst = max(errors, key=errors.__getitem__, default=None)
        return max(errors.values(), default=0.0), fine, middle

    def _values(self, y: Signals) -> dict[int, float]:
        return {j: y[j] for j in self._allowed}

    def _undo(self, tick: Tick, p: Place, depth: int, error: float) -> None:
        self.fmus.restore(self.fmus.plan.network.fmus, self._saved)
        if self.level == depth:
            signal = "" if self._worst is None else tick.plan.signals[self._worst]
            raise ConvergenceError(
                f"step-size control at t = {tick.time(p):.9g} s: with the smallest step, "
                f"{self.algorithm.smallest:g} of {float(tick.plan.clock.step):g} s, the error of "
                f"{signal} is still {error:.3g} times what is allowed; allow a larger tolerance "
                "or scale, or a smaller step by `smallest`"
            )
        self.level += 1
