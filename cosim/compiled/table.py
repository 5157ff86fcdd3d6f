"""A schedule as a table for the compiled stepper: what the generated Python says, in structures."""

import ctypes
import struct
from collections.abc import Callable, Sequence
from functools import partial
from math import gcd
from types import MethodType
from typing import Any

from ..engine.generate import all_pieces
from ..engine.text import used_times
from ..schedule.forms import Values, apart
from ..schedule.operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Divide,
    Due,
    Edge,
    Input,
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
from . import bind
from . import structures as s
from .bind import EXACT
from .library import EngineError
from .unpacking import unpacker

# As in stepper.c: kinds of operations, of an input's conversion and of an FMU's call.
(CALL, READ, ADVANCE, PAST, KEEP, MOVE, LINE, ANNOUNCE, BRANCH, JUMP, RECORD,
 WITHIN, DIVIDE, LAND) = range(14)  # fmt: skip
_CONVERSIONS = {None: 0, round: 1, bool: 2}
_DO_STEP, _TRANSFER, _TRANSFER_SLOPES = range(3)
_TIMES = {"t": 1, "tm": 2, "t1": 4}
_FIRST = ("k", "t", "tm", "t1", "tp")  # the first registers


class Table:
    """The table of one schedule. Calls `before` begin a tick, calls `after` follow its row.

    `nodes` has for each operation the block that it belongs to, and `record` is the place of that
    which records. Raise EngineError for a schedule that the stepper cannot carry out.
    """

    def __init__(
        self, schedule: Schedule, record: Record, before: Sequence[Call], after: Sequence[Call]
    ) -> None:
        self.living = schedule.registers
        self.nodes: list[str | None] = []
        self.width, self.every = len(record.registers), record.every
        self._a, self._b, self._q = _reduced(schedule.plan.clock.integers)
        self._registers = {name: i for i, name in enumerate((*_FIRST, *schedule.registers))}
        self._operations: list[Any] = []
        self._kept: list[Any] = []  # what the structures point to
        self._depth = 2  # of the arguments' stack
        # By a piece's id(): one that comes several times has as many structures.
        self._binds: dict[int, list[Callable[[Values], None]]] = {}
        self._add_all((*before, *schedule.outputs))
        self.record = len(self._operations)
        self._add_all((record, *after, *schedule.updates))
        found = all_pieces(schedule, record, before, after)
        self._bound = [self._binds.pop(id(piece), ()) for piece in found]
        self.bind([apart(piece)[1] for piece in found])
        used = used_times((*before, *schedule.outputs, *after, *schedule.updates))
        self.registers = len(self._registers)
        # What signals are at a step's end, of use after a failure.
        self.ahead = {name: i for name, i in self._registers.items() if name.startswith("a")}
        self.stack = self._depth + 1
        self.address = self._address(
            s.Table(
                self._a,
                self._b,
                self._q,
                sum(_TIMES[name] for name in used),
                len(self._operations),
                self._array(s.Operation, self._operations),
                self.registers,
                len(self.living),
                len(_FIRST),
                self._object(_pause),
            )
        )

    def reaches(self, end: int) -> bool:
        """Whether the times up to tick `end` come out exactly as Python divides them."""
        return abs(self._a) + (end + 1) * self._b <= EXACT

    # What the structures point to must stay where it is.

    def _address(self, one: Any) -> int:
        self._kept.append(one)
        return ctypes.addressof(one)

    def _array(self, kind: Any, values: Sequence[Any]) -> int | None:
        return self._address((kind * len(values))(*values)) if values else None

    def _object(self, one: Any) -> int:
        self._kept.append(one)
        return id(one)

    def _method(self, function: Any) -> tuple[int, int | None]:
        """Return a function and what it is bound to: calling that is faster than a method."""
        if type(function) is MethodType:
            return self._object(function.__func__), self._object(function.__self__)
        return self._object(function), None

    def _register(self, name: str) -> int:
        return self._registers.setdefault(name, len(self._registers))

    # Values: what may be other ones of the same form

    def _holds(self, piece: Any, take: Callable[[Values], None]) -> None:
        self._binds.setdefault(id(piece), []).append(take)

    def bind(self, values: Sequence[Values]) -> None:
        """Take the values of the pieces of a schedule of the same form."""
        self._values = values  # the structures point to them
        for takes, ours in zip(self._bound, values, strict=True):
            for take in takes:
                take(ours)

    # Operations

    def _add_all(self, operations: Sequence[Operation]) -> None:
        for operation in operations:
            self._add(operation)

    def _put(self, kind: int, operation: Any, what: Any) -> Any:
        """Add an operation and return it."""
        self.nodes.append(getattr(operation, "node", None))
        every = getattr(operation, "every", 1)
        address = None if what is None else self._address(what)
        self._operations.append(s.Operation(kind, 0, every, address))
        return self._operations[-1]

    def _add(self, operation: Any) -> None:
        for kind, add in _ADDERS.items():
            if isinstance(operation, kind):
                add(self, operation)
                return
        raise EngineError(f"the compiled stepper does not know {operation!r}")

    def _call(self, operation: Call) -> None:
        tuples: list[int] = []
        self._tuple(operation.arguments, tuples)
        self._depth = max(self._depth, len(operation.arguments) + 1)
        results = unpack = 0
        if operation.results is not None:
            results = self._entry(operation.results, tuples)
            if results < 0:
                unpack = self._object(unpacker(operation.results))
        what = s.Call(
            tuples=self._array(ctypes.c_int, tuples),
            results=results,
            has_results=operation.results is not None,
            unpack=unpack,
        )
        self._put(CALL, operation, what)
        self._holds(operation, partial(bind.function, what))

    def _entry(self, one: Any, tuples: list[int]) -> int:
        """Return a register's number, or −1 − where the entries of a tuple stand."""
        return self._register(one) if isinstance(one, str) else -1 - self._tuple(one, tuples)

    def _tuple(self, registers: Registers, tuples: list[int]) -> int:
        place = len(tuples)
        tuples += [len(registers), *[0] * len(registers)]
        for i, one in enumerate(registers):
            tuples[place + 1 + i] = self._entry(one, tuples)
        return place

    def _read(self, operation: Read) -> None:
        slots = [
            s.Slot(self._register(register), _is_whole(array), self._item(array, index))
            for register, array, index in operation.values
        ]
        self._put(READ, operation, s.Read(len(slots), self._array(s.Slot, slots)))

    def _item(self, array: Any, index: int) -> int:
        """Return the address of an array's item."""
        if not 0 <= index < len(array):
            raise EngineError(f"the compiled stepper finds no item {index} in {array!r}")
        self._kept.append(array)
        return ctypes.addressof(array) + index * ctypes.sizeof(array._type_)

    def _advance(self, operation: Advance) -> None:
        instance = operation.instance
        self._kept.append(instance)
        sloped = instance.takes_slopes and any(u.ahead for u in operation.inputs)
        slots = zip(operation.inputs, instance.input_slots, instance.slope_slots, strict=True)
        slopes = instance.slope_values if sloped else None
        inputs = [self._input(u, slot, slopes, place) for u, slot, place in slots]
        calls, method = [], (None, None)
        if instance.steps_inline:
            slope_puts = instance.slope_puts if sloped else []
            places = operation.outputs
            gets = instance.gets if places is None else instance.gets_of(places)
            prepared = (*instance.puts, *slope_puts, instance.step, *gets)
            calls = [self._fmu_call(*call) for call in prepared]
        else:
            method = self._method(instance.advance_sloped if sloped else instance.advance)
        what = s.Advance(
            len(inputs),
            len(calls),
            not instance.is_ours,
            operation.divided,
            self._array(s.Input, inputs),
            self._array(s.FmuCall, calls),
            operation.span,
            self._object(operation.span),
            self._object(0.5),
            self._object(instance.fail) if instance.steps_inline else None,
            *method,
        )
        self._put(ADVANCE, operation, what)

    def _input(self, u: Input, slot: Any, slopes: Any, place: int | None) -> Any:
        array, index, convert = slot
        if convert not in _CONVERSIONS or _is_whole(array) != (convert is not None):
            raise EngineError(f"the compiled stepper knows no inputs that go through {convert!r}")
        slope = (False, None, None, 0)
        if slopes is not None and place is not None:
            slope = (True, self._item(slopes, place), self._object(slopes), place)
        return s.Input(
            self._register(u.value),
            -1 if u.ahead is None else self._register(u.ahead),
            _CONVERSIONS[convert],
            slope[0],
            self._item(array, index),
            self._object(array),
            None if convert is None else self._object(convert),
            index,
            *slope[1:],
        )

    def _fmu_call(self, function: Any, arguments: tuple[Any, ...], name: str) -> Any:
        self._kept.append((function, arguments))
        component, *others = arguments
        call = s.FmuCall(
            function=ctypes.cast(function, ctypes.c_void_p),
            component=component,
            name=self._object(name),
            at_end=name.startswith("fmi2Get"),
        )
        if name == "fmi2DoStep":
            _, _, flag = others
            call.kind, call.flag = _DO_STEP, flag
            return call
        references, size, *orders, values = others
        call.kind = _TRANSFER_SLOPES if orders else _TRANSFER
        call.references, call.size = ctypes.addressof(references._obj), size
        call.orders = ctypes.addressof(orders[0]._obj) if orders else None
        call.values = ctypes.addressof(values._obj)
        return call

    def _past(self, operation: Past) -> None:
        o = operation
        what = s.Past(
            result=self._register(o.result),
            ring=self._register(o.ring),
            newest=self._register(o.newest),
            time_register=self._register("t1" if o.ahead else "t"),
            ahead=o.ahead,
        )
        self._put(PAST, operation, what)
        self._holds(operation, partial(bind.past, what, o.part != 0.0))

    def _within(self, operation: Within) -> None:
        o = operation
        what = s.Within(result=self._register(o.result), ring=self._register(o.ring))
        self._put(WITHIN, operation, what)
        self._holds(operation, partial(bind.within, what))

    def _keep(self, operation: Keep) -> None:
        ring, source = self._register(operation.ring), self._register(operation.source)
        what = s.Keep(ring, source)
        self._put(KEEP, operation, what)
        self._holds(operation, partial(bind.keep, what))

    def _move(self, operation: Move) -> None:
        result, source = self._register(operation.result), self._register(operation.source)
        self._put(MOVE, operation, s.Move(result, source))

    def _line(self, operation: Line) -> None:
        names = (operation.result, operation.start, operation.end)
        self._put(LINE, operation, s.Line(*map(self._register, names), self._object(2.0)))

    def _announce(self, operation: Announce) -> None:
        event, state = self._register(operation.event), self._register(operation.state)
        what = s.Announce(event, state)
        self._put(ANNOUNCE, operation, what)
        self._holds(operation, partial(bind.function, what))

    def _branch(self, operation: Branch) -> None:
        tests = self._tests(operation.tests)
        branch = self._put(BRANCH, operation, s.Branch(len(operation.tests), tests))
        self._add(operation.call)
        jump = self._put(JUMP, operation, None)
        branch.next = len(self._operations)
        self._add_all(operation.otherwise)
        jump.next = len(self._operations)

    def _tests(self, tests: Sequence[Due | Edge]) -> int:
        array = (s.Test * len(tests))()
        for what, test in zip(array, tests, strict=True):
            if isinstance(test, Due):
                what.event = self._register(test.event)
                continue
            what.event, what.ring, what.always = -1, self._register(test.ring), test.always
            self._holds(test, partial(bind.edge, what))
        return self._address(array)

    def _divide(self, operation: Divide) -> None:
        o = operation
        stops = (s.Stop * len(o.stops))()
        for what, stop in zip(stops, o.stops, strict=True):
            what.count, what.tests = len(stop.tests), self._tests(stop.tests)
            spans = (ctypes.c_double * len(stop.spans))()
            what.spans = self._address(spans)
            self._holds(stop, partial(bind.stop, what, spans))
        spans = (ctypes.c_double * len(o.spans))()
        what = s.Divide(len(o.stops), self._address(stops), self._address(spans))
        self._holds(o, partial(bind.divide, spans))
        lands = [self._put(DIVIDE, operation, what)]
        self._add_all(o.steps)
        for number, stop in enumerate(o.stops):
            land = s.Land(ctypes.addressof(what), number)
            lands.append(self._put(LAND, operation, land))
            if number:
                lands[-2].next = len(self._operations) - 1
            self._add_all((*stop.signals, *stop.steps))
        jump = self._put(JUMP, operation, None)
        lands[-1].next = len(self._operations) - 1
        lands[0].next = len(self._operations)
        self._add_all(o.otherwise)
        jump.next = len(self._operations)

    def _record(self, operation: Record) -> None:
        registers = [self._register(name) for name in operation.registers]
        array = self._array(ctypes.c_int, registers)
        what = s.Record(len(registers), array, self._object(struct.Struct("d").pack))
        self._put(RECORD, operation, what)


# A plain mapping: functools.singledispatchmethod of Python 3.13.0 keeps every table for ever.
_ADDERS: dict[type, Callable[[Table, Any], None]] = {
    Call: Table._call,
    Read: Table._read,
    Advance: Table._advance,
    Past: Table._past,
    Keep: Table._keep,
    Move: Table._move,
    Line: Table._line,
    Announce: Table._announce,
    Branch: Table._branch,
    Within: Table._within,
    Divide: Table._divide,
    Record: Table._record,
}


def _pause() -> None:
    """Do nothing: Python looks after threads and signals when a function begins."""


def _reduced(integers: tuple[int, int, int]) -> tuple[int, int, int]:
    """Return (a, b, q) in lowest terms; raise EngineError if doubles cannot hold them."""
    divisor = gcd(*integers)
    a, b, q = (n // divisor for n in integers)
    if max(abs(a), b, q) > EXACT:
        raise EngineError(
            f"start + k · step = ({a} + k · {b}) / {q} has numbers above 2^53, which doubles round"
        )
    return a, b, q


def _is_whole(array: Any) -> bool:
    if not isinstance(array, ctypes.Array) or array._type_ not in (ctypes.c_double, ctypes.c_int):
        raise EngineError(f"the compiled stepper does not know FMU variables in {array!r}")
    return array._type_ is ctypes.c_int
