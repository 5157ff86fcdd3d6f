"""A port that does not change any more."""

from dataclasses import dataclass
from typing import Any

from .change import Fault


@dataclass(frozen=True, slots=True)
class Freeze(Fault):
    """A port keeps the value that it has at the first tick with t ≥ `at` (s)."""

    kind = "freeze"

    def captures(self) -> int:
        """Return 0: the first active tick."""
        return 0

    def act(self, u: Any, t: float, held: float) -> float:
        """Return the value of the first active tick."""
        return held
