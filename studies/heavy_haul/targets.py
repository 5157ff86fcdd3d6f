"""What is to be tracked: coupler forces and speeds. Synthetic, ours: the paper's data are lost."""

from collections.abc import Callable
from dataclasses import dataclass

from ...base.railway import KILOMETRES_PER_HOUR
from ...cosim import Profile
from ...cosim.block import require
from ...cosim.blocks.source import Source

PERIOD = 120.0  # s, of the cyclic braking
APPLIED = (20.0, 80.0)  # s in each period with the air brake on
REDUCTION = 50.0  # kPa

START_UP, BRAKING, STEPS = 90.0, 240.0, 110.0  # s, how long the experiments last
DOWNHILL_SPEED = 65.0 / KILOMETRES_PER_HOUR  # m/s, at the start of the braking


def smooth(x: float) -> float:
    """Return S = 10 x³ − 15 x⁴ + 6 x⁵ within 0 to 1, held outside."""
    x = min(max(x, 0.0), 1.0)
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)


def start_up_force(t: float) -> float:
    """Return the target (N) of the start-up on +6 ‰: 1060 kN · S((t − 1)/40)."""
    return 1060e3 * smooth((t - 1.0) / 40.0)


def braking_force(t: float) -> float:
    """Return the target (N) of the cyclic braking on −6 ‰.

    −350 kN with the air brake released and −150 kN with it applied, 10 s from one to the other,
    times S(t/15).
    """
    phase = t % PERIOD
    applied = smooth((phase - APPLIED[0]) / 10.0) - smooth((phase - APPLIED[1]) / 10.0)
    return (-350e3 + 200e3 * applied) * smooth(t / 15.0)


def step_force(t: float) -> float:
    """Return the target (N) of the steps: to 950 kN in 40 s, then ±80 kN for 15 s each."""
    base = 950e3 * smooth((t - 1.0) / 40.0)
    return base + 80e3 * (60.0 <= t < 75.0) - 80e3 * (90.0 <= t < 105.0)


def start_up_speed(t: float) -> float:
    """Return the speed (m/s) of a start-up on +6 ‰: to 2 m/s in 80 s."""
    return 2.0 * smooth((t - 3.0) / 80.0)


def braking_speed(t: float) -> float:
    """Return the speed (m/s) of the cyclic braking: 8 km/h less at each application."""
    begin = APPLIED[0]
    down = smooth((t - begin) / 60.0) + smooth((t - begin - PERIOD) / 60.0)
    return DOWNHILL_SPEED - 8.0 / KILOMETRES_PER_HOUR * down


CURVES: dict[str, tuple[Callable[[float], float], str]] = {
    "start_up_force": (start_up_force, "N"),
    "braking_force": (braking_force, "N"),
    "step_force": (step_force, "N"),
    "start_up_speed": (start_up_speed, "m/s"),
    "braking_speed": (braking_speed, "m/s"),
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Target(Source):
    """One of the curves above, by its name, as a source."""

    curve: str

    timed = True

    def __post_init__(self) -> None:
        known = ", ".join(CURVES)
        require(self, self.curve in CURVES, f"curve is one of {known}, not {self.curve!r}")
        Source.__post_init__(self)

    def output(self, x: tuple[()], t: float) -> float:
        """Return the value at time t (s)."""
        return CURVES[self.curve][0](t)


def target(curve: str) -> Target:
    """Return a curve as a source with its unit."""
    return Target(curve=curve, unit=CURVES[curve][1])


def reductions(stop: float) -> Profile:
    """Return the brake pipe's reduction (kPa) in the cyclic braking: 50 kPa from 20 to 80 s, …"""
    points = [(0.0, 0.0)]
    for period in range(int(stop / PERIOD) + 1):
        for at, before, after in ((APPLIED[0], 0.0, REDUCTION), (APPLIED[1], REDUCTION, 0.0)):
            place = period * PERIOD + at
            points += [(place, before), (place, after)]
    return Profile(tuple(points), unit="kPa")
