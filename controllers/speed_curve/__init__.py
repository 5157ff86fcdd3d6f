"""Target speed curves: fast ones, and those of the least energy at a given running time."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .checks import Violation
    from .curve import Phase, SpeedCurve
    from .driving import Course, Driving
    from .fast import fast_curve, timed_curve
    from .feed_forward import Response
    from .minimum_energy import minimum_energy_curve

_HOME = {
    "Course": "driving",
    "Driving": "driving",
    "Phase": "curve",
    "Response": "feed_forward",
    "SpeedCurve": "curve",
    "Violation": "checks",
    "fast_curve": "fast",
    "minimum_energy_curve": "minimum_energy",
    "timed_curve": "fast",
}

__all__ = [
    "Course",
    "Driving",
    "Phase",
    "Response",
    "SpeedCurve",
    "Violation",
    "fast_curve",
    "minimum_energy_curve",
    "timed_curve",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
