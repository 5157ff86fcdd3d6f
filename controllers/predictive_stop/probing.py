"""The predictive stop that tries the air brake out while the motors brake."""

from dataclasses import dataclass
from typing import Any

from ...cosim.block import require
from .controller import BRAKING, PredictiveStop


@dataclass(frozen=True, kw_only=True, slots=True)
class ProbingStop(PredictiveStop):
    """A predictive stop whose model has a `probe`: a light braking by air before it is needed.

    From `after` s of braking the air brake is to give `level` (m/s², negative) for `length` s, by
    the additional output probe, which reaches it after T3 whether it is on or not. What it does
    shows T3, T4 and K; the predictions and the plan reckon with it. Its times are whole periods.
    All of it is our choice. Raise ParameterError for wrong numbers.
    """

    outputs = {**PredictiveStop.outputs, "probe": "m/s2"}

    def __post_init__(self) -> None:
        PredictiveStop.__post_init__(self)
        probe, period = self.model.probe, self.period
        require(self, probe is not None, "the model must have a probe: BrakingModel(probe=Probe())")
        assert probe is not None
        require(self, probe.level <= 0.0, f"the probe's level must be ≤ 0, not {probe.level!r}")
        for name, time, least in (("length", probe.length, 1), ("after", probe.after, 0)):
            whole = round(time / period)
            good = whole >= least and abs(time - whole * period) < 1e-9
            words = f"the probe's {name} must be whole periods of {period!r} s, not {time!r}"
            require(self, good, words)

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return ((command, predicted stop, level, phase, estimates …, probe), next state)."""
        y, following = PredictiveStop.step(self, x, position, speed)
        phase, *_, probed, _, samples = following
        probe, now = self.model.probe, (len(samples[0]) - 1) * self.period
        assert probe is not None
        acts = phase == BRAKING and -1e-9 < now - probed < probe.length - 1e-9  # whole periods
        return (*y, probe.level if acts else 0.0), following
