"""The inside of a process that `run_module` starts."""

import os
import pickle
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

from ...base.errors import RailcosimError
from .child import HEARTBEAT, JOB, RESULT
from .heartbeat import Heartbeat

AT_THE_END = "ending its process"  # marked like a call: what the FMU left to be run there may hang


def serve(folder: Path, work: Callable[[Any, Heartbeat], Any]) -> None:
    """Do the job, and write its result or the error."""
    _keep_apart(folder)
    heartbeat = Heartbeat(folder / HEARTBEAT)
    job = pickle.loads(Path(folder, JOB).read_bytes())
    found: Any
    try:
        found = work(job, heartbeat)
    except RailcosimError as error:
        found = error
    unfinished = folder / "unfinished"
    unfinished.write_bytes(pickle.dumps(found))
    unfinished.replace(folder / RESULT)
    heartbeat.place("").enter(AT_THE_END)


def _keep_apart(folder: Path) -> None:
    """End with the parent; what the FMU prints goes to standard error, and it has nothing to read.

    Standard input comes from the parent and has nothing but an end: that of the parent.
    """
    parent, nowhere = os.dup(0), os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    try:
        os.dup2(2, 1)
    except OSError:
        os.dup2(nowhere, 1)
    os.close(nowhere)
    if sys.platform == "win32":
        import msvcrt

        # No window that waits for someone to press a button.
        msvcrt.SetErrorMode(msvcrt.SEM_FAILCRITICALERRORS | msvcrt.SEM_NOGPFAULTERRORBOX)
    else:
        signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    Thread(target=_outlive, args=(parent, folder), daemon=True).start()


def _outlive(parent: int, folder: Path) -> None:
    """Wait for the parent's death, then leave nothing of what it could not remove."""
    os.read(parent, 1)
    shutil.rmtree(folder, ignore_errors=True)
    if sys.platform != "win32" and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)
