"""railcosim itself, in the environment that master.py runs in."""

from dataclasses import dataclass
from time import process_time
from typing import Any

from peers_job import Job, done, job

from railcosim import Block, Constant, Delay, Diagram, Fmu, Jacobi, Step, TwoPhase
from railcosim.controllers import PID

DELAY = 16  # steps
ALGORITHMS = {"TwoPhase": TwoPhase(), "Jacobi": Jacobi()}
MASSES = ["left.position", "left.speed", "right.position", "right.speed"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Proportional(Block):
    """u = gain · (reference − speed)."""

    gain: float
    reference: float
    inputs = {"speed": "m/s"}
    outputs = {"u": "1"}

    def step(self, x: Any, speed: float) -> tuple[float, Any]:
        return self.gain * (self.reference - speed), x


def pid(step: float) -> PID:
    """Return the PID that both sides of the comparison with PID use."""
    return PID(kp=4.743, ti=8.94, td=1.972, filter_time=0.294, period=step)


def loop(work: Job) -> tuple[Diagram, list[str], list[str]]:
    """Return a diagram, the signals to keep and those of the final state."""
    made = Diagram("loop", step=work.step)
    made.add("train", Fmu(work.fmus["train"]))
    if work.options.get("controller") == "PID":
        made.add("target", Step(to=work.reference, unit="m/s"))
        made.add("controller", pid(work.step))
        made.connect("target.y", "controller.reference")
        made.connect("train.speed", "controller.measurement")
    else:
        made.add("controller", Proportional(gain=work.gain, reference=work.reference))
        made.connect("train.speed", "controller.speed")
    if work.work == "loop":
        made.connect("controller.u", "train.u")
        return made, ["controller.u", "train.speed"], ["train.speed"]
    made.add("link", Delay(DELAY * work.step))
    made.connect("controller.u", "link.u")
    made.connect("link.y", "train.u")
    return made, ["controller.u", "link.y", "train.speed"], ["train.speed"]


def masses(work: Job) -> tuple[Diagram, list[str], list[str]]:
    made = Diagram("masses", step=work.step)
    for name in ("left", "right"):
        made.add(name, Fmu(work.fmus[name]))
    for a, b in (("left", "right"), ("right", "left")):
        for port in ("position", "speed"):
            made.connect(f"{a}.{port}", f"{b}.other_{port}")
    return made, [], MASSES


def row(work: Job) -> tuple[Diagram, list[str], list[str]]:
    made = Diagram("row", step=work.step)
    lag, count = Fmu(work.fmus["lag"]), work.options["count"]
    made.add("source", Constant(0.0))
    before = "source.y"
    for i in range(count):
        made.add(f"lag{i}", lag)
        made.connect(before, f"lag{i}.u")
        before = f"lag{i}.y"
    return made, [], [before]


def wide(work: Job) -> tuple[Diagram, list[str], list[str]]:
    made = Diagram("wide", step=work.step)
    made.add("source", Constant(work.reference))
    made.add("plant", Fmu(work.fmus["wide"]))
    made.connect("source.y", "plant.u")
    outputs = [f"plant.{name}" for name in made.block("plant").outputs]
    return made, outputs if work.options.get("keep") else [], outputs


WORKS = {"loop": loop, "link": loop, "masses": masses, "row": row, "wide": wide}


if __name__ == "__main__":
    given = job()
    diagram, record, final = WORKS[given.work](given)
    with diagram.simulation(
        record=record,
        engine=given.options["engine"],
        algorithm=ALGORITHMS[given.options.get("algorithm", "TwoPhase")],
    ) as simulation:
        began = process_time()
        simulation.advance(given.steps * diagram.step)
        spent = process_time() - began
        values = [float(simulation[name]) for name in final]
        run = simulation.result()
    wanted = given.options["engine"]
    if wanted not in ("auto", run.engine):
        raise SystemExit(f"ran with the {run.engine} engine: {run.info['engine_reason']}")
    trace = {name: run[name].tolist() for name in record} if given.options.get("trace") else {}
    done(spent, values, trace=trace, engine=run.engine)
