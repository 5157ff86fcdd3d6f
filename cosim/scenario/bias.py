"""A port that is off by a number."""

from dataclasses import dataclass
from typing import Any

from .change import Fault


@dataclass(frozen=True, slots=True)
class Bias(Fault):
    """A port carries u + offset instead of u."""

    offset: float

    kind = "bias"

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        self._require_number("offset")

    def act(self, u: Any, t: float, held: float) -> Any:
        """Return u + offset."""
        return u + self.offset
