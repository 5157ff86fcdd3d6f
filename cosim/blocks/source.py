"""Common to the sources: no input, one output `y` with a unit, no direct feedthrough."""

from dataclasses import dataclass, field

from ..block import Block, Ports


@dataclass(frozen=True, kw_only=True, slots=True)
class Source(Block):
    """A block that only gives a signal; `unit` is the unit of its output `y`."""

    unit: str = "1"
    outputs: Ports = field(init=False, repr=False, compare=False)

    feedthrough = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", {"y": self.unit})
