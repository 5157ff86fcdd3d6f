"""Common to all changes: when they act, and how a wrong one is refused."""

import math
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from ...base.errors import ParameterError
from ..clock import Clock, rational

if TYPE_CHECKING:
    from ..diagram import Diagram

Seconds = float | Fraction


@dataclass(frozen=True, kw_only=True, slots=True)
class Change:
    """Something that happens at a time; it acts from the first tick with t ≥ `at` (s)."""

    at: Seconds

    kind: ClassVar[str]  # its name in a TOML file

    def __post_init__(self) -> None:
        self._require_time("at")

    def check(self, diagram: "Diagram") -> None:
        """Raise DiagramError or ParameterError if the diagram cannot be changed in this way."""
        raise NotImplementedError

    def refuse(self, what: str) -> NoReturn:
        """Raise ParameterError for a mistake in the change itself."""
        raise ParameterError(f"{type(self).__name__}: {what}")

    def _require_time(self, name: str) -> None:
        value = getattr(self, name)
        good = isinstance(value, int | float | Fraction) and not isinstance(value, bool)
        if not (good and math.isfinite(value)):
            self.refuse(f"{name} must be a time in s, not {value!r}")

    def _require_number(self, name: str) -> None:
        value = getattr(self, name)
        if not (isinstance(value, int | float) and math.isfinite(value)):
            self.refuse(f"{name} must be a finite number, not {value!r}")

    def _require_spelling(self, name: str, form: str) -> None:
        value = getattr(self, name)
        if not (isinstance(value, str) and all(value.partition("."))):
            self.refuse(f"{name} must be spelled {form}, not {value!r}")


@dataclass(frozen=True, slots=True)
class Fault(Change):
    """A change of what one port carries, until the first tick with t ≥ `until` (s; None: for good).

    At an output every reader and the record see it, at an input only that block does.
    """

    port: str
    until: Seconds | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        Change.__post_init__(self)
        self._require_spelling("port", "block.port")
        if self.until is not None:
            self._require_time("until")
            if rational(self.until) <= rational(self.at):
                self.refuse(
                    f"until = {float(self.until):g} s must lie after at = {float(self.at):g} s"
                )

    def check(self, diagram: "Diagram") -> None:
        """Raise DiagramError for a port that is not there, ParameterError for a wrong value."""
        from .check import check_fault

        check_fault(diagram, self)

    def captures(self) -> int | None:
        """Return the tick, counted from the first active one, whose value `act` needs, or None."""
        return None

    def act(self, u: Any, t: float, held: float) -> Any:
        """Return what the port carries at time t (s) instead of u, while the fault is active."""
        raise NotImplementedError


def first_tick(clock: Clock, time: Seconds) -> int:
    """Return the first tick of a run with t ≥ time (s), by exact fractions."""
    return max(0, -((clock.start - rational(time)) // clock.step))
