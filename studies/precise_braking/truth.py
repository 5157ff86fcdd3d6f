"""The numbers of one train at one station: nominal, and drawn within the spread."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR

DAVIS = (2.031, 0.0622, 0.001807)  # N/kN with V in km/h; our choice
PLATFORM = 120.0  # m before the mark: there the platform's gradient begins
PERCENT = 0.01
# Half-widths of the uniform distributions at full spread, our choice: (share of the value, or
# with a unit of their own)
SPREAD = {
    "electric_delay": 15 * PERCENT,
    "electric_lag": 15 * PERCENT,
    "electric_coefficient": 6 * PERCENT,
    "mass_ratio": 6 * PERCENT,
    "air_delay": 20 * PERCENT,
    "air_lag": 20 * PERCENT,
    "air_gain": 10 * PERCENT,
    "changeover_speed": 8 * PERCENT,
    "fade_rate": 20 * PERCENT,
    "davis": 20 * PERCENT,
}
ABSOLUTE = {"approach": 2.0, "platform": 1.0, "speed": 0.3, "position": 1.0}


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is true of a train and a station, whether or not a controller knows it.

    Times in s, speeds in m/s, `air_gain` K in m/s², `davis` a factor on the running resistance,
    gradients in ‰; `position` is the offset in m of the place where braking is to begin. The
    numbers of the brakes are the precise braking paper's table 1, the others our choice.
    """

    electric_delay: float = 0.9  # T1
    electric_lag: float = 0.83  # T2
    electric_coefficient: float = 0.85  # P1
    mass_ratio: float = 1.0  # μ
    air_delay: float = 0.8  # T3
    air_lag: float = 1.741  # T4
    air_gain: float = 1.0142 / 0.01191 / 100.0  # K = K1/K2
    changeover_speed: float = 12.0 / KILOMETRES_PER_HOUR  # V_sw
    fade_rate: float = 0.30  # k_bra, m/s³
    davis: float = 1.0
    approach: float = 0.0
    platform: float = 0.0
    speed: float = 14.0
    position: float = 0.0

    def drawn(self, generator: np.random.Generator, scale: float = 1.0) -> "Truth":
        """Return numbers drawn around these, uniformly and independently, at a share of SPREAD."""
        shares = {n: getattr(self, n) * h for n, h in SPREAD.items()}
        widths = {**shares, **ABSOLUTE}
        draws = generator.uniform(-scale, scale, len(widths))
        values = {
            name: getattr(self, name) + half * float(draw)
            for (name, half), draw in zip(widths.items(), draws, strict=True)
        }
        return replace(self, **values)

    def resistance(self, speed: float, gradient: float) -> float:
        """Return the deceleration (m/s²) by running resistance and a gradient (‰)."""
        a, b, c = (self.davis * k for k in DAVIS)
        v = KILOMETRES_PER_HOUR * speed
        return (a + b * v + c * v * v + gradient) * GRAVITY_PER_MILLE

    @property
    def cruising(self) -> float:
        """The command (m/s²) that holds the speed on the approach."""
        r = self.resistance(self.speed, self.approach)
        return r * self.mass_ratio / self.electric_coefficient

    def values(self, start: float, *, probes: bool = False) -> Mapping[str, Any]:
        """Return the loop's parameters by "block.parameter"; the train starts at `start` (m).

        `probes`: the loop's controller tries the air brake out, by a delay of its own.
        """
        train = {
            "electric_lag": self.electric_lag,
            "electric_coefficient": self.electric_coefficient,
            "mass_ratio": self.mass_ratio,
            "air_delay": self.air_delay,
            "air_lag": self.air_lag,
            "air_numerator": 100.0 * 0.01191 * self.air_gain,
            "changeover_speed": self.changeover_speed,
            "fade_rate": self.fade_rate,
            "davis_a": self.davis * DAVIS[0],
            "davis_b": self.davis * DAVIS[1],
            "davis_c": self.davis * DAVIS[2],
            "gradient[1]": self.approach,
            "gradient[2]": self.platform,
            "speed": self.speed,
            "position": start + self.position,
            "motors": self.resistance(self.speed, self.approach),
        }
        return {
            **{f"train.{name}": value for name, value in train.items()},
            "electric_delay.time": self.electric_delay,
            "electric_delay.initial": self.cruising,
            "air_delay.time": self.air_delay,
            "air_delay.initial": self.cruising,
            **({"probe_delay.time": self.air_delay, "probe_delay.initial": 0.0} if probes else {}),
        }


V12 = Truth()
V6 = Truth(changeover_speed=6.0 / KILOMETRES_PER_HOUR, fade_rate=0.60)
V3 = Truth(changeover_speed=3.0 / KILOMETRES_PER_HOUR, fade_rate=1.20)
TRAINS = {"v12": V12, "v6": V6, "v3": V3}
