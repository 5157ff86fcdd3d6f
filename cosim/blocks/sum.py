"""A sum with signs."""

from dataclasses import dataclass, field
from typing import Any

from ..block import Block, Ports, require


@dataclass(frozen=True, slots=True)
class Sum(Block):
    """y = ± u1 ± u2 …: one input for each sign of `signs`, such as "+-". All share one unit."""

    signs: str = "++"
    inputs: Ports = field(init=False, repr=False, compare=False)

    outputs = {"y": None}
    continuous = True

    def __post_init__(self) -> None:
        good = isinstance(self.signs, str) and self.signs and set(self.signs) <= {"+", "-"}
        require(self, good, f"signs must be + and - such as '+-', not {self.signs!r}")
        names = [f"u{i + 1}" for i in range(len(self.signs))]
        object.__setattr__(self, "inputs", dict.fromkeys(names))

    def step(self, x: Any, *u: Any) -> tuple[Any, Any]:
        """Return (the signed sum, no state)."""
        total: Any = 0.0
        for sign, value in zip(self.signs, u, strict=True):
            total = total + value if sign == "+" else total - value
        return total, x
