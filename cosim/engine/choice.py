"""The engines that carry out a schedule, and which of them a run gets."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from ..schedule.forms import Values
from ..schedule.operations import Call, Record
from ..schedule.schedule import Schedule
from .generate import Program
from .places import Place


class Engine(Protocol):
    """What carries out the ticks of a schedule. All give the same bits.

    `reason` says why it is not the compiled one, where that was asked for or would do.
    """

    @property
    def name(self) -> str:
        """The engine's name: "python" or "compiled"."""
        ...

    @property
    def reason(self) -> str:
        """Why it is not the compiled one, where that would have been taken."""
        ...

    def bind(self, values: Sequence[Values]) -> None:
        """Take other values: those of the pieces of a schedule of the same form."""
        ...

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
    """Return the engine that is wanted: "python", "compiled", or "auto", compiled if it can be had.

    Raise EngineError where "compiled" cannot be had.
    """
    if wanted == "python":
        return program
    from ..compiled.engine import CompiledEngine
    from ..compiled.library import EngineError, load_library
    from ..compiled.table import Table

    try:
        library = load_library(again=wanted == "compiled")
        return CompiledEngine(library, Table(schedule, record, before, after), program)
    except EngineError as error:
        if wanted == "compiled":
            raise EngineError(f"engine='compiled': {error}; engine='python' does without") from None
        return replace(program, reason=str(error))
