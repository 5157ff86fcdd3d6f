"""Complete stops of a train, one after the other: railcosim's Runner against loops on FMPy.

A stop is 2500 steps of 10 ms of an FMU, a controller in Python every 0.2 s and two delays of its
command, with parameters and delays drawn anew for each; the set-up of each stop counts. FMU and
controller are light ones, or `metro_train` and a sliding mode on a target curve: there most of the
time is their own, for everybody. Each contender is a process of its own (peers_campaign.py), in
turns with the others, and the median of its CPU time counts. Trains must come to rest where
railcosim's do, to 1e-9 m, but where the delays are rounded to the grid. Last comes
campaign_scaling.py: a campaign on two processes, and on a Dask cluster of two, by the clock.

All numbers count in one run on one machine: trust the ratios. Run: python benchmarks/campaign.py
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import campaign_scaling  # the files beside this one
from campaign_stop import STEP, case
from peers_environment import FailedError, NotInstalledError, python, run
from peers_job import Job

AGREE = 1e-9  # m


@dataclass(frozen=True)
class Row:
    """Who makes stops: its name, peers_PEER.py and what it is told, and how it is compared.

    `share` is its part of the stops, for one that is slow. `at_least` is how many times as many
    stops as the naive loop it must make in a second. `differs` says why its trains may come to
    rest elsewhere: always, or off the grid only.
    """

    name: str
    options: dict[str, Any] = field(default_factory=dict)
    peer: str = "campaign"
    interpreter: str = ""  # of an environment in peers_environment, instead of this one
    share: float = 1.0
    at_least: float = 0.0
    differs: str = ""  # "", "off the grid" or "always"
    cases: tuple[str, ...] = ("light", "metro")


NAIVE = Row("naive loop on FMPy", {"how": "naive"}, share=0.25, differs="off the grid")
THROUGHPUT = (
    NAIVE,
    Row("the same, one instance reset", {"how": "naive, reset"}, share=0.25,
        differs="off the grid"),
    Row("FMPy simulate_fmu, train alone", {"how": "simulate"}, share=0.25, differs="always"),
    Row("PathSim", {"how": "stop"}, peer="pathsim", interpreter="pathsim", share=0.02,
        differs="always", cases=("light",)),
    Row("run(), generated Python", {"how": "run", "engine": "python"}),
    Row("run(), compiled", {"how": "run", "engine": "compiled"}),
    Row("Runner, generated Python", {"how": "runner", "engine": "python"}, at_least=2.0),
    Row("FMU and controller alone", {"how": "alone"}, differs="always"),
    Row("Runner, compiled", {"how": "runner", "engine": "compiled"}, at_least=15.0),
)  # fmt: skip


def measure(
    rows: Sequence[Row], stops: int, turns: int, **what: Any
) -> tuple[dict[str, float], list[str]]:
    """Print stops per second of each row and its ratio to the first; return them and the misses.

    `what` is the work: which `case`, and whether the delays are `on_grid`. Trains must come to rest
    where those of the last row do.
    """
    rows = [row for row in rows if what["case"] in row.cases]
    seconds: dict[str, list[float]] = {row.name: [] for row in rows}
    finals: dict[str, list[float]] = {}
    reasons: dict[str, str] = {}
    for _ in range(turns):
        for row in rows:
            if row.name in reasons:
                continue
            try:
                found = run(row.peer, interpreter(row), task(row, stops, what))
            except (FailedError, NotInstalledError) as reason:
                reasons[row.name] = str(reason)
                continue
            seconds[row.name].append(found["seconds"] / len(found["final"]))
            finals[row.name] = found["final"]
    rates = {name: 1.0 / median(times) for name, times in seconds.items() if times}
    return rates, told(rows, rates, finals, reasons, on_grid=what["on_grid"])


def interpreter(row: Row) -> str:
    """Return the Python that runs a row."""
    return python(row.interpreter) if row.interpreter else sys.executable


def task(row: Row, stops: int, what: dict[str, Any]) -> Job:
    """Return what a row's process is told."""
    made = case(what["case"])
    count = max(1, round(row.share * stops))
    values = made.draws(1, on_grid=what["on_grid"])[0] if row.interpreter else {}
    options = {**row.options, **what, "values": values, "start": dict(made.start)}
    return Job("stop", {"train": str(made.fmu)}, count, STEP, options=options)


def told(
    rows: Sequence[Row],
    rates: dict[str, float],
    finals: dict[str, list[float]],
    reasons: dict[str, str],
    *,
    on_grid: bool,
) -> list[str]:
    """Print the table; return what is missed."""
    missed = []
    base, right = rates.get(rows[0].name), finals.get(rows[-1].name, [])
    for row in rows:
        if row.name not in rates:
            print(f"  {row.name:34} {reasons[row.name]}", flush=True)
            missed += [row.name] if row.at_least else []
            continue
        ratio = rates[row.name] / base if base else float("nan")
        line = f"  {row.name:34} {rates[row.name]:9.2f} stops/s {ratio:8.2f}"
        if row.at_least:
            good = ratio >= row.at_least
            line += f"   ≥ {row.at_least:g}  {'met' if good else 'MISSED'}"
            missed += [] if good else [row.name]
        pairs = zip(finals[row.name], right, strict=False)
        far = max((abs(a - b) for a, b in pairs), default=0.0)
        if row.differs == "always" or (row.differs == "off the grid" and not on_grid):
            line += f"   (ends {far:.2g} m away)"
        elif far > AGREE:
            line += f"   ends elsewhere, {far:.0e} m away: does not count"
            missed.append(row.name)
        print(line, flush=True)
    return missed


def main() -> int:
    """Print everything; return 1 if something is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--turns", type=int, default=3, help="runs of each, of which the median")
    parser.add_argument("--stops", type=int, default=200, help="stops of a run")
    parser.add_argument(
        "--campaign", type=int, default=campaign_scaling.STOPS, metavar="STOPS",
        help="stops of the campaign on two processes and on Dask; 0: without it (default: "
        "%(default)s)",
    )  # fmt: skip
    chosen = parser.parse_args()
    print("stops per second of CPU time, and over the naive loop's; medians of "
          f"{chosen.turns} runs of {chosen.stops} stops, in turns")  # fmt: skip
    missed = []
    for name in ("light", "metro"):
        for on_grid in (True, False):
            print(f"\n{name}, delays of {'whole steps' if on_grid else 'whole microseconds'}")
            what = {"case": name, "on_grid": on_grid}
            missed += measure(THROUGHPUT, chosen.stops, chosen.turns, **what)[1]
    if chosen.campaign:
        print("\na campaign on several processes, by the clock")
        missed += campaign_scaling.measure(chosen.campaign, chosen.turns)
    print(f"\n{len(missed)} missed" if missed else "\nall met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
