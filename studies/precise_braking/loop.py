"""The loop: a controller, two transmission delays, the train, and what it measures of itself."""

from functools import cache
from pathlib import Path
from typing import Any

from ...cosim import Delay, Diagram, Fmu
from ...cosim.block import Block
from ...fmus import build
from ...models import metro_train
from .truth import PLATFORM, Truth

STEP = 0.01  # s, the base step
PERIOD = 0.2  # s, of the control; the paper's T_d
START = -235.0  # m, where a stop begins; the target curve brakes from 149.8 m before its aim
STRETCHES = 2  # of gradient: approach and platform


@cache
def metro_fmu(*, probe: bool = False) -> Path:
    """Return the FMU of the metro train with two stretches of gradient, built if need be.

    With `probe` its air brake can be tried out.
    """
    return build(metro_train(gradients=STRETCHES, probe=probe))


def braking_loop(
    truth: Truth, controller: Block, odometry: Block, *, start: float, step: float = STEP
) -> Diagram:
    """Return a train that a controller brings to a stop at position 0.

    The train starts at `start` (m, negative), cruising. The controller has the inputs `position`
    and `speed` (measured) and the output `command` (m/s²); the odometry measures the true ones.
    The command reaches the motors after T1 and the air brake after T3. So does what a controller
    with the output `probe` (m/s²) demands of the air brake before its time.
    """
    probes = "probe" in controller.outputs
    loop = Diagram("metro_stop", step=step)
    loop.add("odometry", odometry)
    loop.add("controller", controller)
    for name in ("electric_delay", "air_delay"):
        loop.add(name, Delay(1.0, interpolation="hold"))
    line: dict[str, Any] = {"gradient_position[1]": -1e4, "gradient_position[2]": -PLATFORM}
    loop.add("train", Fmu(metro_fmu(probe=probes), **line))
    for name in ("position", "speed"):
        loop.connect(f"train.{name}", f"odometry.{name}")
        loop.connect(f"odometry.{name}", f"controller.{name}")
    for name in ("electric", "air"):
        loop.connect("controller.command", f"{name}_delay.u")
        loop.connect(f"{name}_delay.y", f"train.{name}_command")
    if probes:
        loop.add("probe_delay", Delay(1.0, interpolation="hold"))
        loop.connect("controller.probe", "probe_delay.u")
        loop.connect("probe_delay.y", "train.air_probe")
    return loop.with_values(truth.values(start, probes=probes))
