"""A port that is given a value."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ...base.errors import ParameterError
from ..blocks.profile import Profile
from .change import Fault


@dataclass(frozen=True, slots=True)
class Override(Fault):
    """A port carries `value`, or a `profile` over time, instead of its signal.

    The profile's points are (time in s, value), the time that of the run. Between them are straight
    lines, outside the first and last value is held; two points at one time make a jump.
    """

    value: float | None = None
    profile: Sequence[Sequence[float]] | None = None
    _profile: Profile | None = field(default=None, init=False, repr=False, compare=False)

    kind = "override"

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        if (self.value is None) == (self.profile is None):
            self.refuse("needs either a value or a profile")
        if self.profile is None:
            self._require_number("value")
            return
        try:
            points: Any = tuple(tuple(point) for point in self.profile)
        except TypeError:
            self.refuse(f"profile must be points (time, value), not {self.profile!r}")
        try:
            made = Profile(points)
        except ParameterError as error:
            self.refuse(f"profile: {str(error).removeprefix('Profile: ')}")
        object.__setattr__(self, "profile", made.points)
        object.__setattr__(self, "_profile", made)

    def act(self, u: Any, t: float, held: float) -> float:
        """Return the value at time t (s)."""
        if self._profile is not None:
            return float(self._profile.output((), t))
        assert self.value is not None
        return float(self.value)
