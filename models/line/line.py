"""A railway line as data: stops, gradients and speed limits, and the section between two stops."""

import math
from dataclasses import dataclass
from itertools import pairwise

from ...base.errors import ParameterError, listing, suggest
from .profile import (
    Misfit,
    Steps,
    check_rising,
    check_steps,
    cut,
    integral,
    lowest_over,
    mirrored,
    place,
    value_at,
)

STEEPEST = 150.0  # ‰; the steepest adhesion railways have about 120
SLOWEST, FASTEST = 1 / 3.6, 200.0  # m/s; a limit lies within them (1 to 720 km/h)


@dataclass(frozen=True, kw_only=True)
class Stop:
    """Where the train's front halts, in either direction of travel.

    `position` in m from the line's beginning. `local_name` is the name in the local script; a
    stop is found by either.
    """

    name: str
    position: float
    local_name: str = ""


@dataclass(frozen=True, kw_only=True)
class Section:
    """The way from one stop to the next halt, in the direction of travel.

    Positions in m are those of the train's front: 0 at departure, `length` at the target.
    `gradients` in ‰, uphill positive, and `speed_limits` in m/s are (position where it begins,
    value) pairs. Beyond the ends the first and last values hold, so a train may start a little
    before 0 and overrun the target. Raise ParameterError for data that cannot be.
    """

    name: str
    length: float
    gradients: Steps
    speed_limits: Steps

    def __post_init__(self) -> None:
        _check(f"section '{self.name}'", self.length, self.gradients, self.speed_limits)

    def gradient_at(self, position: float) -> float:
        """Return the gradient in ‰, uphill positive; where it changes, the one that begins."""
        return value_at(self.gradients, position)

    def limit_at(self, position: float) -> float:
        """Return the speed limit in m/s; where it changes, the one that begins."""
        return value_at(self.speed_limits, position)

    def elevation(self, position: float) -> float:
        """Return the height in m over the departure: the integral of the gradient."""
        return integral(self.gradients, position) / 1000.0


@dataclass(frozen=True, kw_only=True)
class Line:
    """A line: positions in m from its beginning (0) to `length`, in the direction of its stops.

    `stops` are two or more with rising positions. `gradients` in ‰, uphill positive in that
    direction, and `speed_limits` in m/s are (position where it begins, value) pairs; they are
    used as they are for both directions of travel. `description` says where the data come from.
    Raise ParameterError for data that cannot be.
    """

    name: str
    length: float
    stops: tuple[Stop, ...]
    speed_limits: Steps
    gradients: Steps = ((0.0, 0.0),)
    description: str = ""

    def __post_init__(self) -> None:
        _check(f"line '{self.name}'", self.length, self.gradients, self.speed_limits)
        try:
            check_stops(self.stops, length=self.length)
        except Misfit as error:
            raise ParameterError(
                f"line '{self.name}': {place('stops', *error.path)}: {error.args[0]}"
            ) from None

    @property
    def interstations(self) -> tuple[tuple[str, str], ...]:
        """The pairs of neighbouring stops' names, in the line's direction."""
        return tuple((one.name, other.name) for one, other in pairwise(self.stops))

    def stop(self, name: str) -> Stop:
        """Return a stop by its name, in either script; case, spaces and hyphens do not matter.

        Raise ParameterError for an unknown name.
        """
        for stop in self.stops:
            if _plain(name) in (_plain(stop.name), _plain(stop.local_name)) and _plain(name):
                return stop
        names = [stop.name for stop in self.stops]
        near = suggest(name, names) or suggest(_plain(name).title(), names)
        raise ParameterError(
            f"no stop '{name}' on line '{self.name}'; stops: {listing(names, 60)}{near}"
        )

    def section(self, start: str, end: str, *, train_length: float = 0.0) -> Section:
        """Return the way from one stop to another without a halt between.

        Against the line's direction positions are mirrored and gradients negated. With a
        `train_length` (m) the speed limits are those of the train's front: a higher limit begins
        when the rear has reached it. Raise ParameterError for an unknown name, or one stop twice.
        """
        first, last = self.stop(start), self.stop(end)
        if first == last:
            raise ParameterError(f"'{start}' and '{end}' are the same stop of line '{self.name}'")
        if not 0.0 <= train_length < math.inf:
            raise ParameterError(f"the train's length must not be negative, but is {train_length}")
        begin, target = first.position, last.position
        gradients, limits = self.gradients, self.speed_limits
        if begin > target:
            begin, target = self.length - begin, self.length - target
            gradients = mirrored(gradients, self.length, sign=-1.0)
            limits = mirrored(limits, self.length)
        return Section(
            name=f"{first.name}–{last.name}",
            length=target - begin,
            gradients=cut(gradients, begin, target),
            speed_limits=cut(lowest_over(limits, train_length), begin, target),
        )


def check_stops(stops: tuple[Stop, ...], *, length: float) -> None:
    """Raise Misfit unless there are two stops or more, rising within the line, with names."""
    if len(stops) < 2:
        raise Misfit((), f"a line needs two stops or more, not {len(stops)}")
    check_rising([stop.position for stop in stops])
    names: dict[str, int] = {}
    for index, stop in enumerate(stops):
        if not 0.0 <= stop.position <= length:
            raise Misfit((index,), f"{stop.position:g} m is not on the line, 0 to {length:g} m")
        if not _plain(stop.name):
            raise Misfit((index,), "the stop has no name")
        for name in {_plain(stop.name), _plain(stop.local_name)} - {""}:
            if names.setdefault(name, index) != index:
                raise Misfit((index,), f"'{stop.name}' is also the name of stop {names[name]}")


def _check(owner: str, length: float, gradients: Steps, limits: Steps) -> None:
    if not 0.0 < length < math.inf:
        raise ParameterError(f"{owner}: the length must be positive and finite, not {length}")
    field = "gradients"
    try:
        check_gradients(gradients, length=length)
        field = "speed_limits"
        check_limits(limits, length=length)
    except Misfit as error:
        raise ParameterError(f"{owner}: {place(field, *error.path)}: {error.args[0]}") from None


def check_gradients(steps: Steps, *, length: float) -> None:
    """Raise Misfit unless the gradients (‰) are steps that a railway can have."""
    check_steps(steps, end=length, lowest=-STEEPEST, highest=STEEPEST, unit="‰")


def check_limits(steps: Steps, *, length: float) -> None:
    """Raise Misfit unless the speed limits (m/s) are steps above zero that a train can run."""
    check_steps(steps, end=length, lowest=SLOWEST, highest=FASTEST, unit="km/h", scale=3.6)


def _plain(name: str) -> str:
    return "".join(character for character in name.casefold() if character.isalnum())
