"""What a controller knows of a train with an electric and an air brake: the nominal model."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from ..base.ops import clip, exp, maximum, minimum, where
from ..base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from ..cosim.block import Block, require_finite, require_positive


class BrakeState(NamedTuple):
    """Where a train is in a stop: position (m), speed (m/s), both brakes (m/s²), and the clock.

    `clock` (s) is the time since the air brake came on: −T3 until the changeover has begun.
    """

    position: Any
    speed: Any
    electric: Any
    air: Any
    clock: Any


@dataclass(frozen=True, kw_only=True, slots=True)
class BrakeModel(Block):
    """The precise braking model with nominal numbers (precise braking paper, eqs. 1 to 10).

    v' = w B_e + B_p − r; T2 B_e' = P1 u_e − B_e; T4 B_p' = K φ(v) min(u_p, 0) − B_p from T3 after
    the first v ≤ V_sw on; w = max(0, 1 − k_bra · clock/0.7); φ = (V + 150)/(2V + 150), V in km/h;
    r by Davis's formula and the gradient (‰), which changes from `approach` to `platform` as the
    train's `length` passes `platform_from` (m). The brakes' numbers are the paper's table 1, the
    others our choice. It has no ports: it is a part of controllers, in which its parameters can
    be named.
    """

    electric_delay: float = 0.9
    electric_lag: float = 0.83
    electric_coefficient: float = 0.85
    air_delay: float = 0.8
    air_lag: float = 1.741
    air_gain: float = 1.0142 / 1.191
    changeover_speed: float = 6.0 / KILOMETRES_PER_HOUR
    fade_rate: float = 0.60
    fade_reference: float = 0.70
    davis_a: float = 2.031
    davis_b: float = 0.0622
    davis_c: float = 0.001807
    approach: float = 0.0
    platform: float = 0.0
    platform_from: float = -120.0
    length: float = 118.0

    def __post_init__(self) -> None:
        positive = (
            "electric_delay", "electric_lag", "electric_coefficient", "air_delay", "air_lag",
            "air_gain", "changeover_speed", "fade_rate", "fade_reference", "length",
        )  # fmt: skip
        require_positive(self, *positive)
        require_finite(self, "davis_a", "davis_b", "davis_c", "approach", "platform")
        require_finite(self, "platform_from")

    def resistance(self, position: Any, speed: Any) -> Any:
        """Return the deceleration (m/s²) by running resistance and gradient."""
        v = KILOMETRES_PER_HOUR * speed
        on_platform = clip((position - self.platform_from) / self.length, 0.0, 1.0)
        gradient = self.approach + (self.platform - self.approach) * on_platform
        return (self.davis_a + v * (self.davis_b + self.davis_c * v) + gradient) * GRAVITY_PER_MILLE

    def cruising(self, position: Any, speed: Any) -> BrakeState:
        """Return the state in which the motors hold the speed."""
        r = self.resistance(position, speed)
        return BrakeState(position, speed, r, 0.0, -self.air_delay)

    def share(self, clock: Any) -> Any:
        """Return the electric brake's share w."""
        return clip(1.0 - self.fade_rate * clock / self.fade_reference, 0.0, 1.0)

    def advance(
        self, x: BrakeState, dt: Any, electric: Any, air: Any, disturbance: Any
    ) -> BrakeState:
        """Return the state dt (s) later, for delayed commands (m/s²) that do not change meanwhile.

        `disturbance` (m/s²) is added to the acceleration. Both lags are exact; speed-dependent
        terms and w are those of the interval's middle, so dt should not exceed 0.2 s.
        """
        share = self.share(x.clock + 0.5 * dt)
        middle = maximum(x.speed + 0.5 * dt * (share * x.electric + x.air), 0.0)
        v = KILOMETRES_PER_HOUR * middle
        friction = (v + 150.0) / (2.0 * v + 150.0)
        on = clip(x.clock + dt, 0.0, dt)
        b_e, dv_e, ds_e = _lagged(
            x.electric, self.electric_coefficient * electric, self.electric_lag, dt
        )
        b_p, dv_p, ds_p = _lagged(
            x.air, self.air_gain * friction * minimum(air, 0.0), self.air_lag, on
        )
        steady = disturbance - self.resistance(x.position + 0.5 * dt * middle, middle)
        speed = x.speed + share * dv_e + dv_p + steady * dt
        position = x.position + x.speed * dt + share * ds_e + ds_p + 0.5 * steady * dt * dt
        # A train that stops within dt stays where it stopped.
        moving = clip(x.speed / maximum(x.speed - speed, 1e-9), 0.0, 1.0)
        stopped = x.position + 0.5 * x.speed * moving * dt
        position = where(speed > 0.0, position, stopped)
        begun = x.clock > -self.air_delay
        below = clip((self.changeover_speed - speed) / maximum(x.speed - speed, 1e-9), 0.0, 1.0)
        clock = x.clock + where(begun, 1.0, below) * dt
        return BrakeState(position, maximum(speed, 0.0), b_e, b_p, clock)


def _lagged(b: Any, target: Any, lag: Any, dt: Any) -> tuple[Any, Any, Any]:
    """Return a first-order lag's value after dt, and its integral once and twice over dt."""
    gone = 1.0 - exp(-dt / lag)
    rest = b - target
    once = target * dt + rest * lag * gone
    twice = 0.5 * target * dt * dt + rest * lag * (dt - lag * gone)
    return b - rest * gone, once, twice
