"""A delay that changes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .change import Change, Seconds

if TYPE_CHECKING:
    from ..diagram import Diagram


@dataclass(frozen=True, slots=True)
class SetDelay(Change):
    """A Delay block is `time` (s) long from `at` (s) on: y(t) = u(t − time).

    So samples are passed over when it becomes shorter, and shown again when it becomes longer.
    """

    block: str
    time: Seconds

    kind = "set_delay"

    def __post_init__(self) -> None:
        Change.__post_init__(self)
        if not isinstance(self.block, str):
            self.refuse(f"block must be a block's name, not {self.block!r}")
        self._require_time("time")
        if self.time < 0:
            self.refuse(f"time must be a number of seconds from 0, not {self.time!r}")

    def check(self, diagram: "Diagram") -> None:
        """Raise DiagramError unless the block is a Delay."""
        from .check import check_delay

        check_delay(diagram, self.block)
