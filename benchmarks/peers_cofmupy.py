"""CoFmuPy: a master in Python on FMPy, Jacobi, with Python slaves; it keeps every output.

It exchanges nothing before the first step: what the first inputs are must be given. A slave's
output at t_{k+1} comes from its inputs at t_k: one more step of delay than railcosim's TwoPhase,
the same as its Jacobi.
"""

from time import process_time
from typing import Any

from cofmupy import Coordinator  # pyright: ignore[reportMissingImports]
from cofmupy.utils.proxy import FmuProxy, Variable  # pyright: ignore[reportMissingImports]
from peers_job import Job, done, job


class Controller(FmuProxy):
    """u = gain · (reference − speed); CoFmuPy finds the class in this file."""

    model_identifier = "Controller"

    def __init__(self) -> None:
        super().__init__()
        self.gain, self.reference = 0.0, 0.0
        self.speed, self.u = 0.0, 0.0
        for name, causality in (
            ("gain", "parameter"),
            ("reference", "parameter"),
            ("speed", "input"),
            ("u", "output"),
        ):
            self.register_variable(Variable(name, causality=causality))

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.u = self.gain * (self.reference - self.speed)
        return True


def run(work: Job, slaves: dict[str, tuple[str, dict[str, float]]], links: list[str]) -> Any:
    """Step the slaves, (path, start values) by name, along "a.y > b.u"; return (s, master)."""
    ends = [[end.strip().split(".") for end in link.split(">")] for link in links]
    configuration = {
        "fmus": [
            {"id": name, "name": name, "path": path, "initialization": values}
            for name, (path, values) in slaves.items()
        ],
        "connections": [
            {"source": {"id": a, "variable": y}, "target": {"id": b, "variable": u}}
            for (a, y), (b, u) in ends
        ],
        "cosim_method": "jacobi",
        "iterative": False,
    }
    coordinator = Coordinator()
    coordinator.start(configuration)
    began = process_time()
    for _ in range(work.steps):
        coordinator.do_step(work.step)
    return process_time() - began, coordinator.get_results()


def masses(work: Job) -> None:
    slaves = {
        "left": (work.fmus["left"], {"other_position": 0.0, "other_speed": 0.0}),
        "right": (work.fmus["right"], {"other_position": 1.0, "other_speed": 0.0}),
    }
    links = [
        f"{a}.{port} > {b}.other_{port}"
        for a, b in (("left", "right"), ("right", "left"))
        for port in ("position", "speed")
    ]
    spent, results = run(work, slaves, links)
    done(spent, [results[a, y][-1] for a in ("left", "right") for y in ("position", "speed")])


def loop(work: Job) -> None:
    values = {"gain": work.gain, "reference": work.reference, "speed": 0.0}
    slaves = {
        "controller": (f"{__file__}::Controller", values),
        "train": (work.fmus["train"], {"u": work.start}),
    }
    links = ["controller.u > train.u", "train.speed > controller.speed"]
    spent, results = run(work, slaves, links)
    done(spent, [results["train", "speed"][-1]])


if __name__ == "__main__":
    given = job()
    {"masses": masses, "loop": loop}[given.work](given)
