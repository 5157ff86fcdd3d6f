"""A schedule's operations as lines of Python.

Registers are local variables, so that a step costs no look-up; an FMU's inputs and outputs are
slots of its arrays. Values that may be others for the same text stand in it by name.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import singledispatchmethod
from typing import Any

from ..schedule.forms import apart
from ..schedule.operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Divide,
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
    Within,
)
from ..schedule.schedule import Schedule


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
            case Divide():
                inside = (o for stop in operation.stops for o in stop.signals)
                found |= {"t", *used_times((*inside, *operation.otherwise))}
            case Past() if callable(operation.initial):
                found.add("t1" if operation.ahead else "t")
            case _:
                pass
    return found


@dataclass
class Text:
    """The lines of a program under way, and what they know by name."""

    schedule: Schedule
    lines: list[str] = field(default_factory=list)
    names: dict[str, Any] = field(default_factory=dict)
    node_of_line: dict[int, str] = field(default_factory=dict)
    node: str | None = None
    arrays: dict[int, str] = field(default_factory=dict)
    bound: dict[int, tuple[str, ...]] = field(default_factory=dict)  # by a piece's id()

    def bind(self, found: Sequence[Any]) -> tuple[tuple[str, ...], ...]:
        """Give the values of all pieces their names, and return these."""
        slots = []
        for piece in found:
            stem = type(piece).__name__.lower()
            names = tuple(self.name(stem, value) for value in apart(piece)[1])
            self.bound[id(piece)] = names
            slots.append(names)
        return tuple(slots)

    def add(self, depth: int, text: str) -> None:
        """Add a line, which belongs to the node that is being written."""
        self.lines.append("    " * depth + text)
        if self.node is not None:
            self.node_of_line[len(self.lines)] = self.node

    def name(self, stem: str, value: Any) -> str:
        """Return a name by which the generated code knows a value."""
        name = f"{stem}{len(self.names)}"
        self.names[name] = value
        return name

    def times(self, depth: int, operations: Sequence[Operation]) -> None:
        """Add the times that the operations need."""
        used = used_times(operations)
        a, b, q = self.schedule.plan.clock.integers
        if used & {"t", "tm"}:
            self.add(depth, f"t = {_ticks(a, b, 'k')} / {q}")
        if used & {"t1", "tm"}:
            self.add(depth, f"t1 = {_ticks(a, b, '(k + 1)')} / {q}")
        if "tm" in used:
            self.add(depth, "tm = 0.5 * (t + t1)")

    def block(self, depth: int, operations: Sequence[Operation]) -> None:
        """Add the lines of operations."""
        for operation in operations:
            self.node = getattr(operation, "node", None)
            every = getattr(operation, "every", 1)
            if every > 1:
                self.add(depth, f"if k % {every} == 0:")
            self.write(operation, depth + (every > 1))
        self.node = None

    @singledispatchmethod
    def write(self, operation: Any, depth: int) -> None:
        """Add the lines of one operation."""
        raise TypeError(f"no text for {operation!r}")

    @write.register
    def _(self, operation: Call, depth: int) -> None:
        (function,) = self.bound[id(operation)]
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

    def tests(self, tests: Sequence[Due | Edge]) -> str:
        """Return the expression for whether one of the tests holds."""
        return " or ".join(map(self.test, tests))

    def test(self, test: Due | Edge) -> str:
        """Return the expression for whether a test holds."""
        if isinstance(test, Due):
            return f"{test.event} < t1"
        first, back, nearer, length = self.bound[id(test)]
        if not test.always:
            return f"k == {first}"
        old = f"{test.ring}[(k - {back}) % {length}]"
        new = f"{test.ring}[(k - {nearer}) % {length}]"
        return f"k == {first} or (k > {first} and {old} != {new})"

    def array(self, array: Any) -> str:
        """Return the name of an FMU's array."""
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
            over = "tp, h" if operation.divided else f"t, {operation.span!r}"
            self.add(depth, f"{self.name('advance', method)}({over})")

    def _calls(self, operation: Advance, depth: int, sloped: bool) -> None:
        """Write the FMI calls of a step one by one: the fastest that Python has."""
        instance = operation.instance
        fail = self.name("fail", instance.fail)
        clock, span, time = self.name("clock", instance.clock), repr(operation.span), "t"
        instance.span.value = operation.span
        slopes = instance.slope_puts if sloped else []
        if operation.divided:
            span, time = "h", "tp"
            self.add(depth, f"{self.name('span', instance.span)}.value = h")
        self.add(depth, f"{clock}.value = {time}")
        places = operation.outputs
        gets = instance.gets if places is None else instance.gets_of(places)
        for function, arguments, name in (*instance.puts, *slopes, instance.step, *gets):
            call = f"{self.name(name, function)}(*{self.name('arguments', arguments)})"
            then = f"{time} + {span}" if name.startswith("fmi2Get") else time
            self.add(depth, f"if (s := {call}) > 1:")
            self.add(depth + 1, f'{fail}("{name}", s, {then})')

    @write.register
    def _(self, operation: Past, depth: int) -> None:
        o = operation
        length, back, further, part, first, initial, time = self.bound[id(o)]
        new = o.newest if o.whole == 0 and not o.ahead else f"{o.ring}[(k - {back}) % {length}]"
        formula = new
        if o.part:
            formula = f"{new} + {part} * ({o.ring}[(k - {further}) % {length}] - {new})"
        if o.first > o.ahead:
            history = initial
            if callable(o.initial):
                history = f"{initial}({'t1' if o.ahead else 't'} - {time})"
            formula = f"{formula} if k >= {first} else {history}"
        self.add(depth, f"{o.result} = {formula}")

    @write.register
    def _(self, operation: Within, depth: int) -> None:
        o = operation
        length, shift, further, part, initial = self.bound[id(o)]
        new = f"{o.ring}[(k + {shift}) % {length}]"
        formula = new
        if o.part and o.shift < 0:
            formula = f"{new} + {part} * ({o.ring}[(k + {further}) % {length}] - {new})"
        history = f"{initial}(k)" if callable(o.initial) else initial
        self.add(depth, f"{o.result} = {formula} if k + {shift} >= 0 else {history}")

    @write.register
    def _(self, operation: Divide, depth: int) -> None:
        stops = operation.stops
        flags = [f"d{n}" for n in range(len(stops))]
        for flag, stop in zip(flags, stops, strict=True):
            self.add(depth, f"{flag} = {self.tests(stop.tests)}")
        self.add(depth, f"if {' or '.join(flags)}:")
        self.add(depth + 1, "tp = t")
        self.add(depth + 1, f"h = {_chosen(flags, self.bound[id(operation)])}")
        self.block(depth + 1, operation.steps)
        for n, (flag, stop) in enumerate(zip(flags, stops, strict=True)):
            a, b, q, *spans = self.bound[id(stop)]
            self.add(depth + 1, f"if {flag}:")
            self.add(depth + 2, f"tp = ({a} + k * {b}) / {q}")
            self.block(depth + 2, stop.signals)
            self.add(depth + 2, f"h = {_chosen(flags[n + 1 :], spans)}")
            self.block(depth + 2, stop.steps)
        for step in operation.steps:
            if step.instance.steps_inline:
                span = self.name("span", step.instance.span)
                self.add(depth + 1, f"{span}.value = {step.span!r}")
        self.add(depth, "else:")
        self.block(depth + 1, operation.otherwise)

    @write.register
    def _(self, operation: Keep, depth: int) -> None:
        (length,) = self.bound[id(operation)]
        self.add(depth, f"{operation.ring}[k % {length}] = {operation.source}")

    @write.register
    def _(self, operation: Move, depth: int) -> None:
        self.add(depth, f"{operation.result} = {operation.source}")

    @write.register
    def _(self, operation: Line, depth: int) -> None:
        o = operation
        self.add(depth, f"{o.result} = {o.start} + 2.0 * ({o.end} - {o.start})")

    @write.register
    def _(self, operation: Announce, depth: int) -> None:
        (function,) = self.bound[id(operation)]
        self.add(depth, f"if {operation.event} <= t:")
        self.add(depth + 1, f"{operation.event} = {function}({operation.state}, t)")

    @write.register
    def _(self, operation: Branch, depth: int) -> None:
        self.add(depth, f"if {self.tests(operation.tests)}:")
        self.block(depth + 1, [operation.call])
        self.add(depth, "else:")
        self.block(depth + 1, operation.otherwise)

    @write.register
    def _(self, operation: Record, depth: int) -> None:
        kept = "".join(f", {register}" for register in operation.registers)
        self.add(depth, f"pack(buffer, row{kept})")
        self.add(depth, "row += size")


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


def _chosen(flags: Sequence[str], spans: Sequence[str]) -> str:
    """Return the expression for the span to the first stop whose flag is set, or to the end."""
    chosen = (f"{span} if {flag} else " for flag, span in zip(flags, spans, strict=False))
    return "".join(chosen) + spans[-1]


def _joined(registers: Registers) -> str:
    return ", ".join(_tuple(r) if isinstance(r, tuple) else r for r in registers)


def _tuple(registers: Registers) -> str:
    return f"({_joined(registers)},)" if registers else "()"
