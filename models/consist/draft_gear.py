"""What joins two vehicles: the draft gears with their loading curve, slack and damping; SI."""

from dataclasses import dataclass, field
from itertools import pairwise
from math import isclose

from numpy import interp

from .checks import Check, Pairs, settle

STIFFEST = 2000.0  # MN/m; how stiff it may be between two vehicles, a Consist says


@dataclass(frozen=True, kw_only=True)
class PowerLaw:
    """A loading curve fu(e) = initial_force min(e/initial_stroke, 1) + final_force (e/stroke)^n.

    Forces in N, `initial_stroke` in m; e is the joint's stroke in use, `stroke` the gear's and n
    the `exponent`. The numbers are those of two MT-2 in series, 2.27 MN at 166 mm together; that
    end is from a public page, the curve to it our choice. Raise ParameterError for what cannot be.
    """

    initial_force: float = 100e3
    initial_stroke: float = 0.004
    final_force: float = 2170e3
    exponent: float = 2.5

    def __post_init__(self) -> None:
        check = Check("power law")
        check.within(("initial_force",), self.initial_force, 0.0, 5e3, "kN", 1e-3)
        check.within(("initial_stroke",), self.initial_stroke, 0.1, 1e3, "mm", 1e3)
        check.within(("final_force",), self.final_force, 10.0, 20e3, "kN", 1e-3)
        check.within(("exponent",), self.exponent, 1.0, 20.0, "")

    def force(self, used: float, stroke: float) -> float:
        """Return fu in N at a stroke in use (m, not negative) of a gear with `stroke` (m)."""
        start = self.initial_force * min(used / self.initial_stroke, 1.0)
        return start + self.final_force * (used / stroke) ** self.exponent

    def steepest(self, stroke: float) -> float:
        """Return the largest slope in N/m of the curve of a gear with `stroke` (m)."""
        slope = self.final_force * self.exponent / stroke
        corner = self.initial_stroke / stroke
        begin = self.initial_force / self.initial_stroke + slope * corner ** (self.exponent - 1.0)
        return max(begin, slope)


@dataclass(frozen=True, kw_only=True)
class Points:
    """A measured loading curve: (stroke in use in m, force in N) pairs from (0, 0) to the stroke.

    Both rise strictly; linear between. Raise ParameterError for a curve that cannot be.
    """

    points: Pairs

    def __post_init__(self) -> None:
        check = Check("loading curve")
        points = check.pairs(("points",), self.points)
        settle(self, "points", points)
        if points[0] != (0.0, 0.0):
            check.fail(("points", 0), "the first point must be 0 mm with 0 kN")
        check.rising(("points",), [used for used, _ in points], 0, "mm", 1e3)
        check.rising(("points",), [force for _, force in points], 1, "kN", 1e-3)
        check.within(("points", len(points) - 1, 1), points[-1][1], 10.0, 20e3, "kN", 1e-3)

    def force(self, used: float, stroke: float) -> float:
        """Return fu in N at a stroke in use (m, not negative)."""
        strokes, forces = zip(*self.points, strict=True)
        return float(interp(used, strokes, forces))

    def steepest(self, stroke: float) -> float:
        """Return the largest slope in N/m."""
        return max((up - low) / (far - near) for (near, low), (far, up) in pairwise(self.points))


@dataclass(frozen=True, kw_only=True)
class DraftGear:
    """The draft gears of a joint, taken as one: MT-2, two in series, unless said otherwise.

    `stroke` in m per joint. Loading the force follows `loading` (fu), unloading it follows
    `unloading_ratio` fu, and between the two it moves with `stiffness` in N/m. Beyond the stroke a
    solid stop, an elastic spring of `stop_stiffness` in N/m, acts beside the gear, whose fu stays
    what it is at the stroke. Stroke: public page (83 mm each); ratio, stiffnesses: our choice.
    Raise ParameterError for a gear that cannot be.
    """

    name: str
    stroke: float = 0.166
    loading: PowerLaw | Points = field(default_factory=PowerLaw)
    unloading_ratio: float = 0.2
    stiffness: float = 80e6
    stop_stiffness: float = 100e6

    def __post_init__(self) -> None:
        Check("draft gear").name(self.name)
        check = Check(f"draft gear '{self.name}'")
        check.within(("stroke",), self.stroke, 5.0, 1000.0, "mm", 1e3)
        check.kind(("loading",), self.loading, PowerLaw, Points)
        check.within(("unloading_ratio",), self.unloading_ratio, 0.0, 1.0, "")
        check.within(("stiffness",), self.stiffness, 1.0, STIFFEST, "MN/m", 1e-6)
        check.within(("stop_stiffness",), self.stop_stiffness, 1.0, STIFFEST, "MN/m", 1e-6)
        if isinstance(self.loading, Points):
            end = self.loading.points[-1][0]
            if not isclose(end, self.stroke, rel_tol=1e-9):
                check.fail(
                    ("loading", "points"),
                    f"the curve ends at {1e3 * end:g} mm, not at the stroke, "
                    f"{1e3 * self.stroke:g} mm",
                )
        elif self.loading.initial_stroke > self.stroke:
            check.fail(
                ("loading", "initial_stroke"),
                f"{1e3 * self.loading.initial_stroke:g} mm is beyond the stroke, "
                f"{1e3 * self.stroke:g} mm",
            )
        steepest = self.loading.steepest(self.stroke)
        if self.stiffness < steepest * (1.0 - 1e-9):
            check.fail(
                ("stiffness",),
                f"{1e-6 * self.stiffness:g} MN/m is less than the loading curve's steepest slope, "
                f"so the force could not follow it; at least {1e-6 * steepest:.4g} MN/m is needed",
            )

    def force(self, used: float) -> float:
        """Return the largest force in N at a stroke in use (m), without the solid stop."""
        return self.loading.force(min(max(used, 0.0), self.stroke), self.stroke)


@dataclass(frozen=True, kw_only=True)
class Coupler:
    """The joint between two neighbours: its gears, `slack` in m in all, `damping` in N·s/m.

    A drawbar has no slack. The slack of the Chinese couplers 16 and 17 and the damping are our
    choice. Raise ParameterError for what cannot be.
    """

    gear: DraftGear
    slack: float = 0.0095
    damping: float = 5e4

    def __post_init__(self) -> None:
        check = Check("coupler")
        check.kind(("gear",), self.gear, DraftGear)
        check.within(("slack",), self.slack, 0.0, 200.0, "mm", 1e3)
        check.within(("damping",), self.damping, 0.0, 1e4, "kN·s/m", 1e-3)
