"""ecospy: Ecos, a co-simulation engine in C++, from Python.

It steps all FMUs in parallel and then carries their outputs over. A controller in Python can only
be a function on a connection, of one value: so it sits between the train's speed and its input.
The first control, at the start, is made by it too. Its library needs libtbb, which the package does
not bring: install tbb beside it and put the environment's lib folder in LD_LIBRARY_PATH.
"""

from time import process_time
from typing import Any

from ecospy import (  # pyright: ignore[reportMissingImports]
    EcosLib,
    EcosSimulation,
    EcosSimulationStructure,
)
from peers_job import Job, done, job


def simulation(structure: Any, work: Job) -> Any:
    made = EcosSimulation(structure=structure, step_size=work.step)
    made.init()
    return made


def masses(work: Job) -> None:
    structure = EcosSimulationStructure()
    for name in ("left", "right"):
        structure.add_model(name, work.fmus[name])
    for a, b in (("left", "right"), ("right", "left")):
        for port in ("position", "speed"):
            structure.make_real_connection(f"{a}::{port}", f"{b}::other_{port}")
    run = simulation(structure, work)
    began = process_time()
    run.step(work.steps)
    spent = process_time() - began
    ports = ("left::position", "left::speed", "right::position", "right::speed")
    done(spent, [run.get_real(port) for port in ports])


def loop(work: Job) -> None:
    gain, reference, rows = work.gain, work.reference, []

    def control(speed: float) -> float:
        u = gain * (reference - speed)
        rows.append((u, speed))
        return u

    structure = EcosSimulationStructure()
    structure.add_model("train", work.fmus["train"])
    structure.make_real_connection("train::speed", "train::u", control)
    run = simulation(structure, work)
    began = process_time()
    run.step(work.steps)
    spent = process_time() - began
    done(spent, [run.get_real("train::speed")], calls=len(rows))


if __name__ == "__main__":
    EcosLib.set_log_level("warn")
    given = job()
    {"masses": masses, "loop": loop}[given.work](given)
