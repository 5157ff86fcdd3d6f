"""A schedule as straight-line Python: the engine that runs everywhere.

Registers are local variables, so that a step costs no look-up; an FMU's inputs and outputs are
slots of its arrays.
"""

import hashlib
import linecache
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import singledispatchmethod
from typing import Any

import numpy as np

from ..schedule.operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Due,
    Edge,
    Keep,
    Line,
    Move,
    Operation,
    Past,
    Read,
    Record,
    Registers,
)
from ..schedule.schedule import Schedule
from .places import Place


@dataclass(frozen=True)
class Program:
    """The generated functions, with what is needed to explain a failure inside them.

    ticks(k, end, values, pack, buffer, row, size) runs ticks k … end − 1, packs their rows from
    offset `row` of the buffer and returns the registers then. observe(k, values) and
    initial(k, values) return the registers after the outputs of tick k.
    """

    source: str
    filename: str
    ticks: Callable[..., list[Any]]
    observe: Callable[[int, Sequence[Any]], list[Any]]
    initial: Callable[[int, Sequence[Any]], list[Any]]
    node_of_line: dict[int, str]
    record_line: int
    width: int
    reason: str = ""  # why it is not the compiled engine, where that would have been taken

    name = "python"

    def advance(self, k: int, end: int, values: Sequence[Any], rows: np.ndarray) -> list[Any]:
        """Run ticks k … end − 1, write their rows, and return the registers then."""
        buffer = memoryview(rows.data).cast("B") if rows.size else bytearray()
        pack = struct.Struct(f"{self.width}d")
        return self.ticks(k, end, values, pack.pack_into, buffer, 0, pack.size)

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


def generate(
    schedule: Schedule, record: Record, *, before: Sequence[Call] = (), after: Sequence[Call] = ()
) -> Program:
    """Write, compile and return the program.

    Calls `before` are made when a tick begins, calls `after` when its row has been recorded.
    """
    text = _Text(schedule)
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
    digest = hashlib.sha256(source.encode()).hexdigest()[:12]
    filename = f"<railcosim diagram '{schedule.plan.name}' {digest}>"
    _show(filename, source)
    exec(compile(source, filename, "exec"), text.names)
    return Program(
        source,
        filename,
        text.names["ticks"],
        text.names["observe"],
        text.names["initial"],
        text.node_of_line,
        record_line,
        len(record.registers),
    )


def used_times(operations: Sequence[Operation]) -> set[str]:
    """Return which of t, tm and t1 the operations need."""
    found: set[str] = set()
    for operation in operations:
        match operation:
            case Call():
                found |= {"t", "tm", "t1"} & set(operation.arguments)
            case Advance() | Announce():
                found.add("t")
            case Branch():
                found |= used_times((operation.call, *operation.otherwise))
                found |= {"t1"} if any(isinstance(test, Due) for test in operation.tests) else set()
            case Past() if callable(operation.initial):
                found.add("t1" if operation.ahead else "t")
            case _:
                pass
    return found


@dataclass
class _Text:
    schedule: Schedule
    lines: list[str] = field(default_factory=list)
    names: dict[str, Any] = field(default_factory=dict)
    node_of_line: dict[int, str] = field(default_factory=dict)
    node: str | None = None
    arrays: dict[int, str] = field(default_factory=dict)

    def add(self, depth: int, text: str) -> None:
        self.lines.append("    " * depth + text)
        if self.node is not None:
            self.node_of_line[len(self.lines)] = self.node

    def name(self, stem: str, value: Any) -> str:
        """Return a name by which the generated code knows a value."""
        name = f"{stem}{len(self.names)}"
        self.names[name] = value
        return name

    def times(self, depth: int, operations: Sequence[Operation]) -> None:
        used = used_times(operations)
        a, b, q = self.schedule.plan.clock.integers
        if used & {"t", "tm"}:
            self.add(depth, f"t = {_ticks(a, b, 'k')} / {q}")
        if used & {"t1", "tm"}:
            self.add(depth, f"t1 = {_ticks(a, b, '(k + 1)')} / {q}")
        if "tm" in used:
            self.add(depth, "tm = 0.5 * (t + t1)")

    def block(self, depth: int, operations: Sequence[Operation]) -> None:
        for operation in operations:
            self.node = getattr(operation, "node", None)
            every = getattr(operation, "every", 1)
            if every > 1:
                self.add(depth, f"if k % {every} == 0:")
            self.write(operation, depth + (every > 1))
        self.node = None

    @singledispatchmethod
    def write(self, operation: Any, depth: int) -> None:
        raise TypeError(f"no text for {operation!r}")

    @write.register
    def _(self, operation: Call, depth: int) -> None:
        function = self.name("call", operation.function)
        call = f"{function}({_joined(operation.arguments)})"
        if operation.results is None:
            self.add(depth, call)
        elif isinstance(operation.results, str):
            self.add(depth, f"{operation.results} = {call}")
        else:
            self.add(depth, f"({_joined(operation.results)},) = {call}")

    @write.register
    def _(self, operation: Read, depth: int) -> None:
        for registers, array, slot in _runs(operation.values):
            if len(registers) == 1:
                self.add(depth, f"{registers[0]} = {self.array(array)}[{slot}]")
            else:  # a slice is faster than many looks
                targets = ", ".join(registers)
                end = slot + len(registers)
                self.add(depth, f"{targets} = {self.array(array)}[{slot}:{end}]")

    def array(self, array: Any) -> str:
        name = self.arrays.setdefault(id(array), f"array{len(self.arrays)}")
        self.names[name] = array
        return name

    @write.register
    def _(self, operation: Advance, depth: int) -> None:
        instance = operation.instance
        sloped = instance.takes_slopes and any(u.ahead for u in operation.inputs)
        for n, (u, (array, slot, convert)) in enumerate(
            zip(operation.inputs, instance.input_slots, strict=True)
        ):
            value = u.value
            if u.ahead and not sloped:
                value = f"{u.value} + 0.5 * ({u.ahead} - {u.value})"
            if convert:
                value = f"{self.name(convert.__name__, convert)}({value})"
            self.add(depth, f"{self.array(array)}[{slot}] = {value}")
            place = instance.slope_slots[n]
            if sloped and place is not None:
                slope = f"({u.ahead} - {u.value}) / {operation.span!r}" if u.ahead else "0.0"
                self.add(depth, f"{self.array(instance.slope_values)}[{place}] = {slope}")
        if instance.steps_inline:
            self._calls(operation, depth, sloped)
        else:
            method = instance.advance_sloped if sloped else instance.advance
            self.add(depth, f"{self.name('advance', method)}(t, {operation.span!r})")

    def _calls(self, operation: Advance, depth: int, sloped: bool) -> None:
        """Write the FMI calls of a step one by one: the fastest that Python has."""
        instance = operation.instance
        fail = self.name("fail", instance.fail)
        clock, span = self.name("clock", instance.clock), operation.span
        instance.span.value = span
        slopes = instance.slope_puts if sloped else []
        self.add(depth, f"{clock}.value = t")
        for function, arguments, name in (*instance.puts, *slopes, instance.step, *instance.gets):
            call = f"{self.name(name, function)}(*{self.name('arguments', arguments)})"
            then = f"t + {span!r}" if name.startswith("fmi2Get") else "t"
            self.add(depth, f"if (s := {call}) > 1:")
            self.add(depth + 1, f'{fail}("{name}", s, {then})')

    @write.register
    def _(self, operation: Past, depth: int) -> None:
        o = operation

        def sample(back: int) -> str:
            if back == 0 and not o.ahead:
                return o.newest
            if back == o.ahead:
                return f"{o.ring}[k % {o.length}]"
            return f"{o.ring}[(k - {back - o.ahead}) % {o.length}]"

        new, formula = sample(o.whole), sample(o.whole)
        if o.part:
            formula = f"{new} + {o.part!r} * ({sample(o.whole + 1)} - {new})"
        first = o.first - o.ahead
        if first > 0:
            history = repr(o.initial)
            if callable(o.initial):
                time = "t1" if o.ahead else "t"
                history = f"{self.name('history', o.initial)}({time} - {o.time!r})"
            formula = f"{formula} if k >= {first} else {history}"
        self.add(depth, f"{o.result} = {formula}")

    @write.register
    def _(self, operation: Keep, depth: int) -> None:
        self.add(depth, f"{operation.ring}[k % {operation.length}] = {operation.source}")

    @write.register
    def _(self, operation: Move, depth: int) -> None:
        self.add(depth, f"{operation.result} = {operation.source}")

    @write.register
    def _(self, operation: Line, depth: int) -> None:
        o = operation
        self.add(depth, f"{o.result} = {o.start} + 2.0 * ({o.end} - {o.start})")

    @write.register
    def _(self, operation: Announce, depth: int) -> None:
        function = self.name("next_event", operation.function)
        self.add(depth, f"if {operation.event} <= t:")
        self.add(depth + 1, f"{operation.event} = {function}({operation.state}, t)")

    @write.register
    def _(self, operation: Branch, depth: int) -> None:
        tests = " or ".join(_test(test) for test in operation.tests)
        self.add(depth, f"if {tests}:")
        self.block(depth + 1, [operation.call])
        self.add(depth, "else:")
        self.block(depth + 1, operation.otherwise)

    @write.register
    def _(self, operation: Record, depth: int) -> None:
        kept = "".join(f", {register}" for register in operation.registers)
        self.add(depth, f"pack(buffer, row{kept})")
        self.add(depth, "row += size")


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


def _runs(values: Sequence[tuple[str, Any, int]]) -> list[tuple[list[str], Any, int]]:
    """Return (registers, array, first index) of neighbours in one array."""
    runs: list[tuple[list[str], Any, int]] = []
    for register, array, slot in values:
        if runs and runs[-1][1] is array and runs[-1][2] + len(runs[-1][0]) == slot:
            runs[-1][0].append(register)
        else:
            runs.append(([register], array, slot))
    return runs


def _ticks(a: int, b: int, k: str) -> str:
    text = k if b == 1 else f"{k} * {b}"
    return f"({a} + {text})" if a else text


def _test(test: Due | Edge) -> str:
    if isinstance(test, Due):
        return f"{test.event} < t1"
    at_first = f"k == {test.first}"
    if not test.always:
        return at_first
    old = f"{test.ring}[(k - {test.whole}) % {test.length}]"
    new = f"{test.ring}[(k - {test.whole - 1}) % {test.length}]"
    return f"{at_first} or (k > {test.first} and {old} != {new})"


def _joined(registers: Registers) -> str:
    return ", ".join(_tuple(r) if isinstance(r, tuple) else r for r in registers)


def _tuple(registers: Registers) -> str:
    return f"({_joined(registers)},)" if registers else "()"
