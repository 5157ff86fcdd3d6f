"""The compiled stepper: it does with each operation what the generated Python does."""

import functools
import math
import struct
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from ctypes import c_double
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest

from railcosim.cosim.schedule.operations import (
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
)
from tests.bare_schedules import VALUES, assert_same, both, compare, outcome, schedule

PLACES = range(len(VALUES))


def halves(seen: list[Any]) -> tuple[list[Any], list[Any]]:
    """Return what the first engine has left in a list, and the second."""
    middle = len(seen) // 2
    return seen[:middle], seen[middle:]


# Calls


def test_arguments_are_registers_times_and_nested_tuples() -> None:
    seen: list[Any] = []
    names = ("k", "t", "tm", "t1", "x0", ("x1", ("x0", "y0"), ()), ())
    call = Call(function=lambda *a: seen.append(a), arguments=names, results="y0")
    start = {"x0": 1.5, "x1": "text", "y0": None}
    compare([call], start, ticks=(3, 6), start=Fraction(1, 3))
    python, compiled = halves(seen)
    assert_same(python, compiled)
    assert compiled[0][:4] == (3, 19 / 30, 0.5 * (19 / 30 + 11 / 15), 11 / 15)
    assert compiled[0][4:] == (1.5, ("text", (1.5, None), ()), ())


def test_a_tick_makes_one_object_of_a_time_and_of_an_fmu_output() -> None:
    """As with a local variable, all that read it get the very same object."""
    seen: list[Any] = []
    look = Call(function=lambda *a: seen.append(a), arguments=("k", "t", "y0", "y0"), results="x0")
    read = Read(values=(("y0", (c_double * 1)(0.25), 0),), node="fmu")
    compare([read, look, look], {"x0": None, "y0": 0.0}, ticks=(1000, 1001))
    for first, second in halves(seen):
        assert all(a is b for a, b in zip(first, second, strict=True))
        assert first[2] is first[3]


class Pair(NamedTuple):
    left: Any
    right: Any


class Backwards(tuple[Any, ...]):
    __slots__ = ()

    def __iter__(self) -> Iterator[Any]:
        return iter(self[::-1])


def broken() -> Iterator[float]:
    yield 1.0
    raise LookupError("half way")


RESULTS: list[Any] = [
    "y0",
    ("y0",),
    ("y0", "x0"),
    (("y0",), "x0"),
    (("y0", "y1"), "x0"),
    ("_", "x0"),
    None,
]
RETURNED: list[Callable[[], Any]] = [
    lambda: 1.0,
    lambda: None,
    lambda: "ab",
    lambda: (),
    lambda: (1.0,),
    lambda: (1.0, 2.0),
    lambda: [1.0, 2.0],
    lambda: ((1.0, 2.0), 3.0),
    lambda: [(1.0, 2), 3.0],
    lambda: ([1.0, 2], [3.0]),
    lambda: ((1.0, 2.0, 3.0), 4.0),
    lambda: ((1.0,), 4.0),
    lambda: (1.0, (2.0, (3.0,))),
    lambda: (1.0, [2.0, {3.0}]),
    lambda: (1.0, (2.0, 3.0)),
    lambda: (n for n in (1.0, 2.0)),
    lambda: Pair(1.0, 2.0),
    lambda: Pair((1.0, 2.0), 2.0),
    lambda: Backwards((1.0, 2.0)),
    lambda: (Backwards((1.0, 2.0)), 3.0),
    lambda: {"a": 1.0, "b": 2.0},
    lambda: np.array([1.0, 2.0]),
    lambda: np.float64(1.0),
    broken,
]


@pytest.mark.parametrize("results", RESULTS, ids=repr)
@pytest.mark.parametrize("place", range(len(RETURNED)))
def test_results_are_taken_apart_as_python_does(results: Any, place: int) -> None:
    call = Call(function=RETURNED[place], arguments=(), results=results, node="block")
    seen: list[Any] = []
    look = Call(
        function=lambda *a: seen.append([repr(v).partition(" at ")[0] for v in a]),
        arguments=("y0", "y1", "x0"),
        results=None,
    )
    clear = Call(function=lambda: (0.0, 0.0, ()), arguments=(), results=("y0", "y1", "x0"))
    compare([clear, call, look, clear], {"y0": 0.0, "y1": 0.0, "x0": ()})
    assert_same(*halves(seen))


def test_wrong_arity_is_told_with_the_line_that_takes_the_result_apart() -> None:
    call = Call(function=lambda: (1.0, 2.0, 3.0), arguments=(), results=(("y0",), "x0"), node="b")
    _, engine = both(schedule([call], {"y0": 0.0, "x0": ()}))
    with pytest.raises(ValueError, match="too many values to unpack") as caught:
        engine.advance(0, 1, [0.0, ()], np.empty((1, 0)))
    assert traceback.extract_tb(caught.value.__traceback__)[-1].line == "((y0,), x0,) = result"
    place = engine.where(caught.value)
    assert place is not None
    assert (place.node, place.tick, place.recorded) == ("b", 0, False)


class Counter:
    """Something to bind methods to and to call."""

    def __init__(self) -> None:
        self.count = 0

    def method(self, x: Any) -> tuple[int, Any]:
        self.count += 1
        return self.count, x

    @classmethod
    def of_class(cls, x: Any) -> tuple[str, Any]:
        return cls.__name__, x

    @staticmethod
    def of_none(x: Any) -> tuple[int, Any]:
        return 1, x

    def __call__(self, x: Any) -> tuple[int, Any]:
        return self.method(x)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Counter().method,
        lambda: Counter().of_class,
        lambda: Counter().of_none,
        Counter,
        lambda: lambda x: (2.0, x),
        lambda: lambda *x: x + x,
        lambda: math.modf,
        lambda: math.sin,
        lambda: functools.partial(divmod, 7.5),
        lambda: "not to be called",
    ],
)
def test_whatever_can_be_called(make: Callable[[], Any]) -> None:
    found = []
    for index in (0, 1):
        call = Call(function=make(), arguments=("x0",), results=("y0", "x0"), node="b")
        start = {"x0": 0.75, "y0": 0.0}
        found.append(outcome(both(schedule([call], start))[index], (0, 3), start, 0))
    assert_same(*found)


@pytest.mark.parametrize(("where", "recorded"), [("before", False), ("after", True)])
def test_calls_before_and_after_a_row_fail(where: str, recorded: bool) -> None:
    def fail(k: int) -> None:
        if k == 2:
            raise LookupError("no")

    call: Any = [Call(function=fail, arguments=("k",), results=None)]
    one = Call(function=lambda: 1.0, arguments=(), results="y0", node="b")
    found = compare([one], {"y0": 0.0}, record=["y0"], **{where: call})
    assert found.error == (LookupError, "no")
    assert found.place[:3] == (None, 2, recorded)
    assert found.rows[:, 0].tolist() == [1.0] * (3 if recorded else 2)


# Moves, lines, delays


@pytest.mark.parametrize("i", PLACES)
def test_a_move_hands_on_the_object(i: int) -> None:
    operations = [Move(result="y1", source="y0"), Move(result="y0", source="x0", every=2)]
    start = {"y0": VALUES[i], "y1": 0.0, "x0": 5}
    assert compare(operations, start).values == [5, 5, 5]
    moved = compare(operations, start, ticks=(1, 2)).values[1]
    assert moved is VALUES[i] or moved == [1.0]


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("i", PLACES)
@pytest.mark.parametrize("j", PLACES)
def test_a_line(i: int, j: int) -> None:
    line = Line(result="a0", start="y0", end="y1", node="block")
    operations = [line, Move(result="x0", source="a0")]
    compare(operations, {"y0": VALUES[i], "y1": VALUES[j], "x0": None})


def test_lines_round_as_python_rounds() -> None:
    """a + 2 (b − a) without a fused multiply-add, for many numbers."""
    rng = np.random.default_rng(1)
    numbers = (rng.standard_normal(4000) * 10.0 ** rng.integers(-8, 8, 4000)).tolist()
    line = Line(result="x0", start="y0", end="y1")
    program, engine = both(schedule([line], {"y0": 0.0, "y1": 0.0, "x0": 0.0}))
    for a, b in zip(numbers[::2], numbers[1::2], strict=True):
        rows = np.empty((1, 0))
        assert_same(
            engine.advance(0, 1, [a, b, 0.0], rows), program.advance(0, 1, [a, b, 0.0], rows)
        )


def past(whole: int, part: float, ahead: int = 0, initial: Any = 0.25) -> Past:
    return Past(
        result="y1",
        ring="x0",
        length=whole + 3,
        whole=whole,
        part=part,
        newest="y0",
        first=whole + 1 if part or ahead else whole,
        initial=initial,
        time=(whole + part) / 10,
        node="delay",
        ahead=ahead,
    )


def keep(whole: int) -> Keep:
    return Keep(ring="x0", length=whole + 3, source="y0", node="delay")


@pytest.mark.parametrize("part", [0.0, 0.3])
@pytest.mark.parametrize(
    ("whole", "ahead"), [(0, 0), (1, 0), (2, 0), (7, 0), (1, 1), (2, 1), (7, 1)]
)
@pytest.mark.parametrize("initial", [0.25, math.sin, lambda t: 3, lambda t: "text"])
def test_a_delay(whole: int, part: float, ahead: int, initial: Any) -> None:
    draw = Call(function=math.sin, arguments=("k",), results="y0", node="b")
    later = past(whole, part, ahead, initial)
    order = [draw, keep(whole), later] if ahead else [draw, later, keep(whole)]
    start = {"y0": 0.0, "y1": 0.0, "x0": [0.0] * (whole + 3)}
    found = compare(order, start, record=["y0", "y1"], ticks=(0, 40))
    if initial is not math.sin and initial != 0.25:
        return
    for k in range(40):
        place = k + ahead - whole
        if k + ahead < later.first:
            history = initial if initial == 0.25 else math.sin((k + ahead) / 10 - later.time)
            assert found.rows[k, 1] == history
        else:
            old, new = math.sin(place - 1), math.sin(place)
            assert found.rows[k, 1] == (new + part * (old - new) if part else new)


@pytest.mark.parametrize("whole", [0, 2])
@pytest.mark.parametrize("part", [0.0, 0.3])
@pytest.mark.parametrize("i", PLACES)
def test_a_delay_of_whatever_a_block_hands_out(i: int, part: float, whole: int) -> None:
    values = [0.5, VALUES[i], 2.5, VALUES[i], VALUES[i], 1, True, 0.1] * 2
    draw = Call(function=lambda k: values[k], arguments=("k",), results="y0", node="block")
    seen: list[Any] = []
    look = Call(function=seen.append, arguments=("y1",), results=None, node="look")
    start = {"y0": 0.0, "y1": 0.0, "x0": [0.0] * (whole + 3)}
    compare([draw, past(whole, part), keep(whole), look], start, ticks=(0, 16))
    assert_same(*halves(seen))


def test_a_delay_of_whole_steps_hands_on_the_very_object() -> None:
    samples = [object() for _ in range(10)]
    draw = Call(function=lambda k: samples[k], arguments=("k",), results="y0", node="b")
    seen: list[Any] = []
    look = Call(function=seen.append, arguments=("y1",), results=None)
    start = {"y0": 0.0, "y1": 0.0, "x0": [0.0] * 5}
    compare([draw, past(2, 0.0), keep(2), look], start, ticks=(0, 10))
    assert seen == [0.25, 0.25, *samples[:8]] * 2


# Events


@pytest.mark.parametrize("i", PLACES)
def test_an_announcement_and_whether_it_is_due(i: int) -> None:
    def next_event(x: Any, t: float) -> Any:
        return VALUES[i] if t > 0.15 else 0.2

    asked: list[Any] = []
    call = Call(function=asked.append, arguments=("k",), results=None)
    operations = [
        Announce(event="e0", function=next_event, state="x0", node="source"),
        Branch(tests=(Due(event="e0"),), call=call, otherwise=(Move(result="y0", source="x0"),)),
    ]
    compare(operations, {"e0": -math.inf, "x0": 1.5, "y0": 0.0}, ticks=(0, 6))
    assert_same(*halves(asked))


@pytest.mark.parametrize("always", [False, True])
@pytest.mark.parametrize("i", PLACES)
def test_an_edge(i: int, always: bool) -> None:
    samples = [0.0, 0.0, 1.0, 1, True, VALUES[i], VALUES[i], 0.5, math.nan, math.nan, 0.0]
    taken: list[Any] = []
    tests = (
        Edge(ring="x0", length=4, whole=1, first=0, always=False),
        Edge(ring="x0", length=4, whole=2, first=1, always=always),
    )
    branch = Branch(
        tests=tests,
        call=Call(function=taken.append, arguments=("k",), results=None),
        otherwise=(Move(result="y1", source="y0"),),
    )
    draw = Call(function=lambda k: samples[k], arguments=("k",), results="y0", node="b")
    store = Keep(ring="x0", length=4, source="y0", node="delay")
    start = {"y0": 0.0, "y1": 0.0, "x0": [0.0] * 4}
    compare([draw], start, updates=[store, branch], ticks=(0, len(samples)))
    assert_same(*halves(taken))
    assert taken[:2] == [0, 1]
    if always and i == VALUES.index("text"):
        assert halves(taken)[1] == [0, 1, 3, 6, 8, 9, 10]


def test_a_comparison_that_fails() -> None:
    announce = Announce(event="e0", function=lambda x, t: t, state="x0", node="source")
    found = compare([announce], {"e0": "soon", "x0": ()})
    assert found.error[0] is TypeError
    assert found.place[:3] == ("source", 0, False)


# Rows


@pytest.mark.parametrize("i", PLACES)
def test_what_a_row_takes(i: int) -> None:
    draw = Call(function=lambda k: VALUES[i] if k == 2 else k, arguments=("k",), results="y0")
    found = compare([draw], {"y0": 0.0}, record=["y0", "y0"])
    if found.error is None:
        expected = np.array([0, 1, float(VALUES[i]), 3, 4])
        assert found.rows[:, 0].tobytes() == expected.tobytes()
    else:
        assert found.error == (struct.error, "required argument is not a float")
        assert found.place[1:3] == (2, False)


@pytest.mark.parametrize("every", [1, 2, 3, 7])
@pytest.mark.parametrize("ticks", [(0, 10), (1, 10), (3, 4), (5, 5)])
def test_rows_at_every_nth_tick(every: int, ticks: tuple[int, int]) -> None:
    draw = Call(function=lambda k: 2 * k, arguments=("k",), results="y0")
    found = compare([draw], {"y0": 0.0}, record=["y0"], every=every, ticks=ticks)
    rows = [2.0 * k for k in range(*ticks) if k % every == 0]
    assert found.rows[: len(rows), 0].tolist() == rows


def test_rows_that_are_too_few_are_refused_and_not_written() -> None:
    draw = Call(function=lambda: 1.0, arguments=(), results="y0")
    _, engine = both(schedule([draw], {"y0": 0.0}), ["y0"])
    for rows in (np.empty((4, 1)), np.empty((5, 1), dtype=np.float32), np.empty((10, 2))[::2, :1]):
        with pytest.raises(ValueError, match="no place for 5 rows"):
            engine.advance(0, 5, [0.0], rows)
    with pytest.raises(ValueError, match="2 values for 1 registers"):
        engine.advance(0, 1, [0.0, 0.0], np.empty((1, 1)))


# Times


@pytest.mark.parametrize(
    ("start", "step"),
    [("0", "1/10"), ("1/3", "1/7"), ("-5", "1/100"), ("12345.678", "0.001"), ("0", "1/999983"),
     ("-1/3", "2/3"), ("0", "86400"), ("1000000007/999983", "1/1000")],
)  # fmt: skip
def test_times_are_rounded_once(start: str, step: str) -> None:
    seen: list[Any] = []
    names = ("k", "t", "tm", "t1")
    look = Call(function=lambda *a: seen.append(a), arguments=names, results=None)
    a, b = Fraction(start), Fraction(step)
    for first in (0, 10**6, 10**9):
        seen.clear()
        compare([look], {"y0": 0.0}, ticks=(first, first + 300), start=a, step=b)
        assert_same(*halves(seen))
        for k, t, _, t1 in seen:
            assert (t, t1) == (float(a + k * b), float(a + (k + 1) * b))


def test_times_beyond_what_doubles_hold_are_left_to_python() -> None:
    seen: list[Any] = []

    def fail(t: float) -> None:
        seen.append(t)
        raise LookupError

    call = Call(function=fail, arguments=("t",), results=None, node="b")
    k = 3 * 2**53 + 1
    found = compare([call], {"y0": 0.0}, ticks=(k, k + 1), step=Fraction(1, 3))
    assert found.place[:2] == ("b", k)
    assert seen == [k / 3] * 2


# Errors


def test_an_exception_comes_whole() -> None:
    raised: list[Any] = []

    def inner(k: int) -> None:
        raised.append(LookupError("no", k))
        raised[0].add_note("noted")
        raise raised[0] from ZeroDivisionError("cause")

    def step(k: int) -> float:
        if k == 3:
            inner(k)
        return float(k)

    call = Call(function=step, arguments=("k",), results="y0", node="guilty")
    _, engine = both(schedule([call], {"y0": 0.0}), ["y0"])
    rows = np.zeros((5, 1))
    with pytest.raises(LookupError) as caught:
        engine.advance(0, 5, [0.0], rows)
    error = caught.value
    assert error is raised[0]
    assert error.args == ("no", 3)
    assert error.__notes__ == ["noted"]
    assert isinstance(error.__cause__, ZeroDivisionError)
    stack = traceback.extract_tb(error.__traceback__)
    assert [frame.name for frame in stack][-2:] == ["step", "inner"]
    assert stack[-1].line == 'raise raised[0] from ZeroDivisionError("cause")'
    place = engine.where(error)
    assert place is not None
    assert (place.node, place.tick, place.recorded) == ("guilty", 3, False)
    assert place.values == {"y0": 2.0, "k": 3}
    assert rows[:3, 0].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit, GeneratorExit, RecursionError])
def test_what_is_no_ordinary_error_passes_too(kind: type[BaseException]) -> None:
    def step() -> None:
        raise kind("now")

    _, engine = both(schedule([Call(function=step, arguments=(), results=None)], {"y0": 0.0}))
    with pytest.raises(kind, match="now"):
        engine.advance(0, 5, [0.0], np.zeros((5, 0)))


def test_endless_recursion_is_an_error() -> None:
    def step(k: int) -> float:
        return step(k + 1)

    start = {"y0": 0.0}
    engines = both(schedule([Call(function=step, arguments=("k",), results="y0", node="b")], start))
    for found in (outcome(engine, (0, 1), start, 0) for engine in engines):
        assert found.error[0] is RecursionError
        assert found.place[:2] == ("b", 0)


@pytest.mark.parametrize(
    "operation",
    [
        Line(result="y0", start="a0", end="a0"),
        Line(result="y0", start="y0", end="a0"),
        Call(function=print, arguments=("a0",), results=None),
        Call(function=print, arguments=(("y0", "a0"),), results=None),
        Keep(ring="x0", length=1, source="a0", node="delay"),
    ],
)
def test_a_register_that_nothing_has_written(operation: Operation) -> None:
    _, engine = both(schedule([operation], {"y0": 0.0, "x0": [0.0]}))
    with pytest.raises(RuntimeError, match="read before it is written"):
        engine.advance(0, 1, [0.0, [0.0]], np.zeros((1, 0)))


# Calls within calls, and at once


def test_an_engine_runs_inside_itself() -> None:
    """Nothing of a call is kept in the engine."""
    runs: list[Any] = []

    def step(k: int, x: float) -> tuple[float, float]:
        if len(runs) < 5:
            runs.append(None)
            engine.advance(0, 3, [0.0, 0.0], np.zeros((3, 1)))
        return x, x + k

    call = Call(function=step, arguments=("k", "x0"), results=("y0", "x0"), node="b")
    _, engine = both(schedule([call], {"y0": 0.0, "x0": 0.0}), ["y0"])
    rows = np.zeros((6, 1))
    assert engine.advance(0, 6, [0.0, 0.0], rows) == [10.0, 15.0]
    assert rows[:, 0].tolist() == [0.0, 0.0, 1.0, 3.0, 6.0, 10.0]


def test_an_engine_runs_in_many_threads() -> None:
    call = Call(function=lambda x: (x, x + 1.0), arguments=("x0",), results=("y0", "x0"), node="b")
    _, engine = both(schedule([call], {"y0": 0.0, "x0": 0.0}))
    found: list[Any] = []

    def run() -> None:
        found.append(engine.advance(0, 20_000, [0.0, 0.0], np.zeros((0, 0))))

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [[19_999.0, 20_000.0]] * 4


def test_other_threads_run_meanwhile() -> None:
    """Also where no Python block gives them the occasion."""
    _, engine = both(schedule([Move(result="y0", source="x0")], {"y0": 0.0, "x0": 1.0}))
    count, ends = 0, threading.Event()

    def tick() -> None:
        nonlocal count
        while not ends.is_set():
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    engine.advance(0, 3 * 10**7, [0.0, 1.0], np.zeros((0, 0)))
    seen = count
    ends.set()
    thread.join()
    assert seen >= 20
