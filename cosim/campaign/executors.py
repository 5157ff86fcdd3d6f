"""Where chunks are computed: here, in processes, on an executor of one's own, on a Dask cluster."""

from abc import ABC, abstractmethod
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from typing import Any, cast

from .chunk import Chunk, Done, compute, forget
from .errors import CampaignError
from .pools import Pool, Processes, WhenLong

Answer = tuple[Chunk, Done | None]  # None: the worker was lost


class Lanes(ABC):
    """What a campaign needs of an executor."""

    width: int  # how many chunks are computed at once

    @abstractmethod
    def submit(self, chunk: Chunk) -> None:
        """Have a chunk computed."""

    @abstractmethod
    def answers(self) -> list[Answer]:
        """Wait until at least one chunk has come back."""

    def expect(self, seconds: float) -> None:  # noqa: B027
        """Take notice that so much work (s, of one worker) is still to come."""

    def renew(self) -> None:  # noqa: B027 (most need nothing)
        """Make what is broken anew, when nothing is on its way; raise CampaignError if it stays."""

    def close(self, *, abandon: bool = False) -> None:  # noqa: B027
        """Leave; `abandon` what is on its way."""


class Serial(Lanes):
    """In this thread, one chunk after the other."""

    width = 1

    def __init__(self) -> None:
        self._waiting: list[Chunk] = []

    def submit(self, chunk: Chunk) -> None:
        """Keep a chunk until its answer is asked for."""
        self._waiting.append(chunk)

    def answers(self) -> list[Answer]:
        """Compute the next chunk."""
        chunk = self._waiting.pop(0)
        return [(chunk, compute(chunk))]

    def taken_back(self) -> list[Chunk]:
        """Return the chunks that have not been computed, which then will not be."""
        chunks, self._waiting = self._waiting, []
        return chunks

    def close(self, *, abandon: bool = False) -> None:
        """Let go of the work."""
        forget()


class Futures(Lanes):
    """Any executor of concurrent.futures, by its submit() alone."""

    def __init__(self, pool: Pool, *, owned: bool, renewable: bool) -> None:
        self._pool, self._owned, self._renewable = pool, owned, renewable
        self._flying: dict[Future[Done], Chunk] = {}
        self._lost: list[Answer] = []
        self.width = pool.width

    def submit(self, chunk: Chunk) -> None:
        """Have a chunk computed."""
        try:
            self._flying[self._pool.executor.submit(compute, chunk)] = chunk
        except BrokenExecutor:  # by another chunk, a moment ago
            self._lost.append((chunk, None))
        except RuntimeError as error:
            raise CampaignError(f"the executor takes no work: {error}") from error

    def answers(self) -> list[Answer]:
        """Wait until at least one chunk has come back."""
        found, self._lost = self._lost, []
        if found:
            return found
        for future in wait(self._flying, return_when=FIRST_COMPLETED).done:
            found.append((self._flying.pop(future), _outcome(future)))
        return found

    def renew(self) -> None:
        """Make the pool anew."""
        if not self._renewable:
            raise CampaignError(
                "a worker of the executor died; give a function that makes the executor, so that "
                "it can be made again, or start again: the runs that are done are kept"
            )
        self._pool.renew()

    def close(self, *, abandon: bool = False) -> None:
        """End the pool, if it was made for this campaign; else take back what has not begun."""
        if self._owned or (abandon and self._renewable):
            self._pool.close(abandon=abandon)
        for future in self._flying:
            future.cancel()


class _WhenLong(Lanes):
    _WORTH = 4.0  # s of work, about twice what it takes to start workers
    _PROBES = 3  # chunks until the time of a run is known: the first runs load what they need

    def __init__(self, pool: Pool) -> None:
        self._pool, self._serial, self._answers = pool, Serial(), 0
        self._lanes: Lanes = self._pooled() if pool.started else self._serial

    def _pooled(self) -> Lanes:
        return Futures(self._pool, owned=False, renewable=True)

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self._lanes.width

    def expect(self, seconds: float) -> None:
        known = self._answers >= self._PROBES
        if self._lanes is self._serial and known and seconds > self._WORTH:
            self._lanes = self._pooled()
            for chunk in self._serial.taken_back():
                self._lanes.submit(chunk)

    def submit(self, chunk: Chunk) -> None:
        self._lanes.submit(chunk)

    def answers(self) -> list[Answer]:
        self._answers += 1
        return self._lanes.answers()

    def renew(self) -> None:
        self._lanes.renew()

    def close(self, *, abandon: bool = False) -> None:
        self._serial.close()
        self._lanes.close(abandon=abandon)


def _outcome(future: Any) -> Done | None:
    """Return what came of a chunk; None if its worker was lost."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError):
        return None
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        raise CampaignError(f"a chunk of runs did not come back: {words}") from error


def lanes_for(executor: Any, workers: int | None) -> Lanes:  # noqa: PLR0911
    """Return the lanes of what a user calls an executor; raise CampaignError for what is none."""
    if isinstance(executor, str) and executor not in ("serial", "processes"):
        from .dask import Dask

        return Dask.connected(executor)
    if executor is not None and executor != "processes" and workers is not None:
        raise CampaignError("workers is for processes of this machine; an executor has its own")
    if executor is None or executor == "processes":
        return Futures(Processes(workers), owned=True, renewable=True)
    if executor == "serial":
        return Serial()
    if isinstance(executor, WhenLong):
        return _WhenLong(executor.pool)
    if isinstance(executor, Pool):
        return Futures(executor, owned=False, renewable=True)
    if hasattr(executor, "scheduler_info"):
        from .dask import Dask

        return Dask(executor)
    if hasattr(executor, "submit"):
        return Futures(Pool(lambda: executor), owned=False, renewable=False)
    if callable(executor):
        return Futures(Pool(cast("Any", executor)), owned=True, renewable=True)
    raise CampaignError(
        "executor is 'serial', 'processes', a Dask scheduler's address or client, an executor of "
        f"concurrent.futures or a function that makes one, not {executor!r}"
    )
