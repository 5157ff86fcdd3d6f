"""A module of ours, run in a second process."""

import os
import signal
import subprocess
import sys
from pathlib import Path


def run_module(
    name: str, *arguments: Path, capture: bool = True, timeout: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a module by this Python, and return what came of it.

    Its output is kept with `capture`, else it goes where this process's goes. Raise
    subprocess.TimeoutExpired after `timeout` (s).
    """
    # Found where this process found it, installed or not.
    path = os.pathsep.join(p for p in sys.path if p)
    return subprocess.run(
        [sys.executable, "-m", name, *map(str, arguments)],
        capture_output=capture,
        text=True,
        errors="replace",
        check=False,
        timeout=timeout,
        env={**os.environ, "PYTHONPATH": path},
    )


def end_of(code: int) -> str:
    """Say how a process ended, by its exit code."""
    if code < 0:
        return f"was ended by {signal.Signals(-code).name}"
    return f"ended with exit code {code}"
