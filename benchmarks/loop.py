"""One train FMU, a PID and a 16-step delay: railcosim's master against a plain loop on FMPy.

Both do the same work: the same FMU, the same PID step, three signals kept; and end with the same
speed, bit for bit, before any time counts. Run: python benchmarks/loop.py
"""

from collections import deque
from pathlib import Path
from time import process_time

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from railcosim import Delay, Diagram, Fmu, Step
from railcosim.controllers import PID
from railcosim.fmus import build
from railcosim.models import second_order_train

STEPS, H, LINK = 20_000, 0.05, 16
CONTROLLER = PID(kp=4.743, ti=8.94, td=1.972, filter_time=0.294)


def ours(fmu: Path) -> tuple[float, float]:
    """Return (CPU seconds, last speed) of a run with three signals recorded."""
    loop = Diagram("loop", step=H)
    loop.add("target", Step(to=1.0, unit="m/s"))
    loop.add("pid", CONTROLLER)
    loop.add("link", Delay(LINK * H))
    loop.add("train", Fmu(fmu))
    loop.connect("target.y", "pid.reference")
    loop.connect("train.speed", "pid.measurement")
    loop.connect("pid.u", "link.u")
    loop.connect("link.y", "train.u")
    kept = ["pid.u", "link.y", "train.speed"]
    began = process_time()
    run = loop.run(STEPS * H, record=kept, progress=False)
    return process_time() - began, float(run["train.speed"][-1])


def naive(fmu: Path) -> tuple[float, float]:
    """Return (CPU seconds, last speed) of setReal, doStep, getReal in a loop."""
    description = read_model_description(str(fmu))
    assert description.coSimulation is not None
    references = {v.name: v.valueReference for v in description.modelVariables}
    u_reference, v_reference = [references["u"]], [references["speed"]]
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=extract(str(fmu)),
        instanceName="train",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    began = process_time()
    state, link, rows = CONTROLLER.start(), deque([0.0] * LINK), []
    speed = slave.getReal(v_reference)[0]
    for k in range(STEPS):
        u, state = CONTROLLER.step(state, 1.0, speed)
        delayed = link.popleft()
        link.append(u)
        rows.append((u, delayed, speed))
        slave.setReal(u_reference, [delayed])
        slave.doStep(k / 20, H)
        speed = slave.getReal(v_reference)[0]
    spent = process_time() - began
    slave.terminate()
    slave.freeInstance()
    return spent, speed


def main() -> None:
    """Alternate both, five times each, and print medians and the ratio."""
    fmu = build(second_order_train())
    pairs = [(ours(fmu), naive(fmu)) for _ in range(5)]
    if len({speed for pair in pairs for _, speed in pair}) != 1:
        raise SystemExit("the two loops do not end with the same speed")
    mine, theirs = (sorted(pair[i][0] for pair in pairs)[2] / STEPS * 1e6 for i in (0, 1))
    print(f"railcosim   {mine:5.2f} µs per step (everything included: start, FMU, recording)")
    print(f"plain FMPy  {theirs:5.2f} µs per step (the loop alone)")
    print(f"ratio       {mine / theirs:5.2f}")


if __name__ == "__main__":
    main()
