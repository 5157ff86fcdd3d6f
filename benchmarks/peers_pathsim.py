"""PathSim with pathsim-fmi's co-simulation block, which steps its FMU at a scheduled event.

The event at t already makes the step from t to t + h: a run to t_{n−1} makes n of them. Its other
blocks are evaluated in between, so that a controller is no step late.
"""

from time import process_time

from campaign_law import law
from pathsim import Connection, Simulation  # pyright: ignore[reportMissingImports]
from pathsim.blocks import (  # pyright: ignore[reportMissingImports]
    Delay,
    Function,
    Scope,
    ZeroOrderHold,
)
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


def stop(work: Job) -> None:
    """Make a stop of campaign.py: the controller sampled and held, delays in whole steps.

    Every stop makes all anew: the block takes an FMU's parameters when it is made.
    """
    options = work.options
    values = options["values"]
    drawn = {n.partition(".")[2]: v for n, v in values.items() if n.startswith("train.")}
    delays = [values[f"{name}_delay.time"] for name in ("electric", "air")]
    final = []
    began = process_time()
    for _ in range(work.steps):
        start = {**options["start"], **drawn}
        train = CoSimulationFMU(work.fmus["train"], dt=work.step, start_values=start)
        controller = Function(law)
        hold = ZeroOrderHold(T=0.2)
        electric, air = (Delay(tau, sampling_period=work.step) for tau in delays)
        scope = Scope(labels=["position", "speed"])
        run = Simulation(
            [train, controller, hold, electric, air, scope],
            [
                Connection(train["position"], controller[0], scope[0]),
                Connection(train["speed"], controller[1], scope[1]),
                Connection(controller, hold),
                Connection(hold, electric, air),
                Connection(electric, train["electric_command"]),
                Connection(air, train["air_command"]),
            ],
            dt=work.step,
            log=False,
        )
        run.run(25.0 - work.step)
        final.append(float(train.outputs[0]))
    done(process_time() - began, final)


if __name__ == "__main__":
    given = job()
    {"loop": loop, "stop": stop}[given.work](given)
