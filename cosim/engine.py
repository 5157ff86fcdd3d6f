"""The engines that carry out a schedule, and which of them a run gets."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from .generate import Program
from .operations import Call, Record
from .places import Place
from .schedule import Schedule


class Engine(Protocol):
    """What carries out the ticks of a schedule. All give the same bits."""

    name: str
    reason: str

    def advance(self, k: int, end: int, values: Sequence[Any], rows: np.ndarray) -> list[Any]:
        """Run ticks k … end − 1, write their rows, and return the registers then."""
        ...

    def where(self, error: BaseException) -> Place | None:
        """Return where an error came from."""
        ...


def choose_engine(
    wanted: str,
    schedule: Schedule,
    program: Program,
    record: Record,
    before: Sequence[Call],
    after: Sequence[Call],
) -> Engine:
    """Return the engine that is wanted ("auto", "python", "compiled")."""
    return program
