"""A handling: how the locomotives and the air brake are used along a way."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...base.errors import ParameterError

Array = np.ndarray[Any, Any]


class Figures(NamedTuple):
    """What a handling comes to in the reduced model: N, N, N, N/s, J, J, s."""

    tension: float
    compression: float
    rms: float
    rate: float
    traction: float
    electric_brake: float
    time: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Handling:
    """The plan at places of the train's front, straight lines between them.

    `position` (m, rising), `speed` (m/s), `force` (N, of all locomotives, electric brake negative),
    `reduction` (kPa, of the brake pipe), `cylinder` (share of the full pressure), and `coupler` (N,
    couplers × places): the forces in the reduced model. `notch` (N) is what the force is a multiple
    of but while it changes; 0 if it may be any. Raise ParameterError for arrays that do not fit.
    """

    position: Array
    speed: Array
    force: Array
    reduction: Array
    cylinder: Array
    coupler: Array
    notch: float = 0.0

    def __post_init__(self) -> None:
        shapes = {a.shape for a in (self.speed, self.force, self.reduction, self.cylinder)}
        size = len(self.position)
        if shapes != {(size,)} or self.coupler.shape[1:] != (size,) or size < 2:
            raise ParameterError("handling: its arrays need one entry for each place, two or more")
        if not (np.diff(self.position) > 0.0).all() or not (self.speed > 0.0).all():
            raise ParameterError("handling: places must rise, and speeds be positive")

    @cached_property
    def time(self) -> Array:
        """The time (s) from the start at each place: constant acceleration between them."""
        spans = 2.0 * np.diff(self.position) / (self.speed[:-1] + self.speed[1:])
        return np.concatenate([[0.0], np.cumsum(spans)])

    @property
    def running_time(self) -> float:
        """From the first to the last place, in s."""
        return float(self.time[-1])

    def figures(self) -> Figures:
        """Return what it comes to in the reduced model; means are over time and couplers."""
        spans = np.diff(self.time)
        squares = np.mean(self.coupler**2, axis=0)
        mean = np.sum(spans * (squares[:-1] + squares[1:])) / 2.0 / self.running_time
        rates = np.diff(self.coupler, axis=1) / spans
        force = (self.force[:-1] + self.force[1:]) / 2.0
        work = force * np.diff(self.position)
        return Figures(
            tension=float(self.coupler.max()),
            compression=float(-self.coupler.min()),
            rms=float(np.sqrt(mean)),
            rate=float(np.abs(rates).max()),
            traction=float(work[work > 0.0].sum()),
            electric_brake=float(-work[work < 0.0].sum()),
            time=self.running_time,
        )
