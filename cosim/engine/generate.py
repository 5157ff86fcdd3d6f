"""A schedule as straight-line Python: the engine that runs everywhere."""

import hashlib
import linecache
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType
from typing import Any

import numpy as np

from ..schedule.forms import Values, pieces
from ..schedule.operations import Call, Record
from ..schedule.schedule import Schedule
from .places import Place
from .text import Text


@dataclass(frozen=True)
class Program:
    """The generated functions, with what is needed to explain a failure inside them.

    ticks(k, end, values, pack, buffer, row, size) runs ticks k … end − 1, packs their rows from
    offset `row` of the buffer and returns the registers then. observe(k, values) and
    initial(k, values) return the registers after the outputs of tick k.

    What the functions know by `names` may be other values of the same form: see `bind`. `slots` has
    the names of each piece's values.
    """

    source: str
    filename: str
    names: dict[str, Any]
    slots: tuple[tuple[str, ...], ...]
    node_of_line: dict[int, str]
    record_line: int
    width: int
    reason: str = ""  # why it is not the compiled engine, where that would have been taken

    name = "python"

    def advance(self, k: int, end: int, values: Sequence[Any], rows: np.ndarray) -> list[Any]:
        """Run ticks k … end − 1, write their rows, and return the registers then."""
        buffer = memoryview(rows.data).cast("B") if rows.size else bytearray()
        pack = struct.Struct(f"{self.width}d")
        return self.names["ticks"](k, end, values, pack.pack_into, buffer, 0, pack.size)

    def observe(self, k: int, values: Sequence[Any]) -> list[Any]:
        """Return the registers after the outputs of tick k."""
        return self.names["observe"](k, values)

    def initial(self, k: int, values: Sequence[Any]) -> list[Any]:
        """Return the registers after the outputs at the start."""
        return self.names["initial"](k, values)

    def bind(self, values: Sequence[Values]) -> None:
        """Take other values: those of the pieces of a schedule of the same form."""
        for names, ours in zip(self.slots, values, strict=True):
            self.names.update(zip(names, ours, strict=True))

    def where(self, error: BaseException) -> Place | None:
        """Return the place in the generated code that an error came through."""
        trace = error.__traceback__
        while trace is not None:
            frame, line = trace.tb_frame, trace.tb_lineno
            if frame.f_code.co_filename == self.filename:
                values = dict(frame.f_locals)
                recorded = frame.f_code.co_name == "ticks" and line > self.record_line
                return Place(self.node_of_line.get(line), values["k"], recorded, values)
            trace = trace.tb_next
        return None


def all_pieces(
    schedule: Schedule, record: Record, before: Sequence[Call], after: Sequence[Call]
) -> list[Any]:
    """Return the pieces of everything that a program carries out, in their order."""
    tick = (*before, *schedule.outputs, record, *after, *schedule.updates)
    return list(pieces((*tick, *schedule.observed, *schedule.initial)))


def generate(
    schedule: Schedule, record: Record, *, before: Sequence[Call] = (), after: Sequence[Call] = ()
) -> Program:
    """Write, compile and return the program.

    Calls `before` are made when a tick begins, calls `after` when its row has been recorded.
    """
    text = Text(schedule)
    slots = text.bind(all_pieces(schedule, record, before, after))
    everything = ", ".join(schedule.registers)
    text.add(0, "def ticks(k, end, values, pack, buffer, row, size):")
    text.add(1, f"[{everything}] = values")
    text.add(1, "while k < end:")
    text.times(2, (*before, *schedule.outputs, *after, *schedule.updates))
    text.block(2, (*before, *schedule.outputs, record))
    record_line = len(text.lines)
    text.block(2, (*after, *schedule.updates))
    text.add(2, "k += 1")
    text.add(1, f"return [{everything}]")
    for name, operations in (("observe", schedule.observed), ("initial", schedule.initial)):
        text.add(0, "")
        text.add(0, f"def {name}(k, values):")
        text.add(1, f"[{everything}] = values")
        text.times(1, operations)
        text.block(1, operations)
        text.add(1, f"return [{everything}]")
    source = "\n".join(text.lines) + "\n"
    filename, code = _compiled(schedule.plan.name, source)
    _show(filename, source)
    exec(code, text.names)
    return Program(
        source,
        filename,
        text.names,
        slots,
        text.node_of_line,
        record_line,
        len(record.registers),
    )


@lru_cache(maxsize=64)
def _compiled(diagram: str, source: str) -> tuple[str, CodeType]:
    """Return a source's file name, of which there is none, and its code."""
    digest = hashlib.sha256(source.encode()).hexdigest()[:12]
    filename = f"<railcosim diagram '{diagram}' {digest}>"
    return filename, compile(source, filename, "exec")


_shown: dict[str, None] = {}
_SHOWN = 64  # sources; a campaign makes thousands


def _show(filename: str, source: str) -> None:
    """Put a source into linecache: a traceback through the generated code then shows its lines."""
    _shown.pop(filename, None)
    _shown[filename] = None
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    if len(_shown) > _SHOWN:
        oldest = next(iter(_shown))
        del _shown[oldest]
        linecache.cache.pop(oldest, None)
