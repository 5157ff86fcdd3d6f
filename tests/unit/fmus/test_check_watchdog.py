"""`check` ends an FMU that does not return from a call, and tells what it found before."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event, Thread

import pytest

from railcosim.base.errors import FmuError
from railcosim.cli import main
from railcosim.fmus.check import check, check_isolated, child
from railcosim.fmus.check.heartbeat import PLACES, Heartbeat
from railcosim.fmus.check.report import Finding, Report, Verdict
from tests.foreign import STATE, foreign_fmu

ROOT = Path(__file__).parents[3]
posix = pytest.mark.skipif(sys.platform == "win32", reason="is about POSIX processes")
linux = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
Ask = Callable[[str, str], None]


@pytest.fixture(scope="module")
def stuck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return foreign_fmu("stuck", tmp_path_factory.mktemp("stuck"), declares=STATE)


@pytest.fixture(scope="module")
def honest(stuck: Path) -> Report:
    return check_isolated(stuck)


@pytest.fixture
def temporary(tmp_path: Path) -> Path:
    made = tmp_path / "temporary"
    made.mkdir()
    return made


@pytest.fixture
def ask(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, temporary: Path, honest: Report
) -> Iterator[Ask]:
    """Ask the FMU to do something in a function; nothing may be left of its processes."""
    assert honest.passed, str(honest)
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    monkeypatch.setenv("STUCK_ONCE", str(tmp_path / "once"))

    def ask(function: str, how: str) -> None:
        monkeypatch.setenv("STUCK_IN", function)
        monkeypatch.setenv("STUCK_HOW", how)

    yield ask
    assert_nothing_left(temporary)


def assert_nothing_left(temporary: Path) -> None:
    """Fail if a file or a process is left, but for the files of FMUs that this process loaded."""
    left: list[object] = [temporary]
    for _ in range(500):
        own = set(temporary.glob(f"railcosim-{os.getpid()}-*"))
        left = [*set(temporary.iterdir()) - own, *processes(temporary)]
        if not left:
            break
        time.sleep(0.01)
    assert not left


def processes(folder: Path) -> list[str]:
    """Return the processes that have a folder in their command."""
    found = []
    if sys.platform == "linux":
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                command = path.read_bytes()
            except OSError:
                continue
            if str(folder).encode() in command:
                found.append(f"{path}: {command.decode()}")
    return found


def finding(report: Report, rule: str) -> Finding:
    return next(f for f in report.findings if f.rule == rule)


def from_elsewhere(report: Report, verdict: Verdict) -> dict[str, str]:
    found = [f for f in report.findings if f.rule == "serialized state" and f.verdict is verdict]
    return {f.part: f.detail for f in found}


# What hangs

HANGS = [
    ("fmi2Instantiate", "co-simulation"),
    ("fmi2GetReal", "co-simulation"),
    ("fmi2DoStep", "co-simulation"),
    ("fmi2Terminate", "co-simulation"),
    ("fmi2FreeInstance", "co-simulation"),
    ("fmi2GetFMUstate", "co-simulation"),
    ("fmi2NewDiscreteStates", "model exchange"),
    ("fmi2GetDerivatives", "model exchange"),
]


@pytest.mark.parametrize(("function", "part"), HANGS)
def test_a_call_that_hangs(stuck: Path, honest: Report, ask: Ask, function: str, part: str) -> None:
    ask(function, "loop")
    began = time.monotonic()
    report = check_isolated(stuck, timeout=1.0)
    assert time.monotonic() - began < 20.0
    *before, told, rest = report.findings
    assert before == honest.findings[: len(before)]
    assert (told.rule, told.part, told.verdict) == ("time-out", part, Verdict.FAIL)
    assert told.detail == (
        f"the process that ran the FMU was ended: {function} did not return within 1 s (--timeout) "
        f"after '{before[-1].rule}'; the FMU's last words: [fmi2OK] {function} is stuck"
    )
    assert (rest.rule, rest.verdict) == ("the rest", Verdict.UNCHECKED)


@posix
@pytest.mark.parametrize("when", ["load", "unload"])
def test_a_library_that_hangs_outside_its_functions(stuck: Path, ask: Ask, when: str) -> None:
    ask(when, "loop")
    told = finding(check_isolated(stuck, timeout=1.0), "time-out")
    assert f"the {when}ing of its library did not return within 1 s" in told.detail


@posix
def test_a_process_that_does_not_end(stuck: Path, honest: Report, ask: Ask) -> None:
    """Everything was checked by then."""
    ask("exit", "loop")
    report = check_isolated(stuck, timeout=1.0)
    assert [f.rule for f in report.findings[:-1]] == [f.rule for f in honest.findings]
    assert (report.findings[-1].rule, report.findings[-1].part) == ("time-out", "the process")
    assert "ending its process did not return" in report.findings[-1].detail
    assert len(from_elsewhere(report, Verdict.FAIL)) == 2


@pytest.mark.parametrize("isolated", [True, False])
def test_a_call_that_hangs_in_the_second_process(stuck: Path, ask: Ask, isolated: bool) -> None:
    """The check itself goes on."""
    ask("fmi2DeSerializeFMUstate", "loop")
    report = (check_isolated if isolated else check)(stuck, timeout=1.0)
    words = (
        "the second process was ended: fmi2DeSerializeFMUstate did not return within 1 s "
        "(--timeout); the FMU's last words: [fmi2OK] fmi2DeSerializeFMUstate is stuck"
    )
    assert from_elsewhere(report, Verdict.FAIL) == {
        "co-simulation": words,
        "model exchange": words,
    }
    assert report.failures == 2
    assert report.findings[-1].rule == "reference"


@posix
def test_what_crashes_is_named(stuck: Path, ask: Ask) -> None:
    ask("fmi2SetTime", "abort")
    told = finding(check_isolated(stuck), "crash")
    assert told.part == "model exchange"
    assert told.detail == (
        "the process that ran the FMU was ended by SIGABRT in fmi2SetTime after "
        "'initial dependencies'"
    )
    ask("fmi2DeSerializeFMUstate", "abort")
    words = "the second process was ended by SIGABRT in fmi2DeSerializeFMUstate"
    assert set(from_elsewhere(check_isolated(stuck), Verdict.FAIL).values()) == {words}
    ask("exit", "abort")
    told = finding(check_isolated(stuck), "crash")
    assert "was ended by SIGABRT in ending its process after the last check" in told.detail


def test_the_command(stuck: Path, ask: Ask, capsys: pytest.CaptureFixture[str]) -> None:
    ask("fmi2DoStep", "loop")
    assert main(["check", str(stuck), "--timeout", "0.5"]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "pass archive every file is whole" in text
    assert "FAIL time-out the process that ran the FMU was ended: fmi2DoStep did not" in text
    assert "within 0.5 s (--timeout) after 'initial dependencies'" in text
    assert "1 of 14 checks failed; 1 could not be checked" in text


@pytest.mark.parametrize("timeout", [0.0, -1.0, float("nan")])
def test_a_timeout_that_is_none(
    stuck: Path, timeout: float, capsys: pytest.CaptureFixture[str]
) -> None:
    for function in (check, check_isolated):
        with pytest.raises(FmuError, match="the timeout must be positive, not "):
            function(stuck, timeout=timeout)
    assert main(["check", str(stuck), f"--timeout={timeout}"]) == 1
    assert "railcosim: the timeout must be positive, not" in capsys.readouterr().err


# What does not


@pytest.mark.parametrize(
    "function",
    [
        "fmi2DoStep",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("fmi2GetDerivatives", "fmi2DeSerializeFMUstate")
        ),
    ],
)
def test_a_slow_fmu_is_no_hanging_one(stuck: Path, honest: Report, ask: Ask, function: str) -> None:
    ask(function, "slow")
    began = time.monotonic()
    report = check_isolated(stuck, timeout=1.0)
    assert time.monotonic() - began > 1.0  # the whole takes longer than one call may
    assert report.findings == honest.findings


def test_infinity_waits_for_ever(stuck: Path, honest: Report) -> None:
    assert check_isolated(stuck, timeout=float("inf")).findings == honest.findings


LOGS = """
import resource, sys
from pathlib import Path
from railcosim.fmus.check import check_isolated
report = check_isolated(Path(sys.argv[1]))
print(report.passed, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024)
"""


@linux
def test_256_megabytes_of_log_messages(stuck: Path, ask: Ask) -> None:
    peaks = []
    for how in ("nothing", "logs"):
        ask("fmi2DoStep", how)
        done = subprocess.run(
            [sys.executable, "-c", LOGS, stuck], cwd=ROOT, capture_output=True, text=True
        )
        passed, peak = done.stdout.split()
        assert passed == "True"
        peaks.append(int(peak))
    assert peaks[1] < peaks[0] + 50  # MiB


# Ending

PARENT = """
import sys, tempfile
from pathlib import Path
from railcosim.cli import main
tempfile.tempdir = sys.argv[2]
sys.exit(main(["check", sys.argv[1], "--timeout", "1000"]))
"""


@linux
@pytest.mark.parametrize("function", ["fmi2SetTime", "fmi2DeSerializeFMUstate"])
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_nothing_outlives_the_parent(
    stuck: Path, ask: Ask, temporary: Path, function: str, number: signal.Signals
) -> None:
    ask(function, "loop")
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, stuck, temporary],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    wanted = 3 if function == "fmi2DeSerializeFMUstate" else 2
    for _ in range(2000):
        if len(processes(temporary)) == wanted and is_stuck(temporary, function):
            break
        time.sleep(0.01)
    parent.send_signal(number)
    _, words = parent.communicate(timeout=20.0)
    if number == signal.SIGINT:
        assert (parent.returncode, words) == (130, "railcosim: interrupted\n")
    assert_nothing_left(temporary)


def is_stuck(temporary: Path, function: str) -> bool:
    return any(
        f"{function} is stuck".encode() in p.read_bytes() for p in temporary.rglob("heartbeat")
    )


# The watching itself


def test_a_call_that_hangs_beside_others_that_go_on(tmp_path: Path) -> None:
    heartbeat = Heartbeat.create(tmp_path / "heartbeat")
    there = Heartbeat(tmp_path / "heartbeat")
    hanging, busy, done = there.place("one"), there.place("two"), Event()
    work = busy.marked("fmi2DoStep", time.sleep, 0.01)

    def go_on() -> None:
        hanging.log("a" * 5000)
        hanging.enter("fmi2GetReal")
        while not done.is_set():
            work()

    thread = Thread(target=go_on)
    thread.start()
    try:
        late = child._overdue(heartbeat, thread, 0.3)
    finally:
        done.set()
        thread.join()
    assert late is not None
    found = heartbeat.running(*late)
    assert (found.function, found.part, found.line) == ("fmi2GetReal", "one", "a" * 4000)
    assert heartbeat.numbers() == [late]
    heartbeat.close()
    there.numbers()


def test_every_call_has_a_number_of_its_own(tmp_path: Path) -> None:
    heartbeat = Heartbeat.create(tmp_path / "heartbeat")
    seen: list[tuple[int, int]] = []
    for _ in range(2 * PLACES):
        place = heartbeat.place("part")
        for name in ("fmi2GetReal", "fmi2GetReal", "fmi2SetReal"):
            place.marked(name, lambda: seen.extend(heartbeat.numbers()))()
    assert len({number for _, number in seen}) == 6 * PLACES
    assert {place for place, _ in seen} == set(range(PLACES))
    assert heartbeat.numbers() == []


def test_a_computer_that_slept_makes_nothing_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heartbeat = Heartbeat.create(tmp_path / "heartbeat")
    heartbeat.place("part").enter("fmi2DoStep")
    clock = time.monotonic
    slept = iter([0.0, 0.0, 1000.0])
    monkeypatch.setattr(child, "monotonic", lambda: clock() + next(slept, 1000.0))
    thread = Thread(target=time.sleep, args=(0.5,))
    thread.start()
    assert child._overdue(heartbeat, thread, 1.0) is None


@linux
def test_a_parent_that_was_suspended(stuck: Path, ask: Ask, temporary: Path) -> None:
    ask("fmi2DoStep", "slow")
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT.replace("1000", "1"), stuck, temporary],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    while not Path(os.environ["STUCK_ONCE"]).exists():
        time.sleep(0.01)
    parent.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    parent.send_signal(signal.SIGCONT)
    text, _ = parent.communicate(timeout=60.0)
    assert parent.returncode == 0, text
