"""A campaign of cheap stops on one and on two workers: processes, and a local Dask cluster.

Each way computes the same stops, and must give the same table, bit for bit. Its time is that of the
clock for the whole campaign, journal and table included, with workers that have already computed a
few runs: what it takes to start them does not grow with the number of stops. It needs a machine
with two processors to itself. All numbers count in one run on one machine: trust the ratios.
Run: python benchmarks/campaign_scaling.py [STOPS]
"""

import sys
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from railcosim.cosim.campaign import Campaign, Processes
from railcosim.studies.station_stop.experiments import cases

STOPS = 20_000
TURNS = 3
WARM = 40  # stops before the clock runs


@dataclass(frozen=True)
class Way:
    """An executor of so many workers, and how many times as fast as one process it has to be."""

    name: str
    executor: Callable[[], AbstractContextManager[Any]]
    at_least: float = 0.0


def cluster() -> AbstractContextManager[Any]:
    from distributed import Client

    return Client(n_workers=2, threads_per_worker=1, dashboard_address=":0")


WAYS = (
    Way("one process", lambda: Processes(1)),
    Way("two processes", lambda: Processes(2), at_least=1.8),
    Way("Dask, two workers", cluster, at_least=1.6),
)


def campaign(stops: int) -> Campaign:
    """Stops of `station-stop` with the smooth controller: a few milliseconds each."""
    case: Any = next(case for case in cases() if case.name == "stop-smooth")
    return replace(case, runs=stops).campaign


def timed(way: Way, stops: int) -> tuple[float, bytes]:
    """Return the seconds that a campaign takes, and its table."""
    made = campaign(stops)
    with way.executor() as executor, tempfile.TemporaryDirectory() as folder:
        campaign(WARM).run(executor=executor, progress=False)
        began = perf_counter()
        made.run(folder, executor=executor, progress=False)
        return perf_counter() - began, Path(folder, "table.parquet").read_bytes()


def measure(stops: int = STOPS, turns: int = TURNS) -> list[str]:
    """Print each way's stops per second and ratio to one process; return what is missed."""
    seconds: dict[str, list[float]] = {way.name: [] for way in WAYS}
    tables: set[bytes] = set()
    for _ in range(turns):
        for way in WAYS:
            spent, table = timed(way, stops)
            seconds[way.name].append(spent)
            tables.add(table)
    missed = [] if len(tables) == 1 else ["the tables differ"]
    alone = median(seconds[WAYS[0].name])
    print(f"{stops} stops, in turns, {turns} times")
    for way in WAYS:
        spent = median(seconds[way.name])
        demand = f"  (at least {way.at_least:g})" if way.at_least else ""
        print(f"  {way.name:20}{stops / spent:9.0f} stops/s{alone / spent:8.2f}{demand}")
        if alone / spent < way.at_least:
            missed.append(f"{way.name}: {alone / spent:.2f} < {way.at_least:g}")
    return missed


def main() -> int:
    """Run it; the exit code is 1 if a demanded ratio is missed."""
    missed = measure(int(sys.argv[1]) if len(sys.argv) > 1 else STOPS)
    print("\n".join(["", *missed]) if missed else "\nas demanded")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
