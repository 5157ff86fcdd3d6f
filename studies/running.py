"""Running a study's cases: one after the other or, where it pays, side by side in processes."""

from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from itertools import takewhile
from time import perf_counter
from typing import TYPE_CHECKING, Any

from ..base.errors import RailcosimError
from ..cosim.campaign import CampaignError, WhenLong
from ..cosim.campaign.parcel import Parcel, pack, unpack
from ..cosim.campaign.pools import Pool
from .results import Results

if TYPE_CHECKING:
    from .case import Case

_LOADING = 2.0  # s that the first run may take longer than the next: it loads what they all need
_WORTH = 10.0  # s of work for which workers are started: each takes about 2 s to load the same
_GLANCE = 1.0  # s between two looks at what has come back: the bar's clock goes on


def run_all(cases: "Sequence[Case]", results: Results, pool: Pool, bar: Any) -> None:
    """Run the cases, and put what comes out into the results as one after the other does.

    A case that fails ends the runs, with `results.failure`; of those that were on their way after
    it nothing is kept. Interrupted, the results have all cases that are finished.
    """
    beside = _Beside(cases, results, pool, bar)
    place = 0
    try:
        for place, case in enumerate(cases):
            beside.send_from(place)
            if not beside.taken(place):
                bar.set_postfix_str(case.name)
                began = perf_counter()
                case.collect(results, bar.update, WhenLong(pool))
                if case.count == 1:
                    beside.seconds.append(perf_counter() - began)
    except RailcosimError as error:
        results.failure = f"{cases[place].name}: {error}"
        pool.close(abandon=True)
    except KeyboardInterrupt:
        results.failure = f"{cases[place].name}: interrupted"
        beside.take_finished()
        pool.close(abandon=True)


Outcome = tuple[Results, str | None]  # of one case; the message of its error


class _Beside:
    """Cases of one run on their way through worker processes; those of many use these themselves.

    A case that does not come back is run here in its turn: one that cannot be pickled, one that
    ends in an error that is none of ours (which is then raised here, with its traceback), and
    what a worker that died had not done.
    """

    def __init__(self, cases: "Sequence[Case]", results: Results, pool: Pool, bar: Any) -> None:
        self._cases, self._results, self._pool, self._bar = cases, results, pool, bar
        self._futures: dict[int, Future[Outcome | None]] = {}  # by the case's place
        self._pending: dict[Future[Outcome | None], int] = {}  # those not yet seen to be done
        self._sent = 0  # the cases before this place had their chance
        self._died = False
        self.seconds: list[float] = []  # of each case of one run that was run here

    def send_from(self, place: int) -> None:
        """Send the cases from here to the next of many runs, if that was not done and it pays."""
        if place < self._sent or self._died:
            return
        group = list(takewhile(lambda case: case.count == 1, self._cases[place:]))
        if not self._pays(group):
            return
        self._sent = place + len(group)
        results = self._results
        for i, case in enumerate(group, place):
            try:
                parcel = pack(case)
            except CampaignError:
                continue
            future = self._pool.executor.submit(_collect, parcel, results.study, results.units)
            self._futures[i] = future
            self._pending[future] = i

    def _pays(self, group: "Sequence[Case]") -> bool:
        if len(group) < 2 or self._pool.width < 2:
            return False
        if sum(case.long for case in group) > 1:
            return True
        known = len(self.seconds)
        return known > 0 and (sum(self.seconds) - _LOADING) / known * len(group) > _WORTH

    def taken(self, place: int) -> bool:
        """Wait for a case and take in what it gave; False if it must be run here.

        Raise RailcosimError if the case failed.
        """
        future = self._futures.pop(place, None)
        if future is None:
            return False
        while not future.done():
            self._tell()
            for done in wait(self._pending, _GLANCE, FIRST_COMPLETED).done:
                self._note(done)
        self._note(future)
        outcome = self._outcome(future)
        if outcome is None:
            return False
        found, failure = outcome
        self._results.take(found)
        if failure is not None:
            raise RailcosimError(failure)
        return True

    def take_finished(self) -> None:
        """Take in what else has come back."""
        for _, future in sorted(self._futures.items()):
            outcome = self._outcome(future) if future.done() else None
            if outcome is not None:
                self._results.take(outcome[0])

    def _note(self, future: "Future[Outcome | None]") -> None:
        """Count a case that came back; where it failed, none of those after it need begin."""
        place = self._pending.pop(future, None)
        outcome = self._outcome(future)
        if place is None or outcome is None:
            return
        self._bar.update(1)
        if outcome[1] is not None:
            for later in [f for f, i in self._pending.items() if i > place and f.cancel()]:
                self._pending.pop(later)

    def _outcome(self, future: "Future[Outcome | None]") -> Outcome | None:
        """Return what came of a case; None if nothing did."""
        if future.cancelled():
            return None
        error = future.exception()
        if isinstance(error, BrokenExecutor) and not self._died:
            self._died = True
            self._pool.close(abandon=True)  # whoever needs it next has it made again
        return None if error is not None else future.result()

    def _tell(self) -> None:
        """Show what is being run: workers begin the cases in their order."""
        names = [self._cases[i].name for i in self._pending.values()]
        self._bar.set_postfix_str(", ".join(names[: self._pool.width]))


def _collect(parcel: Parcel, study: str, units: dict[str, str]) -> Outcome | None:
    """Run a case, in a worker; None if it is for the master to see how it fails."""
    results = Results(study, units)
    try:
        case: Case = unpack(parcel, {})
        case.collect(results, lambda count: None, "serial")
    except RailcosimError as error:
        return results, str(error)
    except BaseException:
        return None
    return results, None
