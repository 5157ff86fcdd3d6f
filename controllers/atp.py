"""Automatic train protection: it lets a controller drive until the limit curve is in danger."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, get_args

from ..base.ops import absolute, is_symbol, where
from ..cosim.block import Block, require, require_finite, require_positive
from .limit_curve import LimitCurve

Level = Literal["warning", "service", "emergency"]


@dataclass(frozen=True, kw_only=True, slots=True)
class ATP(Block):
    """Pass `demand` on as `command`, and intervene so that the limit curve is never passed.

    Braking model: from a decision on, the train accelerates with at most `acceleration` (m/s²)
    until the brake's full deceleration acts, which takes at most the brake's time (s:
    `emergency_time` …, reaction, delay and build-up); then it decelerates with at least the
    curve's `braking`. To each time the block adds its `period`, as a decision can come one sample
    late. A level comes up when the train could pass the curve anywhere within its time:
    v + a T > v_lim(s + v T + a T²/2), or the like at a restriction's end on the way
    (`LimitCurve.excess`).

    - warning: while the curve could be passed within warning_time.
    - service: from service_time until there is no warning any more. The command is
      `service_command`.
    - emergency: from emergency_time on, latched. The command is `emergency_command`, also over
      the service brake, until a sample at standstill (|v| ≤ `standstill_speed`, m/s) that has
      `release` = 1 and no danger any more.

    Guarantee: if the train keeps to the braking model, and the first sample calls for no
    emergency, v ≤ v_lim at all times, whatever `demand` is (docs/atp.md has the proof). Warning and
    service brake add nothing to it.

    At standstill `release` also ends a service brake. Where it rises from 0 to 1 at standstill
    without an emergency, at most `release_within` (m) before the next danger point, that stop is
    released and the next one counts.

    Outputs: command (unit of demand); emergency, service, warning (0 or 1); limit, v_lim (m/s) at
    the position; margin, limit − speed (m/s). The paper (adaptive fuzzy ATO, section 1) has the ATP
    brake in an emergency above the target speed; curve, times and levels are our choice. Raise
    ParameterError for wrong numbers.
    """

    curve: LimitCurve
    acceleration: float
    emergency_time: float
    service_time: float
    warning_time: float
    emergency_command: float = 0.0
    service_command: float = 0.0
    standstill_speed: float = 0.05
    release_within: float = 50.0
    period: float = 0.05

    inputs = {"position": "m", "speed": "m/s", "demand": None, "release": "1"}
    outputs = {
        "command": None,
        "emergency": "1",
        "service": "1",
        "warning": "1",
        "limit": "m/s",
        "margin": "m/s",
    }

    def __post_init__(self) -> None:
        good = isinstance(self.curve, LimitCurve)
        require(self, good, f"curve must be a LimitCurve, not {self.curve!r}")
        require_positive(self, "period")
        require_finite(self, "emergency_command", "service_command")
        not_negative = ("acceleration", "emergency_time", "standstill_speed", "release_within")
        require_finite(self, *not_negative, "service_time", "warning_time")
        for name in not_negative:
            value = getattr(self, name)
            good = is_symbol(value) or value >= 0.0
            require(self, good, f"{name} must not be negative, is {value!r}")
        names = ("emergency_time", "service_time", "warning_time")
        for (low, a), (high, b) in pairwise((name, getattr(self, name)) for name in names):
            good = is_symbol(a) or is_symbol(b) or a < b
            require(self, good, f"{high} must be longer than {low} ({a!r} s), is {b!r} s")

    def look_ahead(self, level: Level) -> Any:
        """Return T (s) of a level: its time and one period."""
        require(self, level in get_args(Level), f"no level {level!r}; {', '.join(get_args(Level))}")
        return getattr(self, f"{level}_time") + self.period

    def least_overlap(self, stopping: float = 0.0, *, level: Level = "warning") -> float:
        """Return how far (m) a danger point must lie behind the mark for the level to stay off.

        The train stops at the mark on the curve sqrt(2 · stopping · (mark − s)), from the curve's
        maximum speed at most; with `stopping` = 0 (m/s²) it just stands there. With the level's T,
        a = acceleration and b = braking the overlap is
        T² (a + b) (a + stopping) / (2 (b − stopping)), which is reached at a speed of
        T (a + b) stopping / (b − stopping). Where that is above the maximum, or stopping ≥ b, the
        maximum decides. Raise ParameterError for a negative `stopping`.
        """
        require(self, stopping >= 0.0, f"stopping must not be negative, is {stopping!r} m/s²")
        a, b, time = self.acceleration, self.curve.braking, self.look_ahead(level)
        speed = self.curve.maximum
        if stopping == 0.0:
            speed = 0.0
        elif stopping < b:
            speed = min(speed, time * (a + b) * stopping / (b - stopping))
        reached = speed + a * time
        travelled = (speed + 0.5 * a * time) * time
        before_mark = speed * speed / (2.0 * stopping) if stopping > 0.0 else 0.0
        return max(0.0, travelled + reached * reached / (2.0 * b) - before_mark)

    def start(self) -> tuple[float, float, float, float]:
        """Return (emergency, service, stops released, last release).

        The last release counts as 1: one that is held from the start on releases no stop.
        """
        return 0.0, 0.0, 0.0, 1.0

    def step(self, x: Any, position: Any, speed: Any, demand: Any, release: Any) -> tuple[Any, Any]:
        """Return ((command, emergency, service, warning, limit, margin), next state)."""
        emergency, service, released, last = x
        standing = where(absolute(speed) <= self.standstill_speed, 1.0, 0.0)
        asked = where(release > 0.5, 1.0, 0.0)
        at_stop = self.curve.before_stop(position, self.release_within, released)
        rises = asked * (1.0 - last)
        released = released + at_stop * standing * rises * (1.0 - emergency)
        let_go = standing * asked > 0.5

        def comes_up(level: Level) -> Any:
            time = self.look_ahead(level)
            return (
                self.curve.excess(
                    position, speed, acceleration=self.acceleration, time=time, released=released
                )
                > 0.0
            )

        warning = where(comes_up("warning"), 1.0, 0.0)
        held = where(let_go, 0.0, where(warning > 0.5, service, 0.0))
        service = where(comes_up("service"), 1.0, held)
        emergency = where(comes_up("emergency"), 1.0, where(let_go, 0.0, emergency))

        braked = where(service > 0.5, self.service_command, demand)
        command = where(emergency > 0.5, self.emergency_command, braked)
        limit = self.curve.speed(position, released)
        outputs = (command, emergency, service, warning, limit, limit - speed)
        return outputs, (emergency, service, released, asked)
