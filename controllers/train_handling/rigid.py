"""The reduced model: a rigid train on its line, and the coupler forces that follow from it."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from .checks import require_kind, require_section
from .reduced import ReducedTrain

if TYPE_CHECKING:
    from ...models.line import Section

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidTrain:
    """A train that moves as one body along a section: all vehicles have one speed v.

    M a = F − R(v) − G(s) − B, with the gradient of each vehicle at its own place (the mean over its
    length), and for the coupler behind vehicle j

        F_j = Σ_{i>j} (m_i a + R_i(v) + G_i(s) + B_i − share_i F):

    what is in front does not matter. This is exact as long as all vehicles accelerate alike: forces
    in a chain follow from equilibrium, whatever the draft gears' curves. What it leaves out are the
    waves in the train and the run-ins and run-outs of its slack. Our choice. Raise ParameterError
    for what is no train or no section.
    """

    train: ReducedTrain
    section: "Section"

    def __post_init__(self) -> None:
        remedy = "reduced_train(consist) gives one"
        require_kind("rigid train", "train", self.train, ReducedTrain, remedy)
        require_section("rigid train", self.section)

    @cached_property
    def behind(self) -> Array:
        """How far (m) each vehicle's front is behind the train's."""
        return np.concatenate([[0.0], np.cumsum(self.train.lengths)[:-1]])

    @cached_property
    def trailing_mass(self) -> Array:
        """The mass (kg) behind each coupler."""
        return _trailing(np.asarray(self.train.masses))

    @cached_property
    def trailing_share(self) -> Array:
        """The share of the locomotives' force that acts behind each coupler."""
        return _trailing(np.asarray(self.train.shares))

    @cached_property
    def trailing_brakes(self) -> Array:
        """The number of braked wagons behind each coupler."""
        braked = self.train.braked or (False,) * len(self.train.masses)
        return _trailing(np.asarray(braked, dtype=float))

    @cached_property
    def brakes(self) -> int:
        """The number of braked wagons."""
        return sum(self.train.braked)

    @cached_property
    def _coefficients(self) -> tuple[Array, Array]:
        """Resistance in N over 1, v, v² (v in m/s): of the train, and behind each coupler."""
        scale = np.array([1.0, KILOMETRES_PER_HOUR, KILOMETRES_PER_HOUR**2])
        weights = GRAVITY_PER_MILLE * np.asarray(self.train.masses)
        each = weights[:, None] * np.asarray(self.train.resistances) * scale
        return each.sum(axis=0), _trailing(each)

    def resistance(self, speed: Any) -> Any:
        """Return the running resistance (N) of the train; the speed (m/s) may be a symbol."""
        a, b, c = self._coefficients[0]
        return a + b * speed + c * speed * speed

    def trailing_resistance(self, speed: Any, joint: int) -> Any:
        """Return the running resistance (N) behind a coupler (from 0)."""
        a, b, c = self._coefficients[1][joint]
        return a + b * speed + c * speed * speed

    def gradient_loads(self, position: Any) -> tuple[Array, Array]:
        """Return what gradients pull back (N), of the train and behind each coupler.

        For fronts at n positions (m): arrays of n, and of couplers × n.
        """
        front = np.atleast_1d(np.asarray(position, dtype=float)) - self.behind[:, None]
        lengths = np.asarray(self.train.lengths)[:, None]
        rise = self._elevation(front) - self._elevation(front - lengths)
        weights = 1e3 * GRAVITY_PER_MILLE * np.asarray(self.train.masses)[:, None]
        loads = weights * rise / lengths
        return loads.sum(axis=0), _trailing(loads)

    def _elevation(self, position: Array) -> Array:
        """Return the height (m) over the departure; before it the first gradient holds."""
        starts, slopes = (np.array(column) for column in zip(*self.section.gradients, strict=True))
        heights = np.concatenate([[0.0], np.cumsum(np.diff(starts) * slopes[:-1])]) / 1e3
        k = np.clip(np.searchsorted(starts, position, side="right") - 1, 0, None)
        return heights[k] + slopes[k] * (position - starts[k]) / 1e3

    def acceleration(self, load: Any, speed: Any, force: Any, share: Any = 0.0) -> Any:
        """Return a (m/s²) under a gradient load and a force (N), the cylinders at a `share`."""
        return (
            force - self.resistance(speed) - load - self.braking(share, speed)
        ) / self.train.mass

    def braking(self, share: Any, speed: Any) -> Any:
        """Return the force (N) of all shoes with the cylinders at a share of full pressure."""
        brake = self.train.brake
        return 0.0 if brake is None else self.brakes * brake.force(share, speed)

    def coupler_forces(self, position: Any, speed: Any, force: Any, share: Any = 0.0) -> Array:
        """Return the forces (N) of all couplers × n, tension positive, for n points of a run.

        `force` (N) is that of all locomotives; `share` that of the cylinders' full pressure.
        """
        speed, force, share = (np.asarray(x, dtype=float) for x in (speed, force, share))
        total, behind = self.gradient_loads(position)
        a = self.acceleration(total, speed, force, share)
        powers = np.stack([np.ones_like(speed), speed, speed * speed])
        found = np.outer(self.trailing_mass, a) + behind + self._coefficients[1] @ powers
        found -= np.outer(self.trailing_share, force)
        if self.train.brake is not None:
            shoes = np.asarray(self.train.brake.force(share, speed)) + np.zeros_like(speed)
            found += np.outer(self.trailing_brakes, shoes)
        return found


def _trailing(values: Array) -> Array:
    """Return the sums over all vehicles behind each coupler."""
    return np.cumsum(values[::-1], axis=0)[::-1][1:]
