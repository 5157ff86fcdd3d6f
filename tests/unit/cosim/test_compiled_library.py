"""The compiled stepper's library: built once, never in a run's way; and who gets it."""

import ctypes
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Diagram, Step
from railcosim.base.compilers import SUFFIXES, TARGETS, native_target, zig_compiler
from railcosim.base.errors import BuildError, RailcosimError
from railcosim.cosim.compiled import library as libraries
from railcosim.cosim.compiled import structures
from railcosim.cosim.compiled.engine import CompiledEngine
from railcosim.cosim.compiled.library import EngineError, Library, load_library
from railcosim.cosim.compiled.table import Table
from railcosim.cosim.engine.choice import choose_engine
from railcosim.cosim.engine.generate import generate
from railcosim.cosim.schedule.operations import Call, Line, Move, Operation, Record
from tests.bare_schedules import assert_same, both, outcome, schedule

ROOT = Path(__file__).parents[3]
SOURCE = ROOT / "cosim/compiled/stepper.c"
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache, and nothing loaded; what the session had is loaded again afterwards."""
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))
    libraries._loaded.cache_clear()
    yield tmp_path / "cache"
    monkeypatch.undo()
    libraries._loaded.cache_clear()
    load_library()


def ramp() -> Diagram:
    diagram = Diagram("ramp", step=0.1)
    diagram.add("source", Step(at=0.3))
    return diagram


# Building


def test_structures_have_the_sizes_of_their_twins(monkeypatch: pytest.MonkeyPatch) -> None:
    load_library()
    (built,) = libraries.cache_folder("stepper").glob(f"stepper-{libraries._key()}.*")
    Library(built)
    monkeypatch.setattr(structures, "ALL", (*structures.ALL[:-1], structures.Move))
    with pytest.raises(EngineError, match="structures of other sizes"):
        Library(built)


def test_it_is_built_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load_library()
    (built,) = (cache / "stepper").iterdir()
    monkeypatch.setattr(libraries, "_built", lambda name: pytest.fail("it is built again"))
    libraries._loaded.cache_clear()
    load_library()
    assert list((cache / "stepper").iterdir()) == [built]


def test_another_source_compiler_or_machine_makes_another_library(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    keys = {libraries._key()}
    for name, change in (
        ("_source", lambda: b"int x;"),
        ("_compilers", lambda: ["another"]),
        ("machine", lambda: "another"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(libraries, name, change)
            keys.add(libraries._key())
    assert len(keys) == 4
    monkeypatch.setenv("CC", "another --compiler")
    assert libraries._key() not in keys


RUN = """
from tests.unit.cosim.test_compiled_library import ramp
run = ramp().run(1.0, progress=False, engine="compiled")
print(run.engine, run["source.y"].sum())
"""


def start(cache: Path, code: str, **environment: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "RAILCOSIM_CACHE": str(cache), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_processes_build_at_once(tmp_path: Path) -> None:
    processes = [start(tmp_path, RUN) for _ in range(4)]
    for process in processes:
        printed, words = process.communicate()
        assert (printed, words) == ("compiled 8.0\n", "")
    assert len(list((tmp_path / "stepper").iterdir())) == 1


@pytest.mark.parametrize("content", [b"", b"no library", b"\x7fELF and no more"])
def test_a_damaged_library_is_built_anew(tmp_path: Path, content: bytes) -> None:
    start(tmp_path, RUN).communicate()
    (built,) = (tmp_path / "stepper").iterdir()
    good = built.read_bytes()
    built.write_bytes(content)
    printed, words = start(tmp_path, RUN).communicate()
    assert (printed, words) == ("compiled 8.0\n", "")
    assert built.read_bytes() == good


# Where it cannot be had


def assert_runs_without(words: str) -> None:
    run = ramp().run(1.0, progress=False)
    assert run["source.y"].sum() == 8.0
    assert run.engine == "python"
    assert words in run.info["engine_reason"]
    with pytest.raises(RailcosimError, match="engine='compiled': .*engine='python' does without"):
        ramp().run(1.0, progress=False, engine="compiled")
    assert ramp().run(1.0, progress=False, engine="python").info["engine_reason"] == ""


def test_without_a_compiler(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise BuildError("no C compiler: install one")

    monkeypatch.setattr(libraries, "native_compiler", none)
    assert_runs_without("the compiled stepper cannot be had: no C compiler: install one")


def test_with_a_compiler_that_makes_no_library(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Lying:
        runtime = None

        def shared_library(self, source: Path, library: Path) -> None:
            library.write_bytes(b"not at all")

    monkeypatch.setattr(libraries, "native_compiler", Lying)
    assert_runs_without("cannot be had")


def test_with_a_cache_that_cannot_be_written(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("RAILCOSIM_CACHE", str(file))
    assert_runs_without("cannot create the cache folder")


def test_where_libraries_may_not_be_loaded(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: str) -> None:
        raise OSError(f"{path}: failed to map segment: Operation not permitted")

    monkeypatch.setattr(ctypes, "PyDLL", refuse)
    assert_runs_without("Operation not permitted")


def test_with_another_python(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(sys.implementation, "name", "pypy")
        assert_runs_without("it is for CPython, not for pypy")
    libraries._loaded.cache_clear()
    monkeypatch.setattr(libraries.sysconfig, "get_config_var", lambda name: 1)
    assert_runs_without("with a global interpreter lock")


def test_what_went_wrong_is_not_tried_again_but_where_it_is_demanded(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []

    def fail(name: str) -> bytes:
        tried.append(name)
        raise BuildError("broken")

    with monkeypatch.context() as patch:
        patch.setattr(libraries, "_built", fail)
        for _ in range(3):
            assert ramp().run(1.0, progress=False).engine == "python"
        assert len(tried) == 1
    assert ramp().run(1.0, progress=False).engine == "python"
    assert ramp().run(1.0, progress=False, engine="compiled").engine == "compiled"
    assert ramp().run(1.0, progress=False).engine == "compiled"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is next to nothing to build")
def test_zig_needs_no_runtime_for_it(tmp_path: Path) -> None:
    process = start(tmp_path, RUN, CC="false")
    assert process.communicate() == ("compiled 8.0\n", "")
    assert not list((tmp_path / "zig").glob("built-*"))


BARE = """
import importlib.abc, sys
class Without(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "ziglang": raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Without())
import importlib.util
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, *a: None if name == "ziglang" else real(name, *a)
from tests.unit.cosim.test_compiled_library import ramp
run = ramp().run(1.0, progress=False)
print(run.engine, run["source.y"].sum(), run.info["engine_reason"])
"""


@pytest.mark.parametrize("compiler", ["", "false", "not-there"])
def test_a_process_with_no_working_compiler(tmp_path: Path, compiler: str) -> None:
    process = start(tmp_path, BARE, PATH="/nowhere" if not compiler else os.environ["PATH"],
                    **({"CC": compiler} if compiler else {}))  # fmt: skip
    printed, words = process.communicate()
    assert words == ""
    assert printed.startswith("python 8.0 the compiled stepper cannot be had: no C compiler")


# Who gets it


def test_an_engine_is_chosen() -> None:
    made = schedule([Move(result="y0", source="y0")], {"y0": 0.0})
    record = Record(registers=("y0",))
    program = generate(made, record)
    choices = {w: choose_engine(w, made, program, record, (), ()) for w in ("python", "compiled")}
    assert choices["python"] is program
    assert isinstance(choices["compiled"], CompiledEngine)
    assert [(e.name, e.reason) for e in choices.values()] == [("python", ""), ("compiled", "")]
    auto = choose_engine("auto", made, program, record, (), ())
    assert (auto.name, auto.reason) == ("compiled", "")


def test_a_clock_beyond_what_doubles_hold_is_left_to_python() -> None:
    diagram = Diagram("fine", step=Fraction(1, 2**53 + 1))
    diagram.add("one", Constant(1.0))
    run = diagram.run(Fraction(3, 2**53 + 1), progress=False)
    assert run.engine == "python"
    assert "has numbers above 2^53" in run.info["engine_reason"]
    with pytest.raises(EngineError, match="engine='compiled': start \\+ k · step = "):
        diagram.run(Fraction(3, 2**53 + 1), progress=False, engine="compiled")


def test_what_the_stepper_does_not_know_is_refused() -> None:
    class Leap(Move):
        pass

    made: Any = schedule([Leap(result="y0", source="y0")], {"y0": 0.0})
    Table(made, Record(registers=()), (), ())  # a Move all the same
    made = schedule([("no", "operation")], {"y0": 0.0})  # type: ignore[list-item]
    with pytest.raises(EngineError, match="does not know \\('no', 'operation'\\)"):
        Table(made, Record(registers=()), (), ())


# Compilers and machines


def many_numbers() -> tuple[list[Operation], dict[str, Any]]:
    """Return operations that round in every tick."""
    draw = Call(
        function=lambda k, x: (x * 1.1 - k * 0.3, (x + 1e-3) * 0.7),
        arguments=("k", "x0"),
        results=("y0", "x0"),
    )
    lines: list[Operation] = [
        Line(result="y1", start="y0", end="y2"),
        Line(result="y2", start="y2", end="x0"),
    ]
    return [draw, *lines], {"y0": 0.1, "y1": 0.2, "y2": 0.3, "x0": 0.4}


def test_zig_makes_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = tmp_path / f"stepper{SUFFIXES[libraries.host_platform()]}"
    monkeypatch.setattr(libraries, "native_compiler", lambda: zig_compiler(native_target()))
    library.write_bytes(libraries._built(library.name))
    operations, start = many_numbers()
    made = schedule(operations, start)
    names = ("y0", "y1", "y2")
    program, engine = both(made, names)
    other = CompiledEngine(Library(library), engine.table, program)
    found = [outcome(one, (0, 500), start, 3) for one in (program, engine, other)]
    assert_same(found[0], found[1])
    assert_same(found[0], found[2])


@pytest.mark.slow
@pytest.mark.parametrize("platform", TARGETS)
def test_it_compiles_for_all_platforms(platform: str, tmp_path: Path) -> None:
    for target in (*TARGETS[platform], "aarch64-linux-gnu.2.17"):
        suffix = ".so" if "linux" in target else SUFFIXES[platform]
        library = tmp_path / f"{target}{suffix}"
        zig_compiler(target).shared_library(SOURCE, library)
        assert b"stepper_run" in library.read_bytes()


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc's warnings")
def test_it_compiles_without_a_warning(tmp_path: Path) -> None:
    warnings = ["-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Wno-sign-conversion", "-Werror"]
    command = ["gcc", "-std=c99", "-O2", "-c", *warnings, str(SOURCE), "-o", str(tmp_path / "x.o")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stderr == ""


# What a user presses, and other threads


@posix
@pytest.mark.parametrize("has_python", [True, False])
def test_ctrl_c(has_python: bool) -> None:
    """Also in a diagram without a single Python block."""
    operations: list[Operation] = [Move(result="y0", source="x0")]
    if has_python:
        operations.append(Call(function=lambda: None, arguments=(), results=None, node="b"))
    _, engine = both(schedule(operations, {"y0": 0.0, "x0": 1.0}))
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        engine.advance(0, 10**12, [0.0, 1.0], np.zeros((0, 0)))
    assert time.monotonic() - began < 5.0
