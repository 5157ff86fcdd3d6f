"""An isolated FMU behaves as any other, and whatever it does ends at its process."""

import gc
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from railcosim.base.errors import FmuError
from railcosim.cosim.fmu.instance import FmuInstance
from railcosim.cosim.isolated import IsolatedInstance, process, waiting
from tests.foreign import ALL, STATE, foreign_fmu
from tests.foreign.faults import FUNCTIONS, Fault, Phase, faulty_fmu

ROOT = Path(__file__).parents[3]
STEP = 0.01
posix = pytest.mark.skipif(sys.platform == "win32", reason="is about POSIX processes")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("isolated")


@pytest.fixture(scope="module")
def lag(folder: Path) -> Path:
    return foreign_fmu("filter", folder, declares=ALL, order=1)


@pytest.fixture(scope="module")
def faulty(folder: Path) -> Path:
    return faulty_fmu(folder / "faulty", declares=STATE)


def begin(instance: FmuInstance | IsolatedInstance) -> None:
    instance.enter_initialization(0.0, 1.0)
    instance.fetch()
    instance.exit_initialization()
    instance.fetch()


def run(instance: FmuInstance | IsolatedInstance, steps: int = 100) -> list[tuple[float, ...]]:
    """Initialize, step with u = 1 and return the outputs."""
    begin(instance)
    instance.inputs([1.0])
    rows = [instance.outputs()]
    for k in range(steps):
        instance.advance(k * STEP, STEP)
        rows.append(instance.outputs())
    return rows


@pytest.fixture
def fails(faulty: Path) -> Iterator[Callable[..., str]]:
    """Run an isolated FMU that fails and return the error's words; nothing may be left of it."""
    made: list[IsolatedInstance] = []

    def fail(
        fault: Fault, phase: Phase = Phase.STEP, *, timeout: float | None = 20.0, at: int = 50
    ) -> str:
        instance = IsolatedInstance("plant", faulty, ["u"], ["y"], timeout=timeout)
        made.append(instance)
        instance.set("fault", fault)
        instance.set("phase", phase)
        instance.set("after", at * STEP)
        with pytest.raises(FmuError) as caught:
            run(instance)
        assert instance.close() is None
        return str(caught.value)

    yield fail
    for instance in made:
        assert is_gone(instance._process.pid)


def is_gone(pid: int) -> bool:
    """Return whether a process is no more, not even as a zombie."""
    if sys.platform == "win32":
        return True
    for _ in range(500):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.01)
    return False


# As any other instance


def use_everything(instance: FmuInstance | IsolatedInstance) -> list[bytes]:
    """Call all that an instance offers and return all that it answers, to the last bit."""
    told = []

    def tell() -> None:
        told.append(np.array(instance.outputs()).tobytes())

    instance.set("tau", 0.3)
    begin(instance)
    tell()
    rng = np.random.default_rng(1)
    for k in range(50):
        instance.inputs([rng.normal()])
        instance.advance(k * STEP, STEP)
        tell()
    for k in range(50, 100):
        instance.inputs([rng.normal()])
        instance.slopes([rng.normal()])
        instance.advance_sloped(k * STEP, STEP)
        tell()
    state = instance.save()
    data = instance.to_bytes(state)
    instance.advance(1.0, STEP)
    tell()
    instance.restore(state)
    instance.fetch()
    tell()
    instance.inputs([1e-320])
    instance.advance(1.0, STEP)
    assert instance.save(state) is not None
    instance.release(state)
    other = instance.from_bytes(data)
    instance.restore(other)
    instance.fetch()
    tell()
    instance.release(other)
    told.append(instance.directional(["flow"], ["a", "b"], [1.0, 0.1]).tobytes())
    instance.reset()
    begin(instance)
    tell()
    instance.inputs([-0.0])
    instance.put()
    instance.fetch()
    tell()
    assert instance.close() is None
    return told


def test_it_answers_as_one_in_this_process_does(lag: Path) -> None:
    ports = ["u"], ["b", "flow"]
    here = use_everything(FmuInstance("lag", lag, *ports))
    there = use_everything(IsolatedInstance("lag", lag, *ports))
    assert here == there
    assert len(set(here)) > 100


def test_its_face_is_the_same(lag: Path) -> None:
    here, there = (kind("lag", lag, ["u"], ["b"]) for kind in (FmuInstance, IsolatedInstance))
    for name in ("can_restore", "can_serialize", "takes_slopes", "gives_directional", "is_ours"):
        assert getattr(here, name) == getattr(there, name)
    assert here.description is there.description
    assert [(len(array), i, convert) for array, i, convert in here.input_slots] == [
        (len(array), i, convert) for array, i, convert in there.input_slots
    ]
    here.close()
    there.close()


def test_ports_of_all_types(folder: Path) -> None:
    """Three arrays each way, of odd sizes; values are converted as in this process."""
    path = foreign_fmu("kinds", folder)
    ports = ["n", "r", "b"], ["flag", "count", "sum"]
    for kind in (FmuInstance, IsolatedInstance):
        instance = kind("mix", path, *ports)
        begin(instance)
        rows = []
        for k, values in enumerate([(2.6, 0.5, 1.0), (-7.0, -1.0, 0.0), (1e6, 4.0, 7.0)]):
            instance.inputs(values)
            instance.advance(0.25 * k, 0.25)
            rows.append(instance.outputs())
        assert rows == [(1.0, 3.0, 0.125), (0.0, -4.0, -0.125), (1.0, 999_996.0, 0.875)]
        instance.close()


@pytest.mark.parametrize("ports", [([], ["y"]), (["u"], []), ([], [])])
def test_without_inputs_or_outputs(faulty: Path, ports: tuple[list[str], list[str]]) -> None:
    instance = IsolatedInstance("plant", faulty, *ports)
    begin(instance)
    instance.put()
    instance.put_slopes()
    instance.advance(0.0, STEP)
    assert instance.outputs() == tuple(1.0 for _ in ports[1])
    assert instance.close() is None


def test_messages_longer_than_a_pipe_holds(lag: Path) -> None:
    many = 20_000
    instance = IsolatedInstance("lag", lag, ["u"] * many, ["b", "flow"] * many)
    begin(instance)
    instance.inputs([1.0] * many)
    instance.advance(0.0, STEP)
    short = FmuInstance("lag", lag, ["u"], ["b", "flow"])
    begin(short)
    short.inputs([1.0])
    short.advance(0.0, STEP)
    assert set(instance.outputs()) == set(short.outputs())
    found = instance.directional(["flow"] * many, ["b"], [1.0])
    assert (found == short.directional(["flow"], ["b"], [1.0])).all()
    instance.close()
    short.close()


def test_a_thread_waits_where_the_system_cannot(
    monkeypatch: pytest.MonkeyPatch, fails: Callable[..., str], lag: Path
) -> None:
    """As on Windows."""
    monkeypatch.setattr(process, "waiting", waiting._threaded)
    assert use_everything(IsolatedInstance("lag", lag, ["u"], ["b", "flow"]))
    test_messages_longer_than_a_pipe_holds(lag)
    assert "SIGSEGV" in fails(Fault.SEGV) or sys.platform == "win32"
    assert "within 0.5 s" in fails(Fault.LOOP, timeout=0.5)


def test_what_the_fmu_prints_and_reads_disturbs_nothing(
    faulty: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for fault in (Fault.PRINT, Fault.READ):
        instance = IsolatedInstance("plant", faulty, ["u"], ["y"])
        instance.set("fault", fault)
        assert run(instance)[-1] == pytest.approx((2.0,))
        instance.close()
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err.count("fmi2DoStep prints\n") == 50


def test_many_at_once(faulty: Path) -> None:
    crowd = [IsolatedInstance(f"plant{i}", faulty, ["u"], ["y"]) for i in range(16)]
    for i, instance in enumerate(crowd):
        begin(instance)
        instance.inputs([float(i)])
    for instance in crowd:
        instance.advance(0.0, 1.0)
    assert [instance.outputs() for instance in crowd] == [(1.0 + i,) for i in range(16)]
    for instance in crowd:
        assert instance.close() is None
    assert all(is_gone(instance._process.pid) for instance in crowd)


# Failing


@pytest.mark.parametrize(
    ("fault", "how"),
    [
        (Fault.ERROR, "fmi2DoStep at t = 0.5 s returned fmi2Error: [fmi2Error] fmi2DoStep fails"),
        (Fault.FATAL, "fmi2DoStep at t = 0.5 s returned fmi2Fatal: [fmi2Fatal] fmi2DoStep is lost"),
        (Fault.DISCARD_ALL, "fmi2DoStep at t = 0.5 s returned fmi2Discard"),
        (Fault.EXIT, "its process ended with exit code 3: [fmi2OK] fmi2DoStep exits"),
        pytest.param(
            Fault.SEGV, "was ended by SIGSEGV: [fmi2OK] fmi2DoStep writes nowhere", marks=posix
        ),
        pytest.param(Fault.ABORT, "was ended by SIGABRT: [fmi2OK] fmi2DoStep aborts", marks=posix),
    ],
)
def test_failures_are_named(fails: Callable[..., str], fault: Fault, how: str) -> None:
    words = fails(fault)
    assert words.startswith("block 'plant': fmi2DoStep at t = 0.5 s ")
    assert how in words


@pytest.mark.parametrize("phase", [p for p in Phase if p not in (Phase.TERMINATE, Phase.FREE)])
def test_the_function_that_crashed_is_named(fails: Callable[..., str], phase: Phase) -> None:
    words = fails(Fault.EXIT, phase)
    at = 0.5 if phase in (Phase.STEP, Phase.GET) else 0.0
    assert words.startswith(f"block 'plant': {FUNCTIONS[phase]} at t = {at:g} s did not return: ")
    assert f"{FUNCTIONS[phase]} exits" in words


def test_a_call_that_does_not_return(fails: Callable[..., str]) -> None:
    began = time.monotonic()
    words = fails(Fault.LOOP, timeout=0.5)
    assert time.monotonic() - began < 5.0
    assert words == (
        "block 'plant': fmi2DoStep at t = 0.5 s did not return within 0.5 s (timeout): "
        "[fmi2OK] fmi2DoStep does not return"
    )
    assert "fmi2EnterInitializationMode" in fails(Fault.LOOP, Phase.ENTER, timeout=0.5)


def test_a_slow_call_is_no_failure(faulty: Path) -> None:
    for timeout in (None, 2.0):
        instance = IsolatedInstance("plant", faulty, ["u"], ["y"], timeout=timeout)
        instance.set("fault", Fault.SLOW)
        instance.set("after", 0.97)
        assert run(instance)[-1] == pytest.approx((2.0,))
        instance.close()


@posix
def test_a_process_that_a_crashed_fmu_left_behind(fails: Callable[..., str]) -> None:
    """It holds the pipe open: nothing tells of the crash but the process's own end."""
    assert "SIGABRT" in fails(Fault.LEAVE_CHILD, timeout=None)


@pytest.mark.slow  # tests/systems/test_failures.py has the same in a diagram
@pytest.mark.parametrize("fault", [Fault.MANY_LOGS, Fault.HUGE_LOG])
def test_256_megabytes_of_log_messages(faulty: Path, fault: Fault) -> None:
    instance = IsolatedInstance("plant", faulty, ["u"], ["y"])
    instance.set("fault", fault)
    assert run(instance)[-1] == pytest.approx((2.0,))
    lines = instance._process.page.lines()
    assert len(lines) == (20 if fault == Fault.MANY_LOGS else 1)
    assert all(len(line) < 1100 for line in lines)
    if fault == Fault.MANY_LOGS:
        assert lines[-1] == "[fmi2OK] fmi2DoStep logged much"
    instance.close()


@pytest.mark.parametrize("phase", [Phase.TERMINATE, Phase.FREE])
@pytest.mark.parametrize("fault", [Fault.EXIT, Fault.LOOP, Fault.ERROR])
def test_an_error_at_the_end_is_told_and_not_raised(
    faulty: Path, phase: Phase, fault: Fault
) -> None:
    instance = IsolatedInstance("plant", faulty, ["u"], ["y"], timeout=0.5)
    instance.set("fault", fault)
    instance.set("phase", phase)
    assert run(instance)[-1] == pytest.approx((2.0,))
    words = instance.close()
    if (fault, phase) == (Fault.ERROR, Phase.FREE):  # has no status to return
        assert words is None
    else:
        assert words is not None
        assert words.startswith(f"block 'plant': {FUNCTIONS[phase]} at t = ")
    assert instance.close() is None
    assert is_gone(instance._process.pid)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("none", "fmi2Instantiate returned no instance: [fmi2Error] fmi2Instantiate fails"),
        ("loop", "fmi2Instantiate at t = 0 s did not return within 0.5 s (timeout)"),
        ("abort", "fmi2Instantiate at t = 0 s did not return: its process"),
    ],
)
def test_failing_at_instantiation(folder: Path, what: str, words: str) -> None:
    path = faulty_fmu(folder / what, instantiate=what)
    with pytest.raises(FmuError) as caught:
        IsolatedInstance("plant", path, ["u"], ["y"], timeout=0.5)
    assert f"block 'plant': {words}" in str(caught.value)


def test_after_its_process_has_ended_every_call_says_so(faulty: Path) -> None:
    instance = IsolatedInstance("plant", faulty, ["u"], ["y"])
    begin(instance)
    instance._process._popen.kill()
    with pytest.raises(FmuError, match=r"the time after the last call at t = 0 s did not return"):
        instance.advance(0.0, STEP)
    for call in (instance.fetch, instance.save, lambda: instance.advance(0.0, STEP)):
        with pytest.raises(FmuError, match="block 'plant': its process has ended before"):
            call()
    assert instance.close() is None


def test_no_python_to_start(faulty: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(faulty.parent / "no-python"))
    with pytest.raises(FmuError, match="cannot start .*no-python: No such file"):
        IsolatedInstance("plant", faulty, ["u"], ["y"])


@posix
def test_a_python_that_does_not_start(
    faulty: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = tmp_path / "python"
    script.write_text("#!/bin/sh\nexit 7\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    with pytest.raises(FmuError, match="process for faulty.fmu did not start: .* exit code 7"):
        IsolatedInstance("plant", faulty, ["u"], ["y"])


def test_a_failure_of_python_is_told_as_such(
    faulty: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tmp_path.joinpath("fmpy.py").write_text("raise ImportError('no such thing')\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    with pytest.raises(FmuError, match="failed in Python: ImportError: no such thing .*fmpy.py:1"):
        IsolatedInstance("plant", faulty, ["u"], ["y"])


# Ending


def test_one_that_nobody_closed_leaves_nothing(faulty: Path) -> None:
    instance = IsolatedInstance("plant", faulty, ["u"], ["y"])
    pid = instance._process.pid
    del instance
    gc.collect()
    assert is_gone(pid)


@pytest.mark.slow
def test_again_and_again_nothing_grows(
    faulty: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = Path(shutil.copy(faulty, tmp_path))
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))

    def once() -> None:
        instance = IsolatedInstance("plant", path, ["u"], ["y"])
        run(instance, 5)
        assert instance.close() is None

    def counts() -> tuple[int, int]:
        files = len(os.listdir("/proc/self/fd")) if sys.platform == "linux" else 0  # noqa: PTH208
        return files, len(list(temporary.iterdir()))

    for _ in range(3):
        once()
    gc.collect()
    before, memory = counts(), resident()
    for _ in range(30):
        once()
    gc.collect()
    assert counts() == before
    assert before[1] == 1  # the FMU's files, as long as this process lives
    assert resident() - memory <= 2048  # a page of shared memory left each time would be 2400


def resident() -> int:
    """Return this process's memory in KiB, 0 where that is not told."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0
    line = next(x for x in status.read_text().splitlines() if x.startswith("VmRSS"))
    return int(line.split()[1])


PARENT = """
import os, sys, tempfile, time
from pathlib import Path
from railcosim.cosim.isolated import IsolatedInstance
from tests.foreign.faults import Fault
from tests.unit.cosim.test_isolated import begin

path, fault = Path(sys.argv[1]), int(sys.argv[2])
plants = [IsolatedInstance("plant", path, ["u"], ["y"], timeout=None) for _ in range(3)]
for plant in plants:
    plant.set("fault", fault)
    plant.set("after", 0.0)
    begin(plant)
print(*(plant._process.pid for plant in plants), flush=True)
print(*Path(tempfile.gettempdir()).glob("railcosim-*"), sep="|", flush=True)
try:
    while True:
        plants[0].advance(0.0, 0.01)
        time.sleep(10.0)
finally:
    for plant in plants:
        plant.close()
"""


def start_parent(faulty: Path, temporary: Path, fault: Fault) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", PARENT, faulty, str(int(fault))],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, "TMPDIR": str(temporary)},
        start_new_session=True,
    )


@posix
@pytest.mark.parametrize("fault", [Fault.HONEST, Fault.LOOP])
def test_a_parent_that_is_killed(faulty: Path, tmp_path: Path, fault: Fault) -> None:
    """Also while an FMU hangs: no process stays, and no folder."""
    with start_parent(faulty, tmp_path, fault) as parent:
        assert parent.stdout is not None
        children = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(children) == 3
        assert parent.stdout.readline().strip()
        time.sleep(0.3)
        parent.kill()
        parent.wait()
    assert all(is_gone(pid) for pid in children)
    assert not list(tmp_path.glob("railcosim-*"))


@posix
@pytest.mark.parametrize("fault", [Fault.HONEST, Fault.LOOP])
def test_control_c(faulty: Path, tmp_path: Path, fault: Fault) -> None:
    """It goes to all processes of the terminal: the parent decides, and the rest ends with it."""
    with start_parent(faulty, tmp_path, fault) as parent:
        assert parent.stdout is not None
        children = [int(pid) for pid in parent.stdout.readline().split()]
        assert parent.stdout.readline().strip()
        time.sleep(0.3)
        began = time.monotonic()
        os.killpg(parent.pid, signal.SIGINT)
        _, words = parent.communicate(timeout=30.0)
        assert time.monotonic() - began < 5.0
    assert parent.returncode in (130, -signal.SIGINT)
    assert words.strip().endswith("KeyboardInterrupt")
    assert words.count("Traceback") == 1
    assert all(is_gone(pid) for pid in children)
    assert not list(tmp_path.glob("railcosim-*"))
