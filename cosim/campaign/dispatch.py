"""Handing runs out in chunks, and finding the one that kills its worker."""

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from time import monotonic

from .chunk import Chunk, Done
from .errors import CampaignError
from .executors import Lanes
from .timeout import words_for

_AIM = 0.6  # s of work in a chunk: what goes to and fro with it is then of no weight
_GROWTH = 20  # times longer than the last chunk, at most: the first run may be an unusual one
_PIECES = 8  # of a chunk that killed its worker: each time one more dies
DIED = "the worker died in this run"


class Dispatch:
    """One campaign's runs on their way through the lanes.

    `make` makes a chunk of runs, `take` keeps what a chunk gave, `bury` keeps the error of a
    chunk's only run that leaves no worker behind to tell it.
    """

    def __init__(
        self,
        lanes: Lanes,
        *,
        make: Callable[[list[int]], Chunk],
        take: Callable[[Done], object],
        bury: Callable[[Chunk, str], object],
        timeout: float | None,
    ) -> None:
        self.lanes, self._make, self._take, self._bury = lanes, make, take, bury
        self._timeout = timeout
        self._todo: deque[int] = deque()
        self._suspects: deque[Chunk] = deque()  # were on their way when a worker died
        self._once: set[int] = set()  # runs in which a worker died while they were alone
        self._flying = 0
        self._broken = False
        self._alone: float | None = None  # since when a suspect has been alone on its way
        self._pace: float | None = None  # s per run
        self._size = 1

    def run(self, numbers: Iterable[int]) -> None:
        """Have all runs computed; raise KeyboardInterrupt when interrupted here or in a worker."""
        self._todo.extend(numbers)
        while self._todo or self._suspects or self._flying:
            self._feed()
            for chunk, done in self.lanes.answers():
                self._flying -= 1
                if done is None:
                    self._lost(chunk)
                else:
                    self._returned(chunk, done)

    def _feed(self) -> None:
        """Keep the lanes full; while there are suspects, they go one by one."""
        if self._suspects:
            if not self._flying:
                self._mend()
                self._submit(self._suspects.popleft())
                self._alone = monotonic()
            return
        if not self._flying:
            self._mend()
        if self._pace is not None:
            self.lanes.expect(self._pace * len(self._todo))
        # Each lane has one chunk in work and one waiting; the first tells how long a run takes.
        room = self.lanes.width * (1 if self._pace is None else 2)
        while self._todo and self._flying < room:
            self._submit(self._make([self._todo.popleft() for _ in range(self._length())]))

    def _mend(self) -> None:
        if self._broken:
            self.lanes.renew()
            self._broken = False

    def _length(self) -> int:
        """Return how many runs the next chunk gets; at the end all lanes share what is left."""
        if self._pace is not None:
            wanted = math.ceil(_AIM / max(self._pace, 1e-6))
            self._size = max(1, min(wanted, _GROWTH * self._size))
        share = math.ceil(len(self._todo) / self.lanes.width)
        return min(self._size, share)

    def _submit(self, chunk: Chunk) -> None:
        self._flying += 1
        self.lanes.submit(chunk)

    def _returned(self, chunk: Chunk, done: Done) -> None:
        if done.refusal is not None:
            raise CampaignError(f"a worker cannot load the campaign's work: {done.refusal}")
        if done.missing:
            shipped = {digest: chunk.parcel.bytes_of(digest) for digest in done.missing}
            self._submit(replace(chunk, shipped=shipped))
            return
        self._alone = None
        self._take(done)
        if done.interrupted:
            raise KeyboardInterrupt
        self._pace = done.seconds / len(done.records)

    def _lost(self, chunk: Chunk) -> None:
        """A worker died: who was alone did it. A chunk is cut up until it is one run."""
        self._broken = True
        began, self._alone = self._alone, None
        if began is None:
            self._suspects.append(replace(chunk, shipped={}))
        elif len(chunk.numbers) > 1:
            size = math.ceil(len(chunk.numbers) / _PIECES)
            for i in reversed(range(0, len(chunk.numbers), size)):
                part = slice(i, i + size)
                self._suspects.appendleft(
                    replace(chunk, numbers=chunk.numbers[part], drawn=chunk.drawn[part], shipped={})
                )
        else:
            self._convict(chunk, monotonic() - began)

    def _convict(self, chunk: Chunk, seconds: float) -> None:
        """Give up a run that took a worker with it while it was alone: the second time it does."""
        if self._timeout is not None and seconds >= self._timeout:
            self._bury(chunk, words_for(self._timeout))
        elif chunk.numbers[0] in self._once:
            self._bury(chunk, DIED)
        else:  # it may have been killed from outside
            self._once.add(chunk.numbers[0])
            self._suspects.appendleft(chunk)
            return
        self._pace = self._pace or _AIM
