"""The state of a train once the commands under way have arrived: a predictor over the delays."""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

from ..base.ops import clip, is_symbol, where
from ..cosim.block import Block, require, require_finite, require_positive
from .brake_model import BrakeModel, BrakeState
from .disturbance_observer import DisturbanceObserver


class Piece(NamedTuple):
    """A part of a period in which both delayed commands stay: its ends (s), how old they are."""

    begin: float
    end: float
    electric: int
    air: int


@dataclass(frozen=True, kw_only=True, slots=True)
class DelayPredictor(Block):
    """Predicts position and speed over delay + lead by a model and the commands given so far.

    The estimated state advances by the model, with the commands of the controller itself delayed
    as on the train, and takes in the shares `position_gain` and `speed_gain` of what was measured
    beyond it (1: the measurement itself). From there the model runs ahead over the electric
    delay + `electric_lead` (s), or, once the changeover has begun, over the air delay +
    `air_lead`, with the last command held where none is known yet. The leads make up for the
    brakes' lags: a command should serve the time at which it acts. (Leads that are symbols need
    `longest_lead`.) With an `observer` the disturbance it finds corrects the model. Our choice;
    the precise braking paper has no predictor.

    Inputs are the measured position and speed and the last `command`; outputs the predicted
    position and speed, the `horizon` (s), the estimated speed, and the disturbance (m/s²).
    """

    model: BrakeModel = field(default_factory=BrakeModel)
    observer: DisturbanceObserver | None = None
    electric_lead: float = 0.0
    air_lead: float = 0.0
    position_gain: float = 1.0
    speed_gain: float = 1.0
    initial_speed: float = 14.0
    initial_position: float = -200.0
    longest_lead: float | None = None
    period: float = 0.2
    _pieces: tuple[Piece, ...] = field(init=False, repr=False, compare=False)

    inputs = {"position": "m", "speed": "m/s", "command": "m/s2"}
    outputs = {
        "predicted_position": "m", "predicted_speed": "m/s", "horizon": "s",
        "estimated_speed": "m/s", "disturbance": "m/s2",
    }  # fmt: skip

    def __post_init__(self) -> None:
        require_positive(self, "period")
        require_finite(self, "electric_lead", "air_lead", "position_gain", "speed_gain")
        require_finite(self, "initial_speed", "initial_position")
        for name in ("electric_lead", "air_lead"):
            lead: Any = getattr(self, name)
            if is_symbol(lead):
                require(self, self.longest_lead, f"longest_lead must be given for a symbol {name}")
                continue
            longest = math.inf if self.longest_lead is None else self.longest_lead
            good = 0.0 <= lead <= longest
            require(self, good, f"{name} must lie between 0 and {longest:g} s, not {lead!r}")
        same = self.observer is None or self.observer.period == self.period
        require(self, same, f"the observer must have its period, {self.period!r} s")
        symbols = is_symbol(self.model.electric_delay) or is_symbol(self.model.air_delay)
        require(self, not symbols, "the model's delays must be numbers, not symbols")
        object.__setattr__(self, "_pieces", _pieces(self.model, self.period))

    def start(self) -> tuple[Any, ...]:
        """Return (estimated state, observer's state, past commands, whether this is the first)."""
        estimate = self.model.cruising(self.initial_position, self.initial_speed)
        command = estimate.electric / self.model.electric_coefficient
        observed = () if self.observer is None else self.observer.start()
        return tuple(estimate), observed, (command,) * self._memory, 1.0

    def step(self, x: Any, position: Any, speed: Any, command: Any) -> tuple[Any, Any]:
        """Return (the outputs, next state)."""
        before, observed, past, first = x
        past = (*past[1:], where(first > 0.5, past[-1], command))
        model = self.model
        disturbance = 0.0 if self.observer is None else observed
        state = BrakeState(*before)
        moved = self._run(state, past, disturbance, -1, self.period)
        state = BrakeState(*(where(first > 0.5, a, b) for a, b in zip(state, moved, strict=True)))
        if self.observer is not None:
            predicted = where(first > 0.5, speed, state.speed)
            share = model.share(state.clock)
            disturbance, observed = self.observer.step(observed, speed, predicted, share)
        position = where(
            first > 0.5, position, _mixed(state.position, position, self.position_gain)
        )
        speed = where(first > 0.5, speed, _mixed(state.speed, speed, self.speed_gain))
        state = state._replace(position=position, speed=speed)
        begun = state.clock > -model.air_delay
        horizon = where(
            begun, model.air_delay + self.air_lead, model.electric_delay + self.electric_lead
        )
        ahead = state
        for k in range(self._longest):
            left = clip(horizon - k * self.period, 0.0, self.period)
            ahead = self._run(ahead, past, disturbance, k, left)
        outputs = (ahead.position, ahead.speed, horizon, speed, disturbance)
        return outputs, (tuple(state), observed, past, 0.0)

    @property
    def _memory(self) -> int:
        return 1 + max(max(p.electric, p.air) for p in self._pieces)

    @property
    def _longest(self) -> int:
        """The number of periods that the farthest horizon reaches into."""
        leads = (self.electric_lead, self.air_lead)
        if self.longest_lead is not None:
            leads = (self.longest_lead, self.longest_lead)
        delays = (self.model.electric_delay, self.model.air_delay)
        longest = max(delay + lead for delay, lead in zip(delays, leads, strict=True))
        return math.ceil(round(longest / self.period, 9))

    def _run(
        self, x: BrakeState, past: tuple[Any, ...], disturbance: Any, k: int, time: Any
    ) -> BrakeState:
        """Return the state after `time` (s) of the period that begins k periods from now."""
        for piece in self._pieces:
            dt = clip(time - piece.begin, 0.0, piece.end - piece.begin)
            electric, air = (past[min(k - age, -1)] for age in (piece.electric, piece.air))
            x = self.model.advance(x, dt, electric, air, disturbance)
        return x


def _mixed(estimated: Any, measured: Any, gain: Any) -> Any:
    return estimated + gain * (measured - estimated)


def _pieces(model: BrakeModel, period: float) -> tuple[Piece, ...]:
    """Cut a period where a delayed command changes; ages count from the command of its beginning.

    A delay of 4.5 periods: the command 5 samples old in the first half, 4 in the second.
    """
    delays = [round(d / period, 9) for d in (model.electric_delay, model.air_delay)]
    changes = [(d - math.floor(d)) * period for d in delays]
    cuts = sorted({0.0, *changes, period})
    found = []
    for begin, end in pairwise(cuts):
        ages = [math.floor(d) + (begin < change) for d, change in zip(delays, changes, strict=True)]
        found.append(Piece(begin, end, *ages))
    return tuple(found)
