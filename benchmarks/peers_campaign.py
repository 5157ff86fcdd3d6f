"""Contenders of campaign.py that run in railcosim's environment: itself, and loops on FMPy.

Each makes `steps` stops, one after the other, and tells the CPU time of all, set-up of each stop
included, and where the trains came to rest. What is needed once (the FMU unpacked, a first stop)
is not counted.
"""

from collections import deque
from time import process_time
from typing import Any

import numpy as np
from campaign_stop import DELAYS, EVERY, KEPT, STEP, STOP, TICKS, Case, Values, case
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from peers_job import Job, done, job

from railcosim import Constant, Diagram, Fmu


class Naive:
    """The loop that one writes on FMPy: instantiate, then setReal, doStep, getReal at each tick.

    Rings of whole ticks are the delays: one that is off the grid is rounded to it. With `resets`
    one instance is reset for each stop.
    """

    def __init__(self, case: Case, *, resets: bool) -> None:
        self.path, self.start = str(case.fmu), case.start
        self.folder = extract(self.path)
        self.description = read_model_description(self.path)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.controller = case.controller
        self.resets, self.instance = resets, None if not resets else self.made()

    def made(self) -> FMU2Slave:
        assert self.description.coSimulation is not None
        slave = FMU2Slave(
            guid=self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=self.folder,
            instanceName="train",
        )
        slave.instantiate()
        return slave

    def stop(self, values: Values) -> float:
        slave = self.instance or self.made()
        train = {n.partition(".")[2]: v for n, v in values.items() if n.startswith("train.")}
        given = {**self.start, **train}
        slave.setReal([self.references[n] for n in given], list(given.values()))
        slave.setupExperiment(startTime=0.0, stopTime=STOP)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        seen = [self.references[n] for n in ("position", "speed")]
        commands = [self.references[f"{n}_command"] for n in ("electric", "air")]
        rings = [deque([0.0] * round(values[n] / STEP)) for n in DELAYS]
        electric, air = rings
        state, step, command = self.controller.start(), self.controller.step, 0.0
        rows = []
        position, speed = slave.getReal(seen)
        for k in range(TICKS):
            if k % EVERY == 0:
                command, state = step(state, position, speed)
            electric.append(command)
            air.append(command)
            rows.append((position, speed))
            slave.setReal(commands, [electric.popleft(), air.popleft()])
            slave.doStep(k / 100, STEP)
            position, speed = slave.getReal(seen)
        rows.append((position, speed))
        slave.terminate()
        if self.resets:
            slave.reset()
        else:
            slave.freeInstance()
        return np.array(rows)[-1, 0]


class Simulated:
    """FMPy's simulate_fmu: the train alone, to which the commands of such a stop are played.

    It has no delays, and a controller in step_finished would act one step late. The FMU is
    unpacked and described once, and one instance reset for each stop.
    """

    def __init__(self, case: Case) -> None:
        self.path, self.start = str(case.fmu), case.start
        self.folder = extract(self.path)
        self.description = read_model_description(self.path)
        self.instance: Any = instantiate_fmu(self.folder, self.description, "CoSimulation")
        run = case.loop().run(STOP)
        names = ("electric_command", "air_command")
        rows = zip(run.time, run["electric_delay.y"], run["air_delay.y"], strict=True)
        self.signal = np.array(list(rows), dtype=[(n, float) for n in ("time", *names)])

    def stop(self, values: Values) -> float:
        train = {n.partition(".")[2]: v for n, v in values.items() if n.startswith("train.")}
        result: Any = simulate_fmu(
            self.folder,
            fmi_type="CoSimulation",
            stop_time=STOP,
            step_size=STEP,
            output_interval=STEP,
            start_values={**self.start, **train},
            input=self.signal,
            output=["position", "speed"],
            model_description=self.description,
            fmu_instance=self.instance,
            terminate=False,
        )
        self.instance.terminate()
        self.instance.reset()
        return float(result["position"][-1])


class Fresh:
    """Diagram.run, with all made anew for each stop."""

    def __init__(self, case: Case, engine: str) -> None:
        self.loop, self.engine = case.loop(), engine

    def stop(self, values: Values) -> float:
        made = self.loop.with_values(values)
        run = made.run(STOP, record=KEPT, engine=self.engine, progress=False)
        return run["train.position"][-1]


class Kept:
    """Diagram.runner."""

    def __init__(self, case: Case, engine: str) -> None:
        self.runner = case.loop().runner(STOP, record=KEPT, engine=engine)

    def stop(self, values: Values) -> float:
        return self.runner.run(values)["train.position"][-1]


class Alone:
    """The parts that no contender can do without: the train's steps, and the controller's calls."""

    def __init__(self, case: Case) -> None:
        made = Diagram("alone", step=STEP)
        made.add("train", Fmu.with_values(case.fmu, case.start))
        made.add("command", Constant(-0.7, unit="m/s2"))
        for name in ("electric", "air"):
            made.connect("command.y", f"train.{name}_command")
        self.runner = made.runner(STOP, record=[], engine="compiled")
        self.controller = case.controller

    def stop(self, values: Values) -> float:
        self.runner.run()
        state, step = self.controller.start(), self.controller.step
        for k in range(TICKS // EVERY):
            _, state = step(state, -160.0 + k, 14.0 - 0.1 * k)
        return 0.0


def contender(options: dict[str, Any]) -> Any:
    """Return what makes the stops."""
    work, how = case(options["case"]), options["how"]
    if how in ("naive", "naive, reset"):
        return Naive(work, resets=how != "naive")
    if how in ("simulate", "alone"):
        return {"simulate": Simulated, "alone": Alone}[how](work)
    return {"run": Fresh, "runner": Kept}[how](work, options["engine"])


def main(work: Job) -> None:
    """Make the stops and tell of them."""
    values = case(work.options["case"]).draws(work.steps, on_grid=work.options["on_grid"])
    made = contender(work.options)
    made.stop(values[0])
    began = process_time()
    final = [float(made.stop(one)) for one in values]
    done(process_time() - began, final)


if __name__ == "__main__":
    main(job())
