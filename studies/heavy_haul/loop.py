"""The loop: a target, a controller, the train, and what may lie between them."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from ...controllers import SamplePID
from ...cosim import Block, Constant, Diagram, Fmu, Gain, Lag, Noise, Sum
from ...cosim.blocks.source import Source
from ...fmus import build
from ...models.consist import Consist, coal_train
from ...models.heavy_haul import Hysteresis, heavy_haul_train
from .controllers import SAMPLE

RELEASED = Constant(0.0, unit="kPa")
COUPLER = 2  # behind the second locomotive; our choice


def train_fmu(
    consist: Consist | None = None, *, hysteresis: Hysteresis = "incremental", gradients: int = 1
) -> Path:
    """Return the train's FMU, built if need be; without a consist it is the paper's."""
    return _built(coal_train() if consist is None else consist, hysteresis, gradients)


@cache
def _built(consist: Consist, hysteresis: Hysteresis, gradients: int) -> Path:
    return build(heavy_haul_train(consist, hysteresis=hysteresis, gradients=gradients))


@dataclass(frozen=True, kw_only=True)
class Loop:
    """What is tracked (`measured`: a port of the train), and on which train.

    `lag` (s) is that of the locomotives' force, `noise` (N) the deviation of the measurement's
    noise; 0 leaves them out. `seed` is the noise's.
    """

    name: str
    target: Source
    values: tuple[tuple[str, float], ...] = ()
    measured: str = f"coupler[{COUPLER}].force"
    reduction: Block = RELEASED
    lag: float = 0.0
    noise: float = 0.0
    seed: int = 1
    step: float = SAMPLE

    def with_disturbance(self, suffix: str, *, lag: float = 0.0, noise: float = 0.0) -> "Loop":
        """Return the loop with a lag (s) or a noise (N)."""
        return replace(self, name=f"{self.name}_{suffix}", lag=lag, noise=noise)

    def diagram(self, controller: SamplePID) -> Diagram:
        """Return the diagram with a controller."""
        loop = Diagram(self.name, step=self.step)
        loop.add("target", self.target)
        loop.add("controller", controller)
        loop.add("train", Fmu.with_values(train_fmu(), dict(self.values)))
        loop.add("reduction", self.reduction)
        loop.connect("target.y", "controller.reference")
        loop.connect("reduction.y", "train.group[1].reduction")
        for port in ("upper", "lower"):
            loop.connect(f"train.group[1].{port}", f"controller.{port}")
        if controller.feed_forward:
            # Quasi-static: the coupler's force is to the locomotives' as the mass behind to all.
            loop.add("feed_forward", Gain(whole_over_trailing(coal_train(), COUPLER)))
            loop.connect("target.y", "feed_forward.u")
            loop.connect("feed_forward.y", "controller.feed_forward")
        self._measure(loop)
        self._actuate(loop)
        return loop

    def _measure(self, loop: Diagram) -> None:
        source = f"train.{self.measured}"
        if self.noise > 0.0:
            noise: Any = Noise(seed=self.seed, deviation=self.noise, period=SAMPLE, unit="N")
            loop.add("noise", noise)
            loop.add("sensor", Sum("++"))
            loop.connect(source, "sensor.u1")
            loop.connect("noise.y", "sensor.u2")
            source = "sensor.y"
        loop.connect(source, "controller.measurement")

    def _actuate(self, loop: Diagram) -> None:
        source = "controller.force"
        if self.lag > 0.0:
            loop.add("actuator", Lag(time=self.lag, period=SAMPLE))
            loop.connect(source, "actuator.u")
            source = "actuator.y"
        loop.connect(source, "train.group[1].force")


def rolling_at_rest() -> dict[str, float]:
    """Return the values of a train that resists at rest no more than when it rolls slowly."""
    return {
        f"vehicle[{number}].resistance_starting": vehicle.resistance.constant
        for number, vehicle in enumerate(coal_train().vehicles, 1)
    }


def whole_over_trailing(consist: Consist, coupler: int) -> float:
    """Return the train's mass over that behind a coupler (from 1)."""
    return consist.mass / sum(vehicle.mass for vehicle in consist.vehicles[coupler:])
