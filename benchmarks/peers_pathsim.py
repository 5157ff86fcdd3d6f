"""PathSim with pathsim-fmi's co-simulation block, which steps its FMU at a scheduled event.

The event at t already makes the step from t to t + h: a run to t_{n−1} makes n of them. Its other
blocks are evaluated in between, so that a controller is no step late.
"""

from time import process_time

from pathsim import Connection, Simulation  # pyright: ignore[reportMissingImports]
from pathsim.blocks import Function, Scope  # pyright: ignore[reportMissingImports]
from pathsim_fmi import CoSimulationFMU  # pyright: ignore[reportMissingImports]
from peers_job import Job, done, job


def loop(work: Job) -> None:
    gain, reference = work.gain, work.reference
    train = CoSimulationFMU(work.fmus["train"], dt=work.step)
    controller = Function(lambda speed: gain * (reference - speed))
    scope = Scope(labels=["u", "speed"])
    run = Simulation(
        [train, controller, scope],
        [
            Connection(train["speed"], controller, scope[1]),
            Connection(controller, train["u"], scope[0]),
        ],
        dt=work.step,
        log=False,
    )
    began = process_time()
    run.run((work.steps - 1) * work.step)
    spent = process_time() - began
    done(spent, [float(train.outputs["speed"])], steps=len(train.events[0]))


if __name__ == "__main__":
    given = job()
    {"loop": loop}[given.work](given)
