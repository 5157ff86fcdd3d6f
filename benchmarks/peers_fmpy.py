"""FMPy: a loop of its calls, alone or with all that railcosim does; and its simulate_fmu."""

from collections import deque
from time import process_time
from typing import Any

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from peers_job import Job, done, job


def instance(path: str) -> tuple[FMU2Slave, dict[str, int]]:
    """Return an initialised instance, and the value references by name."""
    description = read_model_description(path)
    assert description.coSimulation is not None
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=extract(path),
        instanceName="fmu",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def play(work: Job) -> None:
    """setReal, doStep, getReal and nothing else: the inputs are those of railcosim's run."""
    slave, references = instance(work.fmus["train"])
    control, speeds = [references["u"]], [references["speed"]]
    h, t, speed = work.step, 0.0, 0.0
    began = process_time()
    for u in work.inputs:
        slave.setReal(control, [u])
        slave.doStep(t, h)
        speed = slave.getReal(speeds)[0]
        t += h
    done(process_time() - began, [speed])


def link(work: Job) -> None:
    """Do what railcosim does: the controller, the delay, and rows of three signals."""
    from peers_railcosim import DELAY, pid

    slave, references = instance(work.fmus["train"])
    control, speeds = [references["u"]], [references["speed"]]
    h, gain, reference = work.step, work.gain, work.reference
    delay, rows = deque([0.0] * DELAY), []
    speed = slave.getReal(speeds)[0]
    if work.options.get("controller") == "PID":
        controller = pid(h)
        state, step = controller.start(), controller.step
        began = process_time()
        for k in range(work.steps):
            u, state = step(state, reference, speed)
            delayed = delay.popleft()
            delay.append(u)
            rows.append((u, delayed, speed))
            slave.setReal(control, [delayed])
            slave.doStep(k * h, h)
            speed = slave.getReal(speeds)[0]
    else:
        began = process_time()
        for k in range(work.steps):
            u = gain * (reference - speed)
            delayed = delay.popleft()
            delay.append(u)
            rows.append((u, delayed, speed))
            slave.setReal(control, [delayed])
            slave.doStep(k * h, h)
            speed = slave.getReal(speeds)[0]
    done(process_time() - began, [speed])


def simulate(work: Job) -> None:
    """simulate_fmu with the inputs as a signal; timed from the first step's end."""
    h = work.step
    rows = [(k * h, u) for k, u in enumerate(work.inputs)]
    signal = np.array(rows, dtype=[("time", float), ("u", float)])
    times = []

    def finished(time: float, recorder: Any) -> bool:
        if len(times) < 2:
            times.append(process_time())
        return True

    result: Any = simulate_fmu(
        work.fmus["train"],
        fmi_type="CoSimulation",
        stop_time=work.steps * h,
        step_size=h,
        output_interval=h,
        input=signal,
        output=["speed"],
        step_finished=finished,
    )
    spent = process_time() - times[0]
    done(spent * work.steps / (work.steps - 1), [float(result["speed"][-1])])


if __name__ == "__main__":
    given = job()
    {"play": play, "link": link, "simulate": simulate}[given.options["how"]](given)
