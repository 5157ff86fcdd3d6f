"""The compiled engine: the stepper with the table of one schedule."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..engine.generate import Program
from ..engine.places import Place
from ..schedule.forms import Values
from . import structures as s
from .library import Library
from .table import Table


@dataclass
class CompiledEngine:
    """Carries out ticks as `program` does, with the same results and the same errors.

    All that changes during a call belongs to that call, but for where the latest one failed.
    """

    library: Library
    table: Table
    program: Program
    _place: Place | None = field(default=None, init=False)
    _is_programs: bool = field(default=False, init=False)

    name = "compiled"
    reason = ""

    def bind(self, values: Sequence[Values]) -> None:
        """Take other values: those of the pieces of a schedule of the same form."""
        self.program.bind(values)
        self.table.bind(values)

    def advance(self, k: int, end: int, values: Sequence[Any], rows: np.ndarray) -> list[Any]:
        """Run ticks k … end − 1, write their rows, and return the registers then."""
        table = self.table
        self._is_programs = not table.reaches(end)
        if self._is_programs:
            return self.program.advance(k, end, values, rows)
        self._place = None
        values = list(values)
        _require(table, k, end, values, rows)
        registers = (s.Register * table.registers)()
        stack = (ctypes.c_void_p * table.stack)()
        state = s.State(
            table.address,
            ctypes.addressof(registers),
            ctypes.addressof(stack),
            rows.ctypes.data,
            k,
            end,
        )
        address = ctypes.addressof(state)
        try:
            return self.library.run(address, values)
        except BaseException:
            self._place = self._where(state, registers)
            raise
        finally:
            self.library.release(address)

    def _where(self, state: Any, registers: Any) -> Place:
        values = self.library.values(ctypes.addressof(state))
        node = self.table.nodes[state.operation] if state.operation >= 0 else None
        recorded = state.operation > self.table.record
        named = dict(zip(self.table.living, values, strict=True))
        named |= {name: s.value_of(registers[i]) for name, i in self.table.ahead.items()}
        return Place(node, state.k, recorded, {**named, "k": state.k})

    def where(self, error: BaseException) -> Place | None:
        """Return the place where the latest call failed."""
        return self.program.where(error) if self._is_programs else self._place


def _require(table: Table, k: int, end: int, values: list[Any], rows: np.ndarray) -> None:
    """Raise ValueError for what the stepper could not write to or read from."""
    if len(values) != len(table.living):
        raise ValueError(f"{len(values)} values for {len(table.living)} registers")
    count = max(0, -(-end // table.every) - -(-k // table.every))
    good = rows.dtype == np.float64 and rows.flags.c_contiguous and rows.flags.writeable
    if not good or rows.size < count * table.width:
        raise ValueError(f"{rows.shape} is no place for {count} rows of {table.width} floats")
