"""One FMU of a diagram misbehaves: what the user is told, what is kept, and what is left behind."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Gain, RailcosimError, Run, SimulationError, Sum
from railcosim.cosim.algorithms import GaussSeidel, Iterated, StepDoubling, TwoPhase
from tests.foreign import ALL, STATE, foreign_fmu
from tests.foreign.faults import FUNCTIONS, Fault, Phase, faulty_fmu

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
HERE, APART = False, True


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("failures")


@pytest.fixture(scope="module")
def faulty(folder: Path) -> Path:
    """Can save and restore its state."""
    return faulty_fmu(folder / "restoring", declares=STATE)


@pytest.fixture(scope="module")
def forgetful(folder: Path) -> Path:
    """Cannot."""
    return faulty_fmu(folder / "forgetful")


def diagram(
    path: Path, fault: Fault, *, isolated: bool = False, phase: Phase = Phase.STEP, **values: float
) -> Diagram:
    """y = 1 + t, in steps of 0.01 s, until it fails at 0.5 s, beside one that does not."""
    timeout = 60.0 if fault in (Fault.MANY_LOGS, Fault.HUGE_LOG) else 1.0
    options: Any = {"isolated": True, "timeout": timeout} if isolated else {}
    options |= values
    made = Diagram("failing", step=0.01)
    made.add("one", Constant(1.0))
    made.add("plant", Fmu(path, fault=int(fault), phase=int(phase), **options))
    made.add("other", Fmu(path))
    made.connect("one.y", "plant.u")
    made.connect("one.y", "other.u")
    return made


def fail(made: Diagram) -> SimulationError:
    with pytest.raises(SimulationError) as caught:
        made.run(1.0, progress=False)
    assert caught.value.run.failure == str(caught.value)
    return caught.value


def assert_rows(run: Run, count: int) -> None:
    """All rows before the failure are there, and right."""
    t = np.arange(count) * 0.01
    assert run.time == pytest.approx(t)
    assert run["plant.y"] == pytest.approx(1.0 + t, rel=1e-12)
    assert run["other.y"] == pytest.approx(1.0 + t, rel=1e-12)


# In a step

STATUS = {
    Fault.ERROR: "returned fmi2Error: [fmi2Error] fmi2DoStep fails on purpose",
    Fault.FATAL: "returned fmi2Fatal: [fmi2Fatal] fmi2DoStep is lost on purpose",
}
ENDS = {
    Fault.SEGV: "its process was ended by SIGSEGV: [fmi2OK] fmi2DoStep writes nowhere",
    Fault.ABORT: "its process was ended by SIGABRT: [fmi2OK] fmi2DoStep aborts",
    Fault.EXIT: "its process ended with exit code 3: [fmi2OK] fmi2DoStep exits",
    Fault.LOOP: "within 1 s (timeout): [fmi2OK] fmi2DoStep does not return",
}


@pytest.mark.parametrize(
    ("fault", "words", "isolated"),
    [(f, w, isolated) for f, w in STATUS.items() for isolated in (HERE, APART)]
    + [pytest.param(f, w, APART, marks=posix) for f, w in ENDS.items()],
)
def test_a_step_fails(
    faulty: Path, tmp_path: Path, fault: Fault, words: str, isolated: bool
) -> None:
    error = fail(diagram(faulty, fault, isolated=isolated))
    assert str(error).startswith("block 'plant': fmi2DoStep at t = 0.5 s ")
    assert words in str(error)
    assert_rows(error.run, 51)
    kept = Run.load(error.run.save(tmp_path / "kept.parquet"))
    assert kept.failure == str(error)
    assert kept.frame.equals(error.run.frame)


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_getting_an_output_fails(faulty: Path, isolated: bool) -> None:
    error = fail(diagram(faulty, Fault.ERROR, phase=Phase.GET, isolated=isolated))
    assert str(error).startswith("block 'plant': fmi2GetReal at t = 0.5 s returned fmi2Error")
    assert_rows(error.run, 50)


@posix
def test_getting_an_output_crashes(faulty: Path) -> None:
    error = fail(diagram(faulty, Fault.SEGV, phase=Phase.GET, isolated=APART))
    assert str(error).startswith("block 'plant': fmi2GetReal at t = 0.5 s did not return")
    assert_rows(error.run, 50)


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_an_output_that_is_no_number(faulty: Path, isolated: bool) -> None:
    error = fail(diagram(faulty, Fault.NO_NUMBER, isolated=isolated))
    assert str(error) == "plant.y is nan at t = 0.5 s"
    assert len(error.run.time) == 51  # with the row that shows it
    assert np.isnan(error.run["plant.y"][-1])
    assert np.isfinite(error.run["plant.y"][:-1]).all()


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_a_warning_is_no_failure(faulty: Path, isolated: bool) -> None:
    run = diagram(faulty, Fault.WARN, isolated=isolated).run(1.0, progress=False)
    assert run.failure is None
    assert_rows(run, 101)


# Discarded steps


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_a_discarded_step_is_made_in_smaller_ones(faulty: Path, isolated: bool) -> None:
    """Also where the FMU has gone a part of the way: it is brought back before."""
    for longest in (0.004, 0.0099, 0.0001):
        made = diagram(faulty, Fault.DISCARD_LONG, isolated=isolated, longest=longest)
        run = made.run(1.0, progress=False)
        assert run.failure is None
        assert_rows(run, 101)


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_a_step_that_is_always_discarded(faulty: Path, isolated: bool) -> None:
    error = fail(diagram(faulty, Fault.DISCARD_ALL, isolated=isolated))
    assert str(error).startswith("block 'plant': fmi2DoStep at t = 0.5 s returned fmi2Discard")
    assert "was the smallest tried" in str(error)
    assert_rows(error.run, 51)


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_discarded_by_an_fmu_that_cannot_go_back(forgetful: Path, isolated: bool) -> None:
    error = fail(diagram(forgetful, Fault.DISCARD_LONG, isolated=isolated))
    assert (
        "block 'plant': fmi2DoStep at t = 0.5 s returned fmi2Discard after 0.504 s; it cannot "
        "restore its state, so no smaller step can be tried"
    ) in str(error)
    assert_rows(error.run, 51)
    error = fail(diagram(forgetful, Fault.DISCARD_ALL, isolated=isolated))
    assert "returned fmi2Discard; it cannot restore its state" in str(error)


# Before and after the steps


@pytest.mark.parametrize("isolated", [HERE, APART])
@pytest.mark.parametrize("phase", [Phase.SETUP, Phase.ENTER, Phase.EXIT])
def test_initialization_fails(faulty: Path, phase: Phase, isolated: bool) -> None:
    faults = [Fault.ERROR, Fault.FATAL, *([Fault.EXIT, Fault.LOOP] if isolated else [])]
    for fault in faults:
        with pytest.raises(RailcosimError) as caught:
            diagram(faulty, fault, phase=phase, isolated=isolated).run(1.0, progress=False)
        words = str(caught.value)
        assert words.startswith(f"block 'plant': {FUNCTIONS[phase]} at t = 0 s ")
        assert "fmi2" in words.partition(": [")[2]  # the log


@pytest.mark.parametrize("isolated", [HERE, APART])
def test_instantiation_fails(folder: Path, isolated: bool) -> None:
    path = faulty_fmu(folder / "none", instantiate="none")
    with pytest.raises(RailcosimError, match="block 'plant': fmi2Instantiate returned no instance"):
        diagram(path, Fault.HONEST, isolated=isolated).run(1.0, progress=False)


@posix
def test_instantiation_crashes(folder: Path) -> None:
    path = faulty_fmu(folder / "abort", instantiate="abort")
    with pytest.raises(
        RailcosimError, match="block 'plant': fmi2Instantiate .* SIGABRT: .* aborts"
    ):
        diagram(path, Fault.HONEST, isolated=APART).run(1.0, progress=False)


@pytest.mark.parametrize(
    ("phase", "fault", "isolated"),
    [
        (Phase.TERMINATE, Fault.ERROR, HERE),
        (Phase.TERMINATE, Fault.FATAL, HERE),
        (Phase.TERMINATE, Fault.ERROR, APART),
        (Phase.TERMINATE, Fault.EXIT, APART),
        (Phase.TERMINATE, Fault.LOOP, APART),
        (Phase.FREE, Fault.EXIT, APART),
        (Phase.FREE, Fault.LOOP, APART),
    ],
)
def test_the_end_fails(faulty: Path, phase: Phase, fault: Fault, isolated: bool) -> None:
    """The rows are all there and right: it is a warning, and the run says so, too."""
    made = diagram(faulty, fault, phase=phase, isolated=isolated)
    with pytest.warns(UserWarning, match=f"block 'plant': {FUNCTIONS[phase]} at t = 1 s"):
        run = made.run(1.0, progress=False)
    assert run.failure is None
    assert_rows(run, 101)
    assert [w.startswith("block 'plant'") for w in run.info["warnings"]] == [True]


# What is left behind

SCRIPT = """
import os, resource, sys
from pathlib import Path
from railcosim import SimulationError
from tests.foreign.faults import Fault, Phase
from tests.systems.test_failures import diagram

fault, phase, isolated = Fault(int(sys.argv[2])), Phase(int(sys.argv[3])), sys.argv[4] == "True"
made = diagram(Path(sys.argv[1]), fault, phase=phase, isolated=isolated)
made.run(0.1)  # everything is imported now
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    run = made.run(1.0, progress=False)
except SimulationError as error:
    error.run.save("kept.parquet")
    raise
finally:
    try:
        os.waitpid(-1, os.WNOHANG)
        print("a process was left")
    except ChildProcessError:
        pass
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print("MiB", (after - before) // 1024)
print("rows", len(run.time))
"""


def run_script(
    tmp_path: Path, path: Path, fault: Fault, phase: Phase, isolated: bool
) -> tuple[int, str, str]:
    """Run a user's script; nothing of it may be left. Return exit code, output, errors."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, path, str(int(fault)), str(int(phase)), str(isolated)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(temporary), "PYTHONPATH": str(ROOT)},
    )
    assert not list(temporary.iterdir())
    assert "a process was left" not in done.stdout
    return done.returncode, done.stdout, done.stderr


@posix
@pytest.mark.parametrize(
    ("fault", "isolated"),
    [
        (Fault.ERROR, HERE),
        (Fault.FATAL, HERE),
        (Fault.DISCARD_ALL, HERE),
        (Fault.NO_NUMBER, HERE),
        (Fault.SEGV, APART),
        (Fault.ABORT, APART),
        (Fault.EXIT, APART),
        (Fault.LOOP, APART),
        (Fault.LEAVE_CHILD, APART),
    ],
)
def test_a_script_ends_in_order(faulty: Path, tmp_path: Path, fault: Fault, isolated: bool) -> None:
    code, _, words = run_script(tmp_path, faulty, fault, Phase.STEP, isolated)
    assert code == 1
    assert "SimulationError: " in words.splitlines()[-1]
    assert len(Run.load(tmp_path / "kept.parquet").time) == 51


@posix
def test_a_script_whose_fmu_fails_at_the_end_goes_on(faulty: Path, tmp_path: Path) -> None:
    code, printed, words = run_script(tmp_path, faulty, Fault.ABORT, Phase.FREE, APART)
    assert (code, "rows 101" in printed) == (0, True)
    assert "fmi2FreeInstance" in words


@pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux tells it")
@pytest.mark.parametrize(
    ("fault", "isolated", "limit"),
    [
        (Fault.MANY_LOGS, HERE, 20),
        (Fault.MANY_LOGS, APART, 20),
        (Fault.HUGE_LOG, HERE, 256 + 20),  # the FMU's own message
        (Fault.HUGE_LOG, APART, 20),
    ],
)
def test_256_megabytes_of_log_messages(
    faulty: Path, tmp_path: Path, fault: Fault, isolated: bool, limit: int
) -> None:
    code, printed, words = run_script(tmp_path, faulty, fault, Phase.STEP, isolated)
    assert code == 0, words
    assert "rows 101" in printed
    grown = int(printed.partition("MiB")[2].split()[0])
    assert grown <= limit


# Isolation changes nothing else


def coupled(lag: Path, faulty: Path, isolated: bool) -> Diagram:
    """A loop over two FMUs, a delay and a gain; both plants start away from rest."""
    options: Any = {"isolated": True} if isolated else {}
    made = Diagram("coupled", step=0.05)
    made.add("target", Constant(0.7))
    made.add("sum", Sum("+-"))
    made.add("gain", Gain(1.3))
    made.add("link", Delay(0.17))
    made.add("lag", Fmu(lag, tau=0.4, **options))
    made.add("plant", Fmu(faulty, **options))
    made.connect("target.y", "sum.u1")
    made.connect("plant.y", "sum.u2")
    made.connect("sum.y", "gain.u")
    made.connect("gain.y", "link.u")
    made.connect("link.y", "lag.u")
    made.connect("lag.b", "plant.u")
    return made


@pytest.mark.parametrize(
    "algorithm",
    [
        TwoPhase(),
        TwoPhase(extrapolation=1),
        GaussSeidel(extrapolation=1),
        Iterated(),
        StepDoubling(),
    ],
    ids=lambda a: repr(a)[:30],
)
def test_the_same_bits_with_isolation_and_without(
    folder: Path, faulty: Path, algorithm: Any
) -> None:
    lag = foreign_fmu("filter", folder / "lag", declares=ALL, order=1)
    here, apart = (
        coupled(lag, faulty, isolated).run(5.0, algorithm=algorithm, progress=False)
        for isolated in (HERE, APART)
    )
    assert len(here.time) == 101
    assert here.frame.equals(apart.frame)
    assert here["plant.y"][-1] != here["plant.y"][0]


def test_a_checkpoint_goes_on_with_isolation_or_without(folder: Path, faulty: Path) -> None:
    lag = foreign_fmu("filter", folder / "lag", declares=ALL, order=1)
    here, apart = (coupled(lag, faulty, isolated) for isolated in (HERE, APART))
    whole = here.run(2.0, progress=False)
    for before, after in ((here, apart), (apart, here)):
        with before.simulation() as simulation:
            checkpoint = simulation.advance(1.0).checkpoint()
        rest = after.run(2.0, resume=checkpoint, progress=False)
        assert len(rest.time) == 21
        assert rest.frame.equals(whole.frame.iloc[20:])


def test_the_same_state_space_with_isolation_and_without(train_fmu: Path) -> None:
    found = []
    for options in ({}, {"isolated": True}):
        made = Diagram("straight", step=0.05)
        made.add("one", Constant(1.0))
        made.add("train", Fmu(train_fmu, **options))
        made.connect("one.y", "train.u")
        found.append(made.linearise(1.0, inputs=["one.y"], outputs=["train.speed"]))
    here, apart = found
    for matrix in ("A", "B", "C", "D"):
        assert (getattr(here, matrix) == getattr(apart, matrix)).all()


MANY = """
import gc, os, sys
from pathlib import Path
from railcosim.cosim.isolated import IsolatedInstance
from tests.foreign.faults import Fault
from tests.systems.test_failures import diagram

made = diagram(Path(sys.argv[1]), Fault.HONEST, isolated=True)
temporary = Path(os.environ["TMPDIR"])

def once():
    made.run(0.2, progress=False)
    gc.collect()
    size = int(Path("/proc/self/statm").read_text().split()[1]) * 4
    children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    return size, len(os.listdir("/proc/self/fd")), len(list(temporary.iterdir())), len(children)

for _ in range(50):
    print(*once())
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures as Linux tells it")
def test_fifty_isolated_runs_leave_nothing(faulty: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", MANY, faulty],
        capture_output=True,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    rows = [[int(n) for n in line.split()] for line in done.stdout.splitlines()]
    assert len(rows) == 50
    assert rows[-1][0] - rows[9][0] <= 1024  # KiB
    assert {tuple(row[1:]) for row in rows[1:]} == {tuple(rows[1][1:])}
    assert rows[1][2:] == [1, 0]
