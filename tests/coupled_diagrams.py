"""Diagrams for the tests of the master: short wiring, and one diagram with everything in it.

Run as a program it is the other process of those tests: `python -m tests.coupled_diagrams FILE`,
where FILE is JSON made by `elsewhere`.
"""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Gain,
    Hold,
    Noise,
    Pulse,
    Ramp,
    Run,
    Saturation,
    Step,
    Sum,
)
from railcosim.controllers import PID
from railcosim.cosim import algorithms
from railcosim.cosim.algorithms import (
    FixedPoint,
    GaussSeidel,
    Iterated,
    Jacobi,
    Newton,
    StepDoubling,
    TwoPhase,
)
from railcosim.cosim.blocks.variable_delay import VariableDelay
from railcosim.cosim.checkpoint import Checkpoint
from railcosim.fmus import build
from tests import coupled_plants, plants

ROOT = Path(__file__).parents[1]

ALGORITHMS = (
    TwoPhase(),
    TwoPhase(extrapolation=1),
    Jacobi(),
    Jacobi(extrapolation=1),
    GaussSeidel(),
    GaussSeidel(extrapolation=1),
    GaussSeidel(order=("lag", "two", "one"), extrapolation=1),
    Iterated(),
    Iterated(extrapolation=1),
    Iterated(solver=FixedPoint(relaxation=0.5, tolerance=1e-9), extrapolation=1),
    StepDoubling(tolerance=1e-2),
    StepDoubling(inner=TwoPhase(), tolerance=3e-2),
    StepDoubling(inner=Iterated(solver=Newton(), extrapolation=1), tolerance=1e-2),
)


def names(value: Any) -> str:
    """Return a short name of an algorithm, for a test's id."""
    if not hasattr(value, "extrapolation"):
        return str(value)
    inner = names(value.inner) if hasattr(value, "inner") else ""
    order = "-".join(getattr(value, "order", None) or ())
    solver = type(value.solver).__name__ if hasattr(value, "solver") else ""
    return f"{type(value).__name__}{inner}{solver}{order}{value.extrapolation}"


def wired(diagram: Diagram, blocks: Mapping[str, Block], *wires: str) -> Diagram:
    """Add blocks, and connect along each wire: "a.y b.u c.u" takes a.y to both."""
    for name, block in blocks.items():
        diagram.add(name, block)
    for wire in wires:
        source, *targets = wire.split()
        for target in targets:
            diagram.connect(source, target)
    return diagram


def oscillator(step: float, **options: Any) -> Diagram:
    """Two masses coupled by a spring, of which the second gives the force, with feedthrough."""
    blocks = {
        "one": Fmu(build(coupled_plants.driven_mass()), x=1.0, **options),
        "two": Fmu(build(coupled_plants.sprung_mass()), **options),
    }
    wires = ("one.x two.far", "one.v two.far_speed", "two.force one.force")
    return wired(Diagram("oscillator", step=step), blocks, *wires)


def everything(*, isolated: bool = False) -> Diagram:
    """FMUs that drive each other, one behind them that is slower, a sampled controller, noise,
    delays of all kinds, and jumps between the steps.
    """
    blocks = {
        "one": Fmu(build(coupled_plants.driven_mass()), x=1.0, isolated=isolated),
        "two": Fmu(build(coupled_plants.sprung_mass()), ck=20.0, isolated=isolated),
        "lag": Fmu(build(plants.passing("passing")), isolated=isolated),
        "slow": Fmu(build(plants.integrator(start=0.5)), period=0.04, isolated=isolated),
        "kick": Step(at=0.1234, to=2.0, unit="N"),
        "tap": Pulse(at=0.3017, width=0.0021, height=30.0, unit="N"),
        "drift": Ramp(slope=0.5, at=0.2, unit="N"),
        "noise": Noise(seed=7, deviation=0.3, unit="N", period=0.03),
        "sum": Sum("++++++"),
        "late": Delay(0.0263, interpolation="hold"),
        "line": Delay(0.05, initial=0.1),
        "short": Delay(0.004),
        "pid": PID(kp=2.0, ti=0.5, td=0.02, limits=(-5.0, 5.0), period=0.02),
        "goal": Constant(0.4, unit="m/s"),
        "force": Gain(1.0, input_unit="1", unit="N"),
        "clip": Saturation((-0.7, 0.7)),
        "flow": Gain(1.0, input_unit="m", unit="1/s"),
        "speed": Gain(0.3, input_unit="m/s", unit="1"),
        "kept": Hold(0.05),
        "winding": Sum("++"),
        "lead": Constant(0.03, unit="s"),
        "spread": Gain(0.01, input_unit="m", unit="s"),
        "variable": VariableDelay(maximum=0.2, initial=0.2),
    }
    wires = (
        "one.x two.far line.u flow.u spread.u variable.u",
        "one.v two.far_speed pid.measurement speed.u",
        "two.force sum.u1", "kick.y sum.u2", "tap.y sum.u3", "drift.y sum.u4", "noise.y sum.u5",
        "goal.y pid.reference", "pid.u late.u", "late.y force.u", "force.y sum.u6",
        "sum.y one.force", "speed.y short.u", "short.y clip.u", "clip.y lag.u",
        "flow.y slow.u", "lag.y kept.u",
        "lead.y winding.u1", "spread.y winding.u2", "winding.y variable.delay",
    )  # fmt: skip
    return wired(Diagram("everything", step=0.01), blocks, *wires)


def random_walk() -> Diagram:
    """Python blocks and noise alone, with an algebraic loop."""
    blocks = {
        "noise": Noise(seed=3),
        "sum": Sum("++-"),
        "half": Gain(0.5),
        "link": Delay(0.03, interpolation="hold"),
        "clip": Saturation((-3.0, 3.0)),
    }
    wires = (
        "noise.y sum.u1",
        "sum.y half.u link.u",
        "half.y sum.u3",
        "link.y clip.u",
        "clip.y sum.u2",
    )
    return wired(Diagram("walk", step=0.01), blocks, *wires)


DIAGRAMS = {"everything": everything, "oscillator": oscillator, "random_walk": random_walk}


def same(first: Run, second: Run) -> bool:
    """Return whether two runs are the same to the last bit."""
    a, b = first.frame, second.frame
    return (
        list(a.columns) == list(b.columns)
        and a.index.to_numpy().tobytes() == b.index.to_numpy().tobytes()
        and all(a[name].to_numpy().tobytes() == b[name].to_numpy().tobytes() for name in a)
    )


# In another process


def elsewhere(folder: Path, jobs: Sequence[Mapping[str, Any]]) -> list[Run]:
    """Run jobs one after the other in another process and return what they recorded.

    A job has the arguments of Diagram.run, `diagram` (a name in DIAGRAMS), `algorithm` as text,
    and may have `resume`, a checkpoint's path, and `isolated`.
    """
    paths = [folder / f"job{n}.parquet" for n in range(len(jobs))]
    file = folder / "jobs.json"
    file.write_text(
        json.dumps([{**job, "out": str(path)} for job, path in zip(jobs, paths, strict=True)])
    )
    command = [sys.executable, "-m", "tests.coupled_diagrams", str(file)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return [Run.load(path) for path in paths]


def _work(file: Path) -> None:
    for job in json.loads(file.read_text()):
        options = {"isolated": True} if job.pop("isolated", False) else {}
        arguments = {"step": job.pop("step")} if "step" in job else {}
        diagram = DIAGRAMS[job.pop("diagram")](**arguments, **options)
        out = Path(job.pop("out"))
        job["algorithm"] = eval(job["algorithm"], dict(vars(algorithms)))
        if "resume" in job:
            job["resume"] = Checkpoint.load(Path(job["resume"]))
        diagram.run(job.pop("stop"), **job).save(out)


def array(run: Run) -> np.ndarray:
    """Return a run's numbers, a row for each time."""
    return run.frame.to_numpy(dtype=float)


if __name__ == "__main__":
    _work(Path(sys.argv[1]))
