"""Executors that can be made again, and worker processes on this machine."""

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.context import SpawnContext, SpawnProcess
from types import ModuleType
from typing import Self

from .errors import CampaignError


class Pool:
    """An executor that can be made again when a worker has broken it."""

    def __init__(self, make: Callable[[], Executor], *, width: int | None = None) -> None:
        self._make = make
        self._executor: Executor | None = None
        self._width = width

    @property
    def width(self) -> int:
        """How many workers there are."""
        return self._width or _width_of(self.executor)

    @property
    def started(self) -> bool:
        """Whether there are workers already."""
        return self._executor is not None

    @property
    def executor(self) -> Executor:
        """The executor, which is made when it is first asked for."""
        if self._executor is None:
            self._executor = self._make()
        return self._executor

    def renew(self) -> None:
        """Make the executor again; raise CampaignError if its workers do not even start."""
        self.close(abandon=True)
        try:
            self.executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            raise CampaignError(f"worker processes do not start: {error}") from error

    def close(self, *, abandon: bool = False) -> None:
        """End the workers; `abandon` what they are at."""
        executor, self._executor = self._executor, None
        if executor is None:
            return
        # Python 3.14 has kill_workers(); before that there is no public way.
        processes = list((getattr(executor, "_processes", None) or {}).values()) if abandon else []
        executor.shutdown(wait=not abandon, cancel_futures=True)
        for process in processes:
            with suppress(OSError, ValueError):
                process.kill()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close(abandon=error[0] is not None)


class Processes(Pool):
    """Worker processes on this machine, by default one for each processor.

    They start when they are first needed. In a `with`, or until `close()`, one pool can serve many
    campaigns. They are spawned, not forked: a fork copies locks that other threads hold, and the
    threads of NumPy, pyarrow or a loaded FMU do not survive it. The script that starts them needs
    no `if __name__ == "__main__":`, as it is not imported again.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and not (isinstance(workers, int) and workers > 0):
            raise CampaignError(f"workers is a number of processes, not {workers!r}")
        self._count = workers or processors()
        self._scratch: tempfile.TemporaryDirectory[str] | None = None
        super().__init__(self._started, width=self._count)

    def _started(self) -> Executor:
        self._scratch = tempfile.TemporaryDirectory(
            prefix="railcosim-workers-", ignore_cleanup_errors=True
        )
        return ProcessPoolExecutor(
            self._count, mp_context=_Context(), initializer=_begin, initargs=(self._scratch.name,)
        )

    def close(self, *, abandon: bool = False) -> None:
        """End the workers, and remove what they unpacked: one that was killed could not."""
        super().close(abandon=abandon)
        if self._scratch is not None:
            self._scratch.cleanup()
            self._scratch = None


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Process(SpawnProcess):
    def start(self) -> None:
        with _without_main():
            super().start()


class _Context(SpawnContext):
    Process = _Process


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the main script from multiprocessing, whose processes would import, and so run, it.

    Work travels by value where it comes from there; nothing of the script is needed.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _begin(scratch: str) -> None:
    """Prepare a worker: Ctrl-C is its master's business, and it ends when that one has ended.

    What it unpacks goes into the pool's own folder.
    """
    tempfile.tempdir = scratch
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        shutil.rmtree(scratch, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@dataclass(frozen=True)
class WhenLong:
    """A pool that is used if it has started, or when so much is to do that starting it pays.

    Until then runs are computed here, where one that kills its process ends the campaign: for work
    that is trusted.
    """

    pool: Pool


def _width_of(executor: Executor) -> int:
    return getattr(executor, "_max_workers", None) or processors()
