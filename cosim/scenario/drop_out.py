"""A port that carries nothing."""

from dataclasses import dataclass
from typing import Any, Literal

from .change import Fault


@dataclass(frozen=True, slots=True)
class DropOut(Fault):
    """A signal is lost: its readers see `value`, or with "last" what came in the tick before."""

    value: float | Literal["last"] = 0.0

    kind = "drop_out"

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        if isinstance(self.value, str):
            if self.value != "last":
                self.refuse(f"value must be a number or 'last', not {self.value!r}")
        else:
            self._require_number("value")

    def captures(self) -> int | None:
        """Return −1 with "last": the tick before the first active one."""
        return -1 if self.value == "last" else None

    def act(self, u: Any, t: float, held: float) -> float:
        """Return the value, or the last that came."""
        return held if isinstance(self.value, str) else float(self.value)
