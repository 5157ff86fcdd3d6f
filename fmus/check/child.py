"""A module of ours, run in a second process whose calls of an FMU are watched.

Both share a folder: a job and its result, pickles between a parent and its own child; the calls
that run; and the temporary files of the child, so that nothing of it is left however it ends.
"""

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

from ...base.errors import FmuError, RailcosimError
from .heartbeat import Heartbeat, Running

TIMEOUT = 60.0  # s for a call
JOB, RESULT, HEARTBEAT = "job", "result", "heartbeat"
_SLICE = 0.25  # s between two looks at the calls


@dataclass(frozen=True)
class Answer:
    """What came of a process: its result, None without one, and how it ended, "" if well.

    `running` are the calls that had not returned when it ended.
    """

    result: Any
    fault: str
    running: list[Running]
    overdue: bool  # whether it was ended because a call did not return in time

    @property
    def line(self) -> str:
        """What the FMU logged last, to be appended to a message."""
        lines = [call.line for call in self.running if call.line]
        return f"; the FMU's last words: {lines[0]}" if lines else ""


def require_timeout(timeout: float) -> None:
    """Raise FmuError for a time-out (s) that is none; infinity waits for ever."""
    if not timeout > 0.0:
        raise FmuError(f"the timeout must be positive, not {timeout:g} (inf waits for ever)")


def run_module(
    name: str, folder: Path, job: Any, *, timeout: float = TIMEOUT, leads: bool = True
) -> Answer:
    """Run a module by this Python, with a job, in an empty folder.

    A call of an FMU that does not return within `timeout` (s) ends the process. With `leads` the
    process has a group of its own, which ends with it: its own child is to be in this group.
    Raise the RailcosimError that the module raised.
    """
    Path(folder, JOB).write_bytes(pickle.dumps(job))
    heartbeat = Heartbeat.create(folder / HEARTBEAT)
    try:
        with _started(name, folder, leads) as process:
            ended = Thread(target=process.wait, daemon=True, name="railcosim-check")
            ended.start()
            late = _overdue(heartbeat, ended, timeout)
            calls = heartbeat.numbers() if late is None else [late]
        running = [heartbeat.running(*call) for call in calls]
    finally:
        heartbeat.close()
    result = folder / RESULT
    found = pickle.loads(result.read_bytes()) if result.exists() else None
    if isinstance(found, RailcosimError):
        raise found
    where = " or ".join(call.function for call in running)
    if late is not None:
        within = f"did not return within {timeout:g} s (--timeout)"
        return Answer(found, f"was ended: {where} {within}", running, True)
    if process.returncode == 0 and found is not None:
        return Answer(found, "", [], False)
    from ...cosim.isolated.process import end_of

    fault = end_of(process.returncode)
    return Answer(found, f"{fault} in {where}" if where else fault, running, False)


@contextmanager
def _started(name: str, folder: Path, leads: bool) -> "Iterator[subprocess.Popen[bytes]]":
    """Start the process, and leave nothing of it at the end of the body."""
    windows = sys.platform == "win32"
    flags = subprocess.CREATE_NEW_PROCESS_GROUP if windows and leads else 0
    # -P: no module of the working directory in place of the standard library's. What this process
    # finds the other one finds, installed or not.
    path = os.pathsep.join(p for p in sys.path if p)
    temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", name, str(folder)],
        stdin=subprocess.PIPE,
        env={**os.environ, **temporary, "PYTHONPATH": path},
        creationflags=flags,
        process_group=0 if leads and not windows else None,
    )
    try:
        yield process
    finally:
        process.kill()
        if leads and not windows:
            with suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if process.stdin is not None:
            process.stdin.close()


def _overdue(heartbeat: Heartbeat, ended: Thread, timeout: float) -> tuple[int, int] | None:
    """Wait for the process's end; return place and number of a call that has run for too long."""
    wait = min(_SLICE, 0.25 * timeout)
    seen: dict[tuple[int, int], float] = {}  # s for which a call has been seen running
    last = monotonic()
    while True:
        ended.join(wait)
        if not ended.is_alive():
            return None
        now = monotonic()
        # A machine or a job that was suspended does not make a call late.
        passed, last = min(now - last, 2.0 * wait), now
        seen = {call: seen.get(call, -passed) + passed for call in heartbeat.numbers()}
        for call, time in seen.items():
            if time >= timeout:
                return call
