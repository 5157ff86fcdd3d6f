"""A gain."""

from dataclasses import dataclass, field
from typing import Any

from ..block import Block, Ports, require_finite


@dataclass(frozen=True, slots=True)
class Gain(Block):
    """y = k · u.

    Without units k is a plain number and y has the unit of u. With both `input_unit` and `unit`
    k has a unit itself: Gain(3.6, input_unit="m/s", unit="km/h").
    """

    k: float
    input_unit: str | None = field(default=None, kw_only=True)
    unit: str | None = field(default=None, kw_only=True)
    inputs: Ports = field(init=False, repr=False, compare=False)
    outputs: Ports = field(init=False, repr=False, compare=False)

    continuous = True

    def __post_init__(self) -> None:
        require_finite(self, "k")
        object.__setattr__(self, "inputs", {"u": self.input_unit})
        object.__setattr__(self, "outputs", {"y": self.unit})

    def step(self, x: Any, u: Any) -> tuple[Any, Any]:
        """Return (k · u, no state)."""
        return self.k * u, x
