"""What is to be tracked: coupler forces and speeds. Synthetic, ours: the paper's data are lost."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...base.railway import KILOMETRES_PER_HOUR
from ...cosim import Profile

Floats = NDArray[np.float64]
SPACING = 0.02  # s between the points of a profile: 0.2 N beside the smooth curve
PERIOD = 120.0  # s, of the cyclic braking
APPLIED = (20.0, 80.0)  # s in each period with the air brake on
REDUCTION = 50.0  # kPa

START_UP, BRAKING, STEPS = 90.0, 240.0, 110.0  # s, how long the experiments last
DOWNHILL_SPEED = 65.0 / KILOMETRES_PER_HOUR  # m/s, at the start of the braking


def smooth(x: Floats) -> Floats:
    """Return S = 10 x³ − 15 x⁴ + 6 x⁵ within 0 to 1, held outside."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def start_up_force(t: Floats) -> Floats:
    """Return the target (N) of the start-up on +6 ‰: 1060 kN · S((t − 1)/40)."""
    return 1060e3 * smooth((t - 1.0) / 40.0)


def braking_force(t: Floats) -> Floats:
    """Return the target (N) of the cyclic braking on −6 ‰.

    −350 kN with the air brake released and −150 kN with it applied, 10 s from one to the other,
    times S(t/15).
    """
    return (-350e3 + 200e3 * _applied(t)) * smooth(t / 15.0)


def _applied(t: Floats) -> Floats:
    phase = np.mod(t, PERIOD)
    return smooth((phase - APPLIED[0]) / 10.0) - smooth((phase - APPLIED[1]) / 10.0)


def step_force(t: Floats) -> Floats:
    """Return the target (N) of the steps: to 950 kN in 40 s, then ±80 kN for 15 s each."""
    base = 950e3 * smooth((t - 1.0) / 40.0)
    return base + 80e3 * ((t >= 60.0) & (t < 75.0)) - 80e3 * ((t >= 90.0) & (t < 105.0))


def start_up_speed(t: Floats) -> Floats:
    """Return the speed (m/s) of a start-up on +6 ‰: to 2 m/s in 80 s."""
    return 2.0 * smooth((t - 3.0) / 80.0)


def braking_speed(t: Floats) -> Floats:
    """Return the speed (m/s) of the cyclic braking: 8 km/h less at each application."""
    begin = APPLIED[0]
    down = smooth((t - begin) / 60.0) + smooth((t - begin - PERIOD) / 60.0)
    return DOWNHILL_SPEED - 8.0 / KILOMETRES_PER_HOUR * down


def profile(target: Callable[[Floats], Floats], stop: float, unit: str) -> Profile:
    """Return a target as a source; where it jumps, the profile takes 20 ms for it."""
    times = SPACING * np.arange(round(stop / SPACING) + 1, dtype=np.float64)
    points = zip(times.tolist(), target(times).tolist(), strict=True)
    return Profile(tuple(points), unit=unit)


def reductions(stop: float) -> Profile:
    """Return the brake pipe's reduction (kPa) in the cyclic braking: 50 kPa from 20 to 80 s, …"""
    points = [(0.0, 0.0)]
    for start in np.arange(0.0, stop, PERIOD).tolist():
        for at, before, after in ((APPLIED[0], 0.0, REDUCTION), (APPLIED[1], REDUCTION, 0.0)):
            points += [(start + at, before), (start + at, after)]
    return Profile(tuple(points), unit="kPa")
