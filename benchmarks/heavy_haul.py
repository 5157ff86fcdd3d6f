"""The heavy-haul train as an FMU: against C by hand, against real time, and with its controller.

A ratio to the loop of heavy_haul.c counts only if the FMU's outputs are the loop's, to 1e-6 of each
one's largest value, all along a run that pulls, brakes with air, stands and starts violently. Times
are processor times, the least of several turns in which the contenders follow one another; the
export's is that of the clock. All in one run on one machine: trust the ratios. Run:
python benchmarks/heavy_haul.py
"""

import argparse
import os
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, process_time
from unittest.mock import patch

import numpy as np
from heavy_haul_contenders import INNER, LENGTH, ByHand, H, Instance, Run, diagram, plant

from railcosim import Diagram, Fmu
from railcosim.base.cache import VARIABLE
from railcosim.base.compilers import native_compiler
from railcosim.base.errors import BuildError
from railcosim.controllers import FuzzyPID
from railcosim.fmus import build, export
from railcosim.studies.heavy_haul.targets import target

PAPER = 102  # vehicles
SIZES = (100, PAPER, 300, 1000)
AGREE = 1e-6  # of the largest value of an output
ROUND_OFF = {"energy.residual": "energy.kinetic"}  # its size is that of what it is a difference of
COUNTS = ("coupler_maximum_at", "coupler_minimum_at", "standing")  # may change a row later


@dataclass
class Report:
    """Prints rows with what is demanded of them, and remembers the misses."""

    missed: list[str] = field(default_factory=list)

    def row(
        self, name: str, value: float, unit: str, limit: float = 0.0, *, least: bool = False
    ) -> None:
        line = f"  {name:48} {value:9.2f} {unit}"
        if limit:
            good = value >= limit if least else value <= limit
            line += f"   {'≥' if least else '≤'} {limit:g}  {'met' if good else 'MISSED'}"
            self.missed += [] if good else [name]
        print(line, flush=True)


def least(runs: dict[str, Run], turns: int) -> dict[str, float]:
    """Return each run's least seconds, in turns."""
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(turns):
        for name, run in runs.items():
            best[name] = min(best[name], run()[0])
    return best


def check(hand: ByHand, fmu: Instance, length: float) -> None:
    """Stop if the FMU's outputs are not those of the loop by hand."""
    ours = hand.run(length, H)()[1]
    theirs = fmu.from_c(hand.functions, length, H)()[1]
    values = {n: (ours[:, at], theirs[:, fmu.columns(n)]) for n, at in hand.places.items()}
    worst = 0.0
    for name, (a, b) in values.items():
        if name in COUNTS and float(np.mean(a != b)) < 0.01:
            continue
        size = max(float(np.abs(values[ROUND_OFF.get(name, name)][0]).max()), 1e-3)
        error = float(np.abs(a - b).max()) / size
        worst = max(worst, error)
        if not error <= AGREE:
            raise SystemExit(f"{hand.size} vehicles: {name} differs by {error:.1e} of {size:g}")
    forces = values["coupler[].force"][0]
    print(f"  {hand.size} vehicles, {length:g} s: outputs agree to {worst:.0e}; coupler forces "
          f"from {forces.min() / 1e3:.0f} to {forces.max() / 1e3:.0f} kN")  # fmt: skip


def inner_steps(report: Report, compiler: str, turns: int) -> None:
    """Print inner steps against the loop by hand, and what a vehicle costs."""
    each: dict[int, float] = {}
    with tempfile.TemporaryDirectory() as name:
        for size in SIZES:
            hand = ByHand(size, compiler, Path(name))
            fmu = Instance(build(plant(size), compiler=compiler), Path(name))
            check(hand, fmu, LENGTH)
            length = min(LENGTH, 6000.0 / size)
            runs = {
                "hand": hand.run(length, H),
                "fmu": fmu.from_c(hand.functions, length, H),
                "hand 2 ms": hand.run(length / 2, 0.002),
                "fmu 2 ms": fmu.from_c(hand.functions, length / 2, 0.002),
            }
            best = least(runs, turns)
            each[size] = best["fmu"] / length * INNER / size
            told = f"{size} vehicles"
            report.row(f"{told}: FMU, inner step", each[size] * size * 1e6, "µs")
            limit = 1.15 if size == PAPER else 0.0
            often = best["fmu 2 ms"] / best["hand 2 ms"]
            report.row(f"{told}: over by hand, every 0.1 s", best["fmu"] / best["hand"], "", limit)
            report.row(f"{told}: over by hand, every 2 ms", often, "")
            if size == max(SIZES):
                report.row(f"{told}: times real time", length / best["fmu"], "", 3.0, least=True)
    for size, cost in each.items():
        limit = 1.25 if size > PAPER else 0.0
        report.row(f"a vehicle of {size} over one of 100", cost / each[100], "", limit)


def controlled() -> Diagram:
    """Return the start-up with coupler 2 under fuzzy adaptive PID control, exactly inferred."""
    made = Diagram("start_up", step=0.002)
    start = {"gradient[1]": 6.0, "group[1].reduction": 0.0}
    made.add("train", Fmu.with_values(build(plant(PAPER)), start))
    made.add("target", target("start_up_force"))
    made.add("controller", FuzzyPID(inference="exact"))
    made.connect("target.y", "controller.reference")
    made.connect("train.coupler[2].force", "controller.measurement")
    for name in ("upper", "lower"):
        made.connect(f"train.group[1].{name}", f"controller.{name}")
    made.connect("controller.force", "train.group[1].force")
    return made


def timed(made: Diagram, stop: float, record: list[str], turns: int) -> float:
    """Return how many times as fast as real time a `Runner` is."""
    best = float("inf")
    with made.runner(stop, record=record) as runner:
        for _ in range(turns):
            began = process_time()
            runner.run()
            best = min(best, process_time() - began)
    return stop / best


def real_time(report: Report, turns: int) -> None:
    """Print real-time factors of the paper's train."""
    record = ["train.speed", "train.coupler_maximum", "train.coupler_minimum"]
    with tempfile.TemporaryDirectory() as name:
        fmu = Instance(build(plant(PAPER)), Path(name))
        for step in (0.01, 0.002):
            length = LENGTH / 2
            best = least({"fmpy": fmu.from_python(length, step)}, turns)["fmpy"]
            told = f"every {step * 1e3:g} ms, times real time"
            report.row(f"fmpy's doStep, all outputs read {told}", length / best, "")
            report.row(f"Runner {told}", timed(diagram(step), length, record, turns), "")
    record = ["train.coupler[2].force", "controller.force"]
    factor = timed(controlled(), 20.0, record, turns)
    report.row("with exact fuzzy PID every 2 ms", factor, "", 10.0, least=True)


def exports(report: Report) -> None:
    """Print how long the export of 1000 vehicles takes; only zig's own runtime is there already."""
    with tempfile.TemporaryDirectory() as name:
        export(plant(2), Path(name, "first.fmu"))
        for size in (PAPER, 1000):
            path = Path(name, f"train{size}.fmu")
            began = perf_counter()
            export(plant(size), path)
            spent = perf_counter() - began
            report.row(f"export of {size} vehicles", spent, "s", 10.0 if size == 1000 else 0.0)
            report.row(f"its size, {size} vehicles", path.stat().st_size / 1e6, "MB")


def main() -> int:
    """Print everything; return 1 if something is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--turns", type=int, default=9, help="runs of each, of which the least")
    turns = parser.parse_args().turns
    report = Report()
    for compiler in ("system", "zig"):
        try:
            print(f"\n{native_compiler(compiler).identity}")
        except BuildError:
            continue
        inner_steps(report, compiler, turns)
    print(f"\n{PAPER} vehicles, inner step {INNER * 1e3:g} ms")
    real_time(report, max(turns // 3, 1))
    print("\nexport, by the clock")
    with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {VARIABLE: folder}):
        exports(report)
    print(f"\n{len(report.missed)} missed" if report.missed else "\nall met")
    return 1 if report.missed else 0


if __name__ == "__main__":
    sys.exit(main())
