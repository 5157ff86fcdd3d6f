"""What a predictive stop believes of its parameters before it brakes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ...base.errors import ParameterError, listing, suggest
from ...base.railway import GRAVITY_PER_MILLE

# The parameters in the order of model.c, with their units.
PARAMETERS = {
    "electric_delay": "s",  # T1
    "electric_lag": "s",  # T2
    "electric_gain": "1",  # g = P1/μ
    "air_delay": "s",  # T3
    "air_lag": "s",  # T4
    "air_gain": "1",  # Ke = K/μ
    "changeover_speed": "m/s",  # V_sw
    "fade_rate": "m/s3",  # k_bra
    "approach": "m/s2",  # deceleration by the approach's gradient
    "platform": "m/s2",  # … by the platform's
    "davis": "1",  # running resistance over the nominal one
    "speed": "m/s",  # v0, at the first sample
    "position": "m",  # s0
    "scale": "1",  # of the wheel, until two balises have calibrated it
}
OWN = ("speed", "position", "scale")  # parameters that begin anew at each stop
COUNT = len(PARAMETERS)
INDEX = {name: i for i, name in enumerate(PARAMETERS)}


@dataclass(frozen=True, slots=True)
class Prior:
    """A normal distribution of the parameters: mean and covariance, in the order of PARAMETERS."""

    mean: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]

    @classmethod
    def nominal(
        cls,
        *,
        changeover_speed: float,
        fade_rate: float,
        approach: float = 0.0,
        platform: float = 0.0,
        scale: float = 0.0,
    ) -> "Prior":
        """Return the brakes of the precise braking paper's table 1 within the full spread.

        `approach` and `platform` are the station's nominal gradients in ‰, `scale` is the sd of
        the wheel's scale. Each spread is uniform (T1, T2 ±15 %, P1, μ ±6 %, T3, T4 ±20 %, K
        ±10 %, V_sw ±8 %, k_bra ±20 %, running resistance ±20 %, gradients ±2 and ±1 ‰); here are
        its mean and covariance. That the true and the nominal mass differ, μ, makes g and Ke
        differ together. Speed and position are left to the measurements.
        """
        third = math.sqrt(1.0 / 3.0)  # sd over half-width
        gain, air = 0.85, 1.0142 / 0.01191 / 100.0
        means = (
            0.9, 0.83, gain, 0.8, 1.741, air, changeover_speed, fade_rate,
            approach * GRAVITY_PER_MILLE, platform * GRAVITY_PER_MILLE, 1.0, 0.0, 0.0, 0.0,
        )  # fmt: skip
        mass = 0.06 * third
        sds = (
            0.15 * 0.9 * third, 0.15 * 0.83 * third, gain * math.hypot(0.06 * third, mass),
            0.2 * 0.8 * third, 0.2 * 1.741 * third, air * math.hypot(0.1 * third, mass),
            0.08 * changeover_speed * third, 0.2 * fade_rate * third,
            2.0 * GRAVITY_PER_MILLE * third, GRAVITY_PER_MILLE * third, 0.2 * third,
            100.0, 1e4, max(scale, 1e-9),
        )  # fmt: skip
        covariance = np.diag(np.square(sds))
        g, k = INDEX["electric_gain"], INDEX["air_gain"]
        covariance[g, k] = covariance[k, g] = gain * mass * air * mass
        return cls.of(np.array(means), covariance)

    @classmethod
    def of(cls, mean: Any, covariance: Any) -> "Prior":
        """Return the distribution with a mean and a covariance that are arrays."""
        rows = 0.5 * (np.asarray(covariance) + np.asarray(covariance).T)
        return cls(tuple(np.asarray(mean).tolist()), tuple(tuple(r) for r in rows.tolist()))

    def known(self, values: Mapping[str, float], sd: float = 1e-7) -> "Prior":
        """Return what is left where the parameters `values` are known, to within a relative sd."""
        for name in values:
            if name not in INDEX:
                raise ParameterError(
                    f"no parameter '{name}'; parameters: {listing(PARAMETERS, COUNT)}"
                    f"{suggest(name, PARAMETERS)}"
                )
        mean, covariance = list(self.mean), np.array(self.covariance)
        for name, value in values.items():
            i = INDEX[name]
            mean[i] = value
            covariance[i, :] = covariance[:, i] = 0.0
            covariance[i, i] = (sd * max(abs(value), 0.01)) ** 2
        return Prior.of(mean, covariance)

    def __getitem__(self, name: str) -> float:
        return self.mean[INDEX[name]]

    def starting(self, speed: float, position: float) -> "Prior":
        """Return the same with other means of speed and position."""
        return replace(self, mean=(*self.mean[:11], speed, position, *self.mean[13:]))

    @property
    def information(self) -> np.ndarray:
        """The inverse covariance, [COUNT, COUNT]."""
        return _information(self.covariance)

    @property
    def deviations(self) -> tuple[float, ...]:
        """The standard deviations."""
        return tuple(math.sqrt(row[i]) for i, row in enumerate(self.covariance))


@lru_cache(maxsize=16)
def _information(covariance: tuple[tuple[float, ...], ...]) -> np.ndarray:
    matrix = np.array(covariance)
    sd = np.sqrt(np.diag(matrix))  # parameters of such different size are inverted in their sds
    inverse = np.linalg.inv(matrix / np.outer(sd, sd)) / np.outer(sd, sd)
    inverse.flags.writeable = False
    return inverse
