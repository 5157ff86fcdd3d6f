"""A source that never changes."""

from dataclasses import dataclass
from typing import Any

from ..block import require_finite
from .source import Source


@dataclass(frozen=True, slots=True)
class Constant(Source):
    """y(t) = value."""

    value: float

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "value")

    def output(self, x: Any, *time: Any) -> float:
        """Return the value."""
        return self.value
