"""The fast target speed curve: traction, cruise, perhaps coasting, braking, with bounded jerk."""

import math
from typing import TYPE_CHECKING

from ...base.errors import ParameterError
from .curve import SpeedCurve
from .drive import Drive
from .driving import Course, Driving
from .root import root
from .run import Run

if TYPE_CHECKING:
    from ...models.line import Section, Train

TOO_LATE = 1e4  # s


def fast_curve(
    section: "Section",
    train: "Train",
    driving: Driving | None = None,
    *,
    cruise: float = math.inf,
    coast_from: float = math.inf,
) -> SpeedCurve:
    """Return the fast curve of a section: full traction, the speed limit, braking to the stop.

    `cruise` (m/s) caps the speed. From `coast_from` (m) on there is no traction any more: the
    train coasts to the point where it has to brake, or at a limit downhill holds it.

    Each regime passes into the next with the driving's jerk. Traction follows the envelope (force,
    then power, less resistance and gradient). A lower limit is reached at its beginning with
    acceleration 0; from a higher one's beginning (when the rear has left the lower) there is full
    traction. It is the quickest curve of this form; where limits change faster than the jerk
    allows, a freer form could save some tenths of a second. The stop is exact to rounding.

    Raise ParameterError, saying where, for a section that is too short for the jerk, a gradient
    that stalls the train, and coasting that does not reach the stop.
    """
    course = Course(section, train, driving or Driving())
    if not cruise > 0.0:
        raise ParameterError(f"cruise must be a positive speed in m/s, not {cruise!r}")
    return Drive(course, cruise=cruise, coast_from=coast_from).to_stop().curve(course)


def timed_curve(
    section: "Section", train: "Train", driving: Driving | None = None, *, time: float
) -> SpeedCurve:
    """Return the curve that takes `time` (s, met to 1e-5): cruise, then coasting from somewhere.

    The sooner it coasts the longer it takes. Where coasting right from the last acceleration on is
    still too quick, the train accelerates less far. Raise ParameterError for less than the fast
    curve's time, naming that.
    """
    quickest = fast_curve(section, train, driving)
    if time < quickest.running_time - 1e-6:
        raise ParameterError(
            f"section '{section.name}' takes '{train.name}' at least "
            f"{quickest.running_time:.3f} s, not {time:g} s"
        )
    if time < quickest.running_time + 1e-6:
        return quickest
    course = Course(section, train, driving or Driving())

    def drive(cruise: float, coast_from: float = math.inf) -> Run:
        return Drive(course, cruise=cruise, coast_from=coast_from).to_stop()

    def late(coast_from: float, cruise: float = math.inf) -> float:
        try:
            return drive(cruise, coast_from).time - time
        except ParameterError:  # it coasts to a halt
            return TOO_LATE

    def earliest(cruise: float) -> float:
        return drive(cruise).traction_ends

    cruise, top = math.inf, float(quickest.speed.max())
    if late(earliest(math.inf)) < 0.0:
        # Slower, coasting from where that speed is reached. Where an acceleration behind a low
        # limit falls away the time jumps: `slower` is on the late side, and coasts less.
        slowest = section.length / time
        slower = root(lambda v: late(earliest(v), v), slowest, top, tolerance=1e-6)
        cruise = slower - 2e-6
    if late(section.length, cruise) > 0.0:  # even without coasting
        cruise = root(
            lambda v: late(section.length, v), cruise, float(quickest.speed.max()), tolerance=1e-9
        )
        return fast_curve(section, train, driving, cruise=cruise)
    place = root(lambda s: late(s, cruise), earliest(cruise), section.length, tolerance=1e-7)
    return fast_curve(section, train, driving, cruise=cruise, coast_from=place)
