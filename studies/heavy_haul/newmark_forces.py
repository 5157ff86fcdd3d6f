"""The forces of the heavy-haul train's Newmark reference, each with its slope, in numpy.

Written from the equations, on their own: nothing is shared with the plant they are a check of.
Tags: paper (the heavy-haul paper), from memory, our choice.
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...base.errors import ParameterError
from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from ...models.consist import Consist, Coupler, Envelope, PowerLaw

Array = NDArray[Any]
STANDING, ROLLING = 2.5, 5.0  # km/h; the starting resistance is blended out between; our choice


class Couplers:
    """The couplers' forces over stretch d (m) and its rate (m/s), tension positive.

    With e = max(|d| − slack/2, 0) the gear's force stays between the unloading and the loading
    curve, fl = ratio · fu, mirrored for d < 0, and is 0 in the slack. Between the curves it goes
    with the stiffness k from where it was: F = clip(F_prev + k Δd, lo(d), hi(d)). The paper's
    equations (8) to (10) are lost; this reconstruction is our choice. Beside the gear act a solid
    stop beyond the stroke (spring, elastic) and a viscous damping, in the slack as well; ours.
    """

    def __init__(self, couplers: Sequence[Coupler]) -> None:
        gears = [each.gear for each in couplers]
        self.half_slack = np.array([each.slack / 2.0 for each in couplers])
        self.damping = np.array([each.damping for each in couplers])
        self.stroke = np.array([gear.stroke for gear in gears])
        self.ratio = np.array([gear.unloading_ratio for gear in gears])
        self.stiffness = np.array([gear.stiffness for gear in gears])
        self.stop = np.array([gear.stop_stiffness for gear in gears])
        laws = [g.loading if isinstance(g.loading, PowerLaw) else None for g in gears]
        self.initial = np.array([law.initial_force if law else 0.0 for law in laws])
        self.corner = np.array([law.initial_stroke if law else 1.0 for law in laws])
        self.final = np.array([law.final_force if law else 0.0 for law in laws])
        self.power = np.array([law.exponent - 1.0 if law else 0.0 for law in laws])
        measured: dict[Any, list[int]] = {}
        for i, gear in enumerate(gears):
            if not isinstance(gear.loading, PowerLaw):
                measured.setdefault(gear.loading.points, []).append(i)
        self.measured = [(np.array(at), np.array(points)) for points, at in measured.items()]

    def loading(self, used: Array) -> tuple[Array, Array]:
        """Return fu (N) at a stroke in use (m) and its slope (N/m); flat beyond the stroke."""
        within = np.minimum(used, self.stroke)
        share = within / self.stroke
        steep = self.final * share**self.power
        force = self.initial * np.minimum(within / self.corner, 1.0) + steep * share
        slope = self.initial / self.corner * (within < self.corner)
        slope += (self.power + 1.0) / self.stroke * steep
        for at, points in self.measured:
            force[at] = np.interp(within[at], points[:, 0], points[:, 1])
            segment = np.searchsorted(points[1:-1, 0], within[at], side="right")
            slope[at] = (np.diff(points[:, 1]) / np.diff(points[:, 0]))[segment]
        slope[used >= self.stroke] = 0.0
        return force, slope

    def gear(self, stretch: Array, force: Array, before: Array) -> tuple[Array, Array, Array]:
        """Return the gears' forces, those with the stops, and the slope of the latter (N/m).

        `force` and `before` are the gears' force and stretch at the last converged step.
        """
        size = np.abs(stretch)
        sign = np.sign(stretch)
        used = np.maximum(size - self.half_slack, 0.0)
        upper, slope = self.loading(used)
        lower = self.ratio * upper
        trial = sign * (force + self.stiffness * (stretch - before))
        held = np.minimum(np.maximum(trial, lower), upper)
        slope = np.where(
            trial >= upper, slope, np.where(trial <= lower, self.ratio * slope, self.stiffness)
        )
        slope *= used > 0.0
        beyond = used - self.stroke
        if beyond.max() <= 0.0:
            return sign * held, sign * held, slope
        total = held + self.stop * np.maximum(beyond, 0.0)
        return sign * held, sign * total, slope + self.stop * (beyond > 0.0)


class Friction:
    """Running resistance and shoe brake: dry friction of the vehicles, against their motion.

    w = A + B V + C V² in N/kN with V in km/h (paper, eqs. 5 and 6), the starting resistance in
    its place up to 2.5 km/h and blended out up to 5 km/h (ours; the paper has it up to 5 km/h).
    Brake: FB = nk K φ, K = π/4 dz² pz ηz γz nz/nk, φ = 0.41 (K + 200)/(4K + 200) ·
    (V + 150)/(2V + 150) with K in kN: the paper's eq. 7 in the usual form, from memory.
    """

    def __init__(self, consist: Consist) -> None:
        resistances = [each.resistance for each in consist.vehicles]
        weight = GRAVITY_PER_MILLE * np.array([each.mass for each in consist.vehicles])
        self.constant, self.linear, self.quadratic, self.starting = (
            weight * np.array([getattr(each, name) for each in resistances])
            for name in ("constant", "linear", "quadratic", "starting")
        )
        brakes = [each.brake for each in consist.vehicles]
        self.shoes = np.array([b.shoes if b else 1 for b in brakes])
        self.lever = np.array([  # m²: N a shoe for 1 Pa in the cylinder
            np.pi / 4.0 * b.cylinder_diameter**2 * b.efficiency * b.rigging_ratio
            * b.cylinders / b.shoes if b else 0.0
            for b in brakes
        ])  # fmt: skip

    def shoe(self, pressure: Array) -> Array:
        """Return the brake forces (N) at standstill at the cylinder pressures (Pa)."""
        shoe = self.lever * pressure
        k = 1e-3 * shoe
        return self.shoes * shoe * 0.41 * (k + 200.0) / (4.0 * k + 200.0)

    def force(self, speed: Array, shoe: Array | None) -> tuple[Array, Array]:
        """Return the friction (N) in motion, and its slope over |v| (N·s/m).

        `shoe` are the brake forces at standstill, None where no brake acts.
        """
        v = KILOMETRES_PER_HOUR * np.abs(speed)
        force = self.constant + v * (self.linear + v * self.quadratic)
        slope = self.linear + 2.0 * self.quadratic * v
        if v.min() < ROLLING:
            raw = (v - STANDING) / (ROLLING - STANDING)
            share = np.minimum(np.maximum(raw, 0.0), 1.0)
            blending = raw == share
            excess = force - self.starting
            slope = share * slope + blending * excess / (ROLLING - STANDING)
            force = self.starting + share * excess
        if shoe is not None:
            below = 2.0 * v + 150.0
            force = force + shoe * (v + 150.0) / below
            slope = slope - shoe * 150.0 / below**2
        return force, KILOMETRES_PER_HOUR * slope


class Locomotives:
    """The force of the locomotives: a group's demand in equal shares, within each one's envelopes.

    Traction is positive whichever way the vehicle moves. Electric braking is negative, and to a
    vehicle that rolls backwards what its curve has at rest: nothing, as it begins with 0.
    """

    def __init__(self, consist: Consist) -> None:
        self.groups = len(consist.groups)
        kinds: dict[Any, list[tuple[int, int]]] = {}
        for number, group in enumerate(consist.groups):
            for index in group:
                vehicle = consist.vehicles[index]
                key = (vehicle.traction, vehicle.electric_brake)
                kinds.setdefault(key, []).append((index, number))
        share = np.array([1.0 / len(group) for group in consist.groups])
        self.kinds = [
            (_Limit(traction), _Limit(brake), *(at := np.array(members).T), share[at[1]])
            for (traction, brake), members in kinds.items()
        ]
        self.none = np.zeros(consist.size)

    def force(self, demand: Array, speed: Array) -> tuple[Array, Array]:
        """Return the forces (N) of all vehicles and their slopes over speed (N·s/m)."""
        if not demand.any():
            return self.none, self.none
        forces, slopes = self.none.copy(), self.none.copy()
        for traction, brake, index, group, share in self.kinds:
            wanted = share * demand[group]
            for limit, sign in ((traction, 1.0), (brake, -1.0)):
                asked = np.maximum(sign * wanted, 0.0)
                if asked.any():
                    v = speed[index]
                    most, slope = limit.at(np.abs(v) if sign > 0.0 else np.maximum(v, 0.0))
                    by_speed = np.sign(v) if sign > 0.0 else v > 0.0
                    forces[index] += sign * np.minimum(asked, most)
                    slopes[index] += sign * by_speed * slope * (asked > most)
        return forces, slopes

    def applied(self, forces: Array) -> Array:
        """Return what each group applies in all (N)."""
        total = np.zeros(self.groups)
        for _, _, index, group, _ in self.kinds:
            np.add.at(total, group, forces[index])
        return total


class _Limit:
    """An envelope: linear between its points, as the end ones beyond, and at most power/speed."""

    def __init__(self, envelope: Envelope | None) -> None:
        points = envelope.points if envelope else ((0.0, 0.0),)
        self.speeds, self.forces = np.array(points).T
        inclines = np.diff(self.forces) / np.diff(self.speeds)
        self.inclines = np.concatenate(([0.0], inclines, [0.0]))
        self.power = envelope.power if envelope else None

    def at(self, speed: Array) -> tuple[Array, Array]:
        """Return the largest force (N) at speeds (m/s, not negative) and its slope (N·s/m)."""
        limit = np.interp(speed, self.speeds, self.forces)
        slope = self.inclines[self.speeds.searchsorted(speed, side="right")]
        if self.power is not None and (weak := limit * speed > self.power).any():
            safe = np.where(weak, speed, 1.0)
            limit = np.where(weak, self.power / safe, limit)
            slope = np.where(weak, -self.power / safe**2, slope)
        return limit, slope


class Gradients:
    """The line's slope: (position in m, ‰) where each stretch begins; the first holds before it.

    A vehicle takes each change in as it moves onto it: its slope is the mean over its length.
    Raise ParameterError for other than such pairs, or places that do not rise.
    """

    def __init__(self, consist: Consist, stretches: Sequence[tuple[float, float]]) -> None:
        table = np.array(stretches, dtype=float)
        if table.ndim != 2 or table.shape[1] != 2 or not (np.diff(table[:, 0]) > 0.0).all():
            raise ParameterError(
                f"gradients must be (position in m, ‰) pairs with rising positions, "
                f"not {stretches!r}"
            )
        begins, slopes = table.T
        self.weight = GRAVITY_PER_MILLE * np.array([each.mass for each in consist.vehicles])
        self.length = np.array([each.length for each in consist.vehicles])
        self.begins = begins[1:, None]
        self.changes = np.diff(slopes)[:, None]
        self.constant = cast(Array, self.weight * slopes[0])

    def force(self, front: Array) -> tuple[Array, Array]:
        """Return what pulls the vehicles back (N), and its slope over their front's place (N/m)."""
        if not self.begins.size:
            return self.constant, np.zeros(())
        share = (front - self.begins) / self.length
        inside = (share > 0.0) & (share < 1.0)
        grade = (self.changes * np.clip(share, 0.0, 1.0)).sum(axis=0)
        slope = (self.changes * inside).sum(axis=0) / self.length
        return self.constant + self.weight * grade, self.weight * slope
