"""The compiled stepper calls FMUs as the generated Python does; and keeps no memory."""

import gc
import math
import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim.base.errors import FmuError
from railcosim.cosim.compiled.library import EngineError
from railcosim.cosim.schedule.operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Due,
    Edge,
    Input,
    Keep,
    Line,
    Move,
    Operation,
    Past,
    Read,
)
from tests.bare_schedules import VALUES, Outcome, PlayedFmu, assert_same, both, outcome, schedule


def advance(fmu: Any, ahead: Any = None) -> Advance:
    """Return a step that gives an FMU the registers y0 … y5, the first perhaps with a line."""
    inputs = [Input(value=f"y{i}") for i in range(6)]
    if ahead is not None:
        inputs[0] = Input(value="y0", ahead="a0")
    return Advance(instance=fmu, inputs=tuple(inputs), span=0.1, node="fmu")


def played(
    values: Sequence[Any], ahead: Any = None, statuses: dict[str, int] | None = None, **options: Any
) -> Outcome:
    """Give an FMU six inputs, two of each type, over three ticks, with both engines."""
    start = {f"y{i}": value for i, value in enumerate(values)}
    start |= {"a0": ahead, **{f"z{i}": None for i in range(6)}}
    logs, found = [], []
    for index in (0, 1):
        fmu = PlayedFmu(**options)
        fmu.statuses = statuses or {}
        arrays = [(array, i) for array in fmu.outputs.values() for i in (0, 1)]
        read = Read(values=tuple((f"z{i}", *slot) for i, slot in enumerate(arrays)), node="fmu")
        engine = both(schedule([advance(fmu, ahead)], start, updates=[read]))[index]
        found.append(outcome(engine, (0, 3), start, 0))
        logs.append([fmu.log, [list(a) for a in fmu.inputs.values()], list(fmu.slope_values)])
    assert_same(*found)
    assert_same(*logs)
    assert logs[0][0] or found[0].error
    return found[1]


MODES = [
    {"is_ours": True},
    {"is_ours": False},
    {"is_ours": False, "steps_inline": False},
    {"takes_slopes": True},
    {"takes_slopes": True, "steps_inline": False},
]


@pytest.mark.parametrize("mode", MODES, ids=repr)
@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("i", range(len(VALUES)))
def test_what_an_fmu_input_takes(i: int, place: int, mode: Any) -> None:
    values: list[Any] = [0.5, 1.5, 2.5, -7, True, 0.0]
    values[place] = VALUES[i]
    played(values, **mode)
    if place == 0:
        played(values, 0.75, **mode)
        played([0.75, *values[1:]], VALUES[i], **mode)


@pytest.mark.parametrize(
    "number",
    [0.5, 1.5, 2.5, -0.5, -1.5, 0.49999999999999994, 2147483646.5, 2147483647.0, 2147483647.4,
     2147483647.5, 2147483648.0, -2147483648.0, -2147483648.5, -2147483649.0, 1e10, -1e300, 1e-320,
     math.nan, math.inf, -math.inf, 2**31, -(2**31) - 1, 2**40 + 3, 2**80],
)  # fmt: skip
def test_integers_are_rounded_as_python_rounds(number: float) -> None:
    """Half to even; what does not fit into 32 bits goes where ctypes lets it go."""
    found = played([0.0, 0.0, number, 0, 0, 0])
    assert (found.error is None) == math.isfinite(number)


def test_fmu_outputs_have_the_types_of_their_variables() -> None:
    found = played([0.0] * 6)
    assert [type(v) for v in found.values[7:]] == [float, float, int, int, int, int]


NAMES = ("fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean", "fmi2SetRealInputDerivatives",
         "fmi2DoStep", "fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean")  # fmt: skip


@pytest.mark.parametrize("status", [1, 2, 3, 4, 5, -1])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("is_ours", [True, False])
def test_a_status_of_an_fmu(name: str, status: int, is_ours: bool) -> None:
    found = played([0.25] * 6, 0.5, {name: status}, is_ours=is_ours, takes_slopes=True)
    if status <= 1:
        assert found.error is None
        return
    at = 0.1 if name.startswith("fmi2Get") else 0.0
    assert found.error == (FmuError, f"{name} {status} {at!r}")
    assert found.place[:2] == ("fmu", 0)
    assert found.frames[-1][0] == "fail"


def test_an_instance_that_steps_in_python_fails() -> None:
    found = played([0.25] * 6, None, {"any": 3}, steps_inline=False)
    assert found.error == (FmuError, "it fails")
    assert found.frames[-1][0] == "_advance"


def test_arrays_of_other_kinds_are_refused() -> None:
    fmu = PlayedFmu()
    fmu.input_slots[0] = (np.zeros(2), 0, None)  # type: ignore[call-overload]
    with pytest.raises(EngineError, match="does not know FMU variables"):
        both(schedule([advance(fmu)], {f"y{i}": 0.0 for i in range(6)}))
    fmu = PlayedFmu()
    fmu.input_slots[0] = (fmu.inputs["Real"], 2, None)
    with pytest.raises(EngineError, match="finds no item 2"):
        both(schedule([advance(fmu)], {f"y{i}": 0.0 for i in range(6)}))
    fmu = PlayedFmu()
    fmu.input_slots[2] = (fmu.inputs["Integer"], 0, float)
    with pytest.raises(EngineError, match="go through <class 'float'>"):
        both(schedule([advance(fmu)], {f"y{i}": 0.0 for i in range(6)}))


# Memory


FEW = 100  # blocks; one that is left in each round would be 1000


def grown(function: Callable[[], object], rounds: int = 1000) -> int:
    """Return by how many blocks of memory so many rounds grow at least."""
    function()
    found = []
    for _ in range(3):  # caches fill up in the first one: one that grows by few is enough
        gc.collect()
        before = sys.getallocatedblocks()
        for _ in range(rounds):
            function()
        gc.collect()
        found.append(sys.getallocatedblocks() - before)
        if found[-1] < FEW:
            break
    return min(found)


class NoLog:
    def append(self, one: Any) -> None:
        pass

    def __len__(self) -> int:
        return 0


class Quiet(PlayedFmu):
    """A played FMU that keeps no log."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.log: Any = NoLog()


def everything() -> tuple[list[Operation], list[Operation], dict[str, Any]]:
    """Return operations of all kinds, with plain numbers and others."""
    fmu, apart = Quiet(takes_slopes=True), Quiet(is_ours=False, steps_inline=False)
    past = Past(
        result="y5", ring="x0", length=5, whole=2, part=0.25, newest="y0", first=3,
        initial=lambda t: t + 1e6, time=0.225, node="delay",
    )  # fmt: skip
    outputs: list[Operation] = [
        Call(function=lambda k: ((k + 1e5, k + 10**6), [k]), arguments=("k",),
             results=(("y0", "y1"), "x1"), node="a"),
        Call(function=lambda *a: [a, len(a)], arguments=("t", ("y0", ("y1", "k")), "t1", "tm"),
             results=("x1", "y2"), node="b"),
        Call(function=Fraction, arguments=("y1",), results="y4", node="c"),
        Read(values=(("y3", fmu.outputs["Integer"], 0), ("y2", fmu.outputs["Real"], 0)), node="d"),
        past,
        Line(result="a0", start="y0", end="y5"),
        Line(result="a1", start="y4", end="y5"),
    ]  # fmt: skip
    tests = (Due(event="e0"), Edge(ring="x0", length=5, whole=2, first=1, always=True))
    look = Call(function=lambda *a: a, arguments=("k", "x1"), results=None)
    steps = (advance(fmu, 1.0), advance(apart), advance(apart, 1.0))
    updates: list[Operation] = [
        Keep(ring="x0", length=5, source="y0", node="delay"),
        Announce(event="e0", function=lambda x, t: t + 0.35, state="x1", node="s"),
        Branch(tests=tests, call=look, otherwise=steps),
        *steps,
        Move(result="p0", source="y4"),
    ]
    start = {f"y{i}": 0.0 for i in range(6)}
    return outputs, updates, start | {"x0": [0.0] * 5, "x1": (), "e0": -1.0, "p0": None}


def test_nothing_is_left_of_a_run() -> None:
    outputs, updates, start = everything()
    made = schedule(outputs, start, updates=updates)
    _, engine = both(made, ["y0", "y1", "y4"])
    rows = np.zeros((9, 3))

    def run() -> None:
        values = [list(v) if isinstance(v, list) else v for v in start.values()]
        engine.advance(0, 9, values, rows)

    assert grown(run) < FEW
    marked = object()
    before = sys.getrefcount(marked)
    engine.advance(0, 1, list((start | {"p0": marked}).values()), rows)
    assert sys.getrefcount(marked) == before


FAILURES: list[tuple[type[Exception], str, Any, Any]] = [
    (ZeroDivisionError, "division", (("y0", "y1"), "x1"), lambda k: ((1 / (7 - k), k), k)),
    (ValueError, "too many", (("y0", "y1"), "x1"), lambda k: ((k, k), k) if k < 7 else "ABC"),
    (ValueError, "not enough", (("y0", "y1"), "x1"), lambda k: ((k, k) if k < 7 else [k], k)),
    (struct.error, "not a float", "y1", lambda k: k if k < 7 else "text"),
]


@pytest.mark.parametrize(("kind", "words", "results", "function"), FAILURES)
@pytest.mark.parametrize("place", [2, 7])
def test_nothing_is_left_of_a_run_that_fails(
    kind: type[Exception], words: str, results: Any, function: Any, place: int
) -> None:
    outputs, updates, start = everything()
    if kind is struct.error:
        place = len(outputs)  # the first to notice is the row
    guilty = Call(
        function=lambda k, deep: function(k),
        arguments=("k", ("y0", ("y1", "x1"))),
        results=results,
        node="guilty",
    )
    made = schedule([*outputs[:place], guilty, *outputs[place:]], start, updates=updates)
    _, engine = both(made, ["y0", "y1", "y4"])
    rows = np.zeros((9, 3))

    def run() -> None:
        values = [list(v) if isinstance(v, list) else v for v in start.values()]
        with pytest.raises(kind, match=words) as caught:
            engine.advance(0, 9, values, rows)
        where = engine.where(caught.value)
        assert where is not None
        assert where.tick == 7

    assert grown(run) < FEW


def test_nothing_is_left_of_a_status() -> None:
    fmu = Quiet(takes_slopes=True)
    fmu.statuses = {"fmi2DoStep": 3}
    start = {f"y{i}": 1e5 for i in range(6)} | {"a0": 2e5}
    _, engine = both(schedule([advance(fmu, 1.0)], start))

    def run() -> None:
        with pytest.raises(FmuError):
            engine.advance(0, 9, list(start.values()), np.zeros((0, 0)))

    assert grown(run) < FEW


def exercise() -> None:
    """Run all operations some times, and let them fail in all ways."""
    outputs, updates, start = everything()
    guilty = [
        (results, function, 7 if kind is not struct.error else len(outputs))
        for kind, _, results, function in FAILURES
    ]
    for results, function, place in [("p0", lambda k: k, 0), *guilty]:
        call = Call(
            function=lambda k, deep, inner=function: inner(k),
            arguments=("k", ("y0", ("y1", "x1"))),
            results=results,
        )
        made = schedule([*outputs[:place], call, *outputs[place:]], start, updates=updates)
        _, engine = both(made, ["y0", "y1", "y4"])
        for _ in range(5):
            values = [list(v) if isinstance(v, list) else v for v in start.values()]
            with suppress(ArithmeticError, ValueError, struct.error):
                engine.advance(0, 9, values, np.zeros((9, 3)))


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_valgrind_finds_nothing_in_it(tmp_path: Path) -> None:
    """What it finds in Python and its libraries does not count."""
    log = tmp_path / "log"
    code = "from tests.unit.cosim.test_compiled_fmus import exercise; exercise()"
    done = subprocess.run(
        ["valgrind", f"--log-file={log}", sys.executable, "-c", code],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "PYTHONMALLOC": "malloc"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "ERROR SUMMARY" in log.read_text()
    assert "stepper" not in log.read_text()
