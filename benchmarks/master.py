"""railcosim's master against others: CPU time per communication step, one run on one machine.

Every contender gets the same FMUs, made by railcosim, and the same work; each run is a process of
its own (peers_*.py), in turns with the others, and the median counts. Set-up is excluded for all:
loading, initialization, and for railcosim the code that it generates. What a contender ends with
must be railcosim's final state to 1e-9 before its time counts. The peers are installed once into
environments of their own below railcosim's cache folder (about 1.5 GB, most of it CoFmuPy's
dependencies); one that cannot be installed is reported, and the others go on.

All numbers count in one run on one machine: trust the ratios. Run: python benchmarks/master.py
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import log
from statistics import median
from typing import Any

import peers_plants  # the files beside this one
from peers_environment import PACKAGES, FailedError, NotInstalledError, python, run
from peers_job import Job

AGREE = 1e-9  # relative to the largest of the final states
LINEAR = 1.1  # order of growth; 1 but for the caches, which 1000 instances overflow


@dataclass(frozen=True)
class Contender:
    """Who runs: its name in the table, peers_PEER.py, and what it is told."""

    name: str
    peer: str
    options: dict[str, Any] = field(default_factory=dict)
    steps: int = 0  # 0: the job's


def ours(engine: str, **options: Any) -> Contender:
    words = f", {options['algorithm']}" if "algorithm" in options else ""
    return Contender(f"railcosim, {engine}{words}", "railcosim", {"engine": engine, **options})


class Bench:
    """Runs contenders, holds their times against each other and counts what is missed."""

    def __init__(self, turns: int) -> None:
        self.turns = turns
        self.missed: list[str] = []
        self.interpreters: dict[str, str] = {}
        self.absent: dict[str, str] = {}
        for peer in PACKAGES:
            try:
                self.interpreters[peer] = python(peer)
            except NotInstalledError as reason:
                self.absent[peer] = f"not installed: {reason}"

    def once(self, contender: Contender, job: Job) -> dict[str, Any]:
        """Run a contender once."""
        interpreter = self.interpreters.get(contender.peer, sys.executable)
        options = {**job.options, **contender.options}
        job = replace(job, options=options, steps=contender.steps or job.steps)
        return run(contender.peer, interpreter, job)

    def measure(
        self, job: Job, contenders: Sequence[Contender], final: Sequence[float] | None
    ) -> dict[str, float]:
        """Return µs per step by contender, and print them; `final` is what all must end with."""
        seconds: dict[str, list[float]] = {}
        engines: dict[str, str] = {}
        for _ in range(self.turns):
            for contender in contenders:
                name = contender.name
                if contender.peer in self.absent or seconds.get(name) == []:
                    continue
                try:
                    found = self.once(contender, job)
                except FailedError as error:
                    seconds[name] = []
                    self._say(name, f"failed: {error}")
                    continue
                far = _distance(found["final"], final)
                if far > AGREE:
                    seconds[name] = []
                    self._say(name, f"ends elsewhere, {far:.0e} away: its time does not count")
                    continue
                seconds.setdefault(name, []).append(found["seconds"])
                engines[name] = found.get("engine", "")
        times: dict[str, float] = {}
        for contender in contenders:
            steps = contender.steps or job.steps
            if contender.peer in self.absent:
                self._say(contender.name, self.absent[contender.peer])
            elif seconds.get(contender.name):
                times[contender.name] = median(seconds[contender.name]) / steps * 1e6
                engine = engines[contender.name]
                ran = f"   ({engine})" if contender.options.get("engine") == "auto" else ""
                self._say(contender.name, f"{times[contender.name]:9.3f} µs{ran}")
        return times

    def demand(self, what: str, mine: float | None, theirs: float | None, limit: float) -> None:
        """Print a ratio beside the demanded one."""
        if mine is None or theirs is None:
            self._verdict(what, "not measured", f"≤ {limit:g}", met=False)
        else:
            self._verdict(what, f"{mine / theirs:.3f}", f"≤ {limit:g}", met=mine <= limit * theirs)

    def at_most(self, what: str, value: float | None, limit: float, unit: str = "") -> None:
        """Print a number beside the demanded one."""
        shown = "not measured" if value is None else f"{value:.2f}{unit}"
        good = value is not None and value <= limit
        self._verdict(what, shown, f"≤ {limit:g}{unit}", met=good)

    def fail(self, what: str, reason: str) -> None:
        """Print that something could not be measured at all."""
        self.missed.append(what)
        self._say("failed", reason)

    def _say(self, name: str, what: str) -> None:
        print(f"  {name:52} {what}", flush=True)

    def _verdict(self, what: str, measured: str, demanded: str, *, met: bool) -> None:
        if not met:
            self.missed.append(what)
        verdict = "met" if met else "MISSED"
        print(f"  → {what:50} {measured:>12} {demanded:>10}  {verdict}", flush=True)


def _distance(found: Sequence[float], final: Sequence[float] | None) -> float:
    if final is None:
        return 0.0
    if len(found) != len(final):
        return float("inf")
    size = max(map(abs, final), default=0.0) or 1.0
    return max(abs(a - b) for a, b in zip(found, final, strict=True)) / size


def with_delay(bench: Bench, job: Job) -> None:
    """FMPy's three calls alone are what is demanded against, and are played railcosim's inputs."""
    job = replace(job, work="link")
    first = bench.once(ours("python", trace=True), job)
    played = replace(job, inputs=first["trace"]["link.y"][: job.steps])
    mine = {engine: ours(engine) for engine in ("python", "compiled")}
    alone = Contender("FMPy: setReal, doStep, getReal, nothing else", "fmpy", {"how": "play"})
    others = [
        Contender("FMPy: the same with controller, delay, rows", "fmpy", {"how": "link"}),
        Contender("FMPy: simulate_fmu, the inputs as a signal", "fmpy", {"how": "simulate"}),
        Contender("C: the limit", "c", {"fmu": "train", "outputs": ["speed"]}),
    ]
    times = bench.measure(played, [*mine.values(), alone, *others], first["final"])
    for engine, limit in (("python", 0.45), ("compiled", 0.15)):
        time = times.get(mine[engine].name)
        bench.demand(f"{engine} / FMPy's three calls", time, times.get(alone.name), limit)


def with_pid(bench: Bench, job: Job) -> None:
    """Nothing is demanded here: most of the time is the controller's, on both sides."""
    job = replace(job, work="link", options={"controller": "PID"})
    theirs = Contender("FMPy: a loop with controller, delay, rows", "fmpy", {"how": "link"})
    final = bench.once(ours("python"), job)["final"]
    bench.measure(job, [ours("python"), ours("compiled"), theirs], final)


def two_fmus(bench: Bench, job: Job) -> None:
    """Two coupled masses, nothing kept."""
    job = replace(job, work="masses")
    final = bench.once(ours("auto"), job)["final"]
    alone = Contender("libcosimpy, 0 workers", "libcosimpy", {"workers": 0})
    ecos = Contender("ecospy", "ecospy")
    mine = ours("auto")
    others = [Contender("libcosimpy, its default", "libcosimpy"), Contender("CoFmuPy", "cofmupy")]
    times = bench.measure(job, [mine, ours("python"), alone, *others, ecos], final)
    for peer in (alone, ecos):
        words = f"auto / {peer.name}"
        bench.demand(words, times.get(mine.name), times.get(peer.name), 1.0)


def with_controller(bench: Bench, job: Job) -> None:
    """One FMU, a controller in Python, two signals kept.

    No peer has a delay, so there is none. libcosimpy's loop, Ecos' function on a connection and
    PathSim's block make no step of delay either; CoFmuPy's slave does, as railcosim's Jacobi.
    """
    job = replace(job, work="loop")
    mine = ours("auto")
    peers = [
        Contender("libcosimpy, its default", "libcosimpy"),
        Contender("libcosimpy, 0 workers", "libcosimpy", {"workers": 0}),
        Contender("PathSim", "pathsim"),
    ]
    others = [ours("python"), Contender("ecospy, a function on a connection", "ecospy")]
    times = bench.measure(job, [mine, *others, *peers], bench.once(mine, job)["final"])
    jacobi = ours("auto", algorithm="Jacobi")
    first = bench.once(replace(jacobi, options={**jacobi.options, "trace": True}), job)
    late = replace(job, start=first["trace"]["controller.u"][0])
    cofmupy = Contender("CoFmuPy", "cofmupy")
    times |= bench.measure(late, [jacobi, cofmupy], first["final"])
    for peer in peers:
        words = f"auto / {peer.name}"
        bench.demand(words, times.get(mine.name), times.get(peer.name), 0.1)
    words = "auto, Jacobi / CoFmuPy"
    bench.demand(words, times.get(jacobi.name), times.get(cofmupy.name), 0.1)


def growing(bench: Bench, job: Job) -> None:
    """A row of lags: the cost of one instance must not grow with their number."""
    job = replace(job, work="row")
    for engine in ("python", "compiled"):
        sizes = {
            count: Contender(
                f"railcosim, {engine}, {count} FMU instance{'s' * (count > 1)}",
                "railcosim",
                {"engine": engine, "count": count},
                max(job.steps // count, job.steps // 50, 1),
            )
            for count in (1, 10, 100, 1000)
        }
        times = bench.measure(job, list(sizes.values()), None)
        few, many = (times.get(sizes[count].name) for count in (10, 1000))
        order = log(many / few) / log(1000 / 10) if few and many else None
        bench.at_most(f"{engine}: order of growth, 10 to 1000", order, LINEAR)


def many_outputs(bench: Bench, job: Job) -> None:
    """One FMU with 1000 outputs: what its step costs beyond a loop in C that reads them too."""
    job = replace(job, work="wide", steps=max(job.steps // 10, 200))
    limit = Contender("C: the limit", "c", {"fmu": "wide"})
    final = bench.once(ours("python"), job)["final"]
    engines = [ours("python"), ours("compiled")]
    keeping = [
        replace(ours(engine, keep=True), name=f"railcosim, {engine}, all 1000 kept")
        for engine in ("python", "compiled")
    ]
    times = bench.measure(job, [*engines, *keeping, limit], final)
    for engine in engines:
        both = engine.name in times and limit.name in times
        more = times[engine.name] - times[limit.name] if both else None
        bench.at_most(f"{engine.name}: more than C", more, 2.0, " µs")


SECTIONS: dict[str, Callable[[Bench, Job], None]] = {
    "One FMU, a P controller in Python, 16 steps of delay, 3 signals kept": with_delay,
    "The same with a PID controller": with_pid,
    "Two FMUs, no Python block, nothing kept": two_fmus,
    "One FMU and a P controller in Python, 2 signals kept": with_controller,
    "A row of FMU instances, nothing kept": growing,
    "One FMU with 1000 outputs": many_outputs,
}


def main() -> int:
    """Print everything; return 1 if something is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--turns", type=int, default=5, help="runs of each, of which the median")
    parser.add_argument("--steps", type=int, default=50_000, help="communication steps of a run")
    chosen = parser.parse_args()
    job = Job(work="", fmus=peers_plants.files(), steps=chosen.steps, step=peers_plants.STEP)
    bench = Bench(chosen.turns)
    print(f"µs of CPU time per communication step of {job.step * 1e3:g} ms, set-up excluded;")
    print(f"medians of {chosen.turns} runs of {chosen.steps} steps, in turns")
    for title, section in SECTIONS.items():
        print(f"\n{title}")
        try:
            section(bench, job)
        except FailedError as error:  # railcosim's own first run
            bench.fail(title, str(error))
    print(f"\n{len(bench.missed)} missed" if bench.missed else "\nall met")
    return 1 if bench.missed else 0


if __name__ == "__main__":
    sys.exit(main())
