"""The nonlinear program of a handling: its unknowns, constraints and cost."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .journey import SLOWEST, Aims, Journey
from .reduced import ReducedTrain
from .rigid import Array, RigidTrain

HUNDRED = 1e5  # N (of 100 kN), the unit of forces in the program
ROUNDING = 0.1  # 100 kN, over which max(F, 0) is rounded in the energy
JOINTS = 24  # couplers that are looked at, spread over the train
SHARP = 0.02  # of the full pressure; over it one time constant of the cylinders gives way
QUIET = {
    "expand": True,
    "print_time": False,
    "ipopt": {
        "print_level": 0, "sb": "yes", "tol": 1e-7, "max_iter": 150, "mu_strategy": "adaptive",
    },
}  # fmt: skip

Row = tuple[Any, float, float]
"""A constraint: its expression, and the bounds of it."""
Values = dict[str, Array]
"""The unknowns' values at the nodes by name, in SI units but for kPa."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Program:
    """Unknowns at the nodes: speed, force and, with `air`, reduction and cylinder."""

    train: ReducedTrain
    journey: Journey
    aims: Aims
    node: float
    rate: float
    share: float
    air: bool

    @cached_property
    def rigid(self) -> RigidTrain:
        """The train's reduced model."""
        return RigidTrain(train=self.train, section=self.journey.section)

    @cached_property
    def position(self) -> Array:
        """The nodes, in m."""
        count = math.ceil(self.journey.length / self.node - 1e-9)
        return np.linspace(self.journey.start, self.journey.end, count + 1)

    @cached_property
    def limits(self) -> Array:
        """The speed limits (m/s) of the whole train at the nodes."""
        steps = self.journey.section.speed_limits
        ends = [*(p for p, _ in steps[1:]), math.inf]
        found = np.full(len(self.position), math.inf)
        for (begin, limit), end in zip(steps, ends, strict=True):
            under = self.position - self.train.length < end
            under &= (self.position >= begin) | (begin == 0.0)
            found[under] = np.minimum(found[under], limit)
        return found

    @cached_property
    def joints(self) -> list[int]:
        """The couplers (from 0) that are looked at."""
        size = len(self.train.masses) - 1
        return sorted({round(i) for i in np.linspace(0, size - 1, min(size, JOINTS))})

    def solve(
        self, *, quickest: bool = False, applied: Array | None = None, start: Values | None = None
    ) -> Values | None:
        """Return the optimum, None if IPOPT finds none.

        `quickest` minimises the time, whatever the coupler forces. `applied` says at which nodes
        the air brake is. `start` is where to begin.
        """
        import casadi as ca

        count = len(self.position)
        x = {name: ca.MX.sym(name, count) for name in self.names}
        peak = ca.MX.sym("peak")
        coupler = self._coupler_forces(x)
        rows = [*self._motion(x), *self._envelopes(x)]
        if self.air:
            rows += self._cylinder(x, applied)
        if quickest:
            cost = ca.sum1(self._spans(x)) / self.journey.time + 1e-6 * peak
        else:
            cost = self._cost(x, coupler, peak)
            rows.append((ca.sum1(self._spans(x)) / self.journey.time, 1.0, 1.0))
            room = ca.repmat(peak, *coupler.shape)
            rows += [(ca.vec(room - coupler), 0.0, ca.inf), (ca.vec(room + coupler), 0.0, ca.inf)]
        problem = {
            "x": ca.vertcat(*x.values(), peak), "f": cost,
            "g": ca.vertcat(*(row for row, _, _ in rows)),
        }  # fmt: skip
        solver = ca.nlpsol("handling", "ipopt", problem, QUIET)
        lower, upper = self._bounds(applied)
        found = solver(
            x0=self._guess(start), lbx=lower, ubx=upper,
            lbg=np.concatenate([np.full(row.numel(), low) for row, low, _ in rows]),
            ubg=np.concatenate([np.full(row.numel(), high) for row, _, high in rows]),
        )  # fmt: skip
        if not solver.stats()["success"]:
            return None
        parts = np.array(found["x"]).ravel()[:-1].reshape(len(self.names), count)
        values = dict(zip(self.names, parts, strict=True))
        return {**values, "force": HUNDRED * values["force"]}

    @property
    def names(self) -> tuple[str, ...]:
        """The unknowns' names."""
        return ("speed", "force", *(("reduction", "cylinder") if self.air else ()))

    @cached_property
    def _loads(self) -> tuple[Array, Array]:
        """Gradient loads in 100 kN: of the train, and behind the couplers that are looked at."""
        total, behind = self.rigid.gradient_loads(self.position)
        return total / HUNDRED, behind[self.joints] / HUNDRED

    def _spans(self, x: dict[str, Any]) -> Any:
        """Return the times (s) between the nodes."""
        step = self.position[1] - self.position[0]
        return 2.0 * step / (x["speed"][:-1] + x["speed"][1:])

    def _shoes(self, x: dict[str, Any]) -> Any:
        """Return the air brake of one wagon in 100 kN."""
        brake = self.train.brake
        if brake is None or not self.air:
            return 0.0
        return brake.force(x["cylinder"], x["speed"]) / HUNDRED

    def _acceleration(self, x: dict[str, Any]) -> Any:
        drag = self.rigid.resistance(x["speed"]) / HUNDRED + self._loads[0]
        pull = x["force"] - drag - self.rigid.brakes * self._shoes(x)
        return pull * (HUNDRED / self.train.mass)

    def _coupler_forces(self, x: dict[str, Any]) -> Any:
        """Return the forces in 100 kN, couplers × nodes."""
        import casadi as ca

        a, shoes, rigid = self._acceleration(x), self._shoes(x), self.rigid
        rows = []
        for load, j in zip(self._loads[1], self.joints, strict=True):
            force = rigid.trailing_mass[j] / HUNDRED * a + load
            force = force + rigid.trailing_resistance(x["speed"], j) / HUNDRED
            force = force + rigid.trailing_brakes[j] * shoes
            rows.append((force - rigid.trailing_share[j] * x["force"]).T)
        return ca.vertcat(*rows)

    def _cost(self, x: dict[str, Any], coupler: Any, peak: Any) -> Any:
        import casadi as ca

        aims, spans = self.aims, self._spans(x)
        reference = aims.force / HUNDRED
        squares = ca.sum1(coupler * coupler).T / len(self.joints)
        mean = ca.dot(spans, squares[:-1] + squares[1:]) / 2.0 / self.journey.time
        change = coupler[:, 1:] - coupler[:, :-1]
        rates = ca.sum1(change * change).T / len(self.joints) / spans
        rate = ca.sum1(rates) / self.journey.time * aims.span**2
        pull = (x["force"] + ca.sqrt(x["force"] ** 2 + ROUNDING**2)) / 2.0
        energy = ca.sum1(pull) / pull.numel()
        cost = aims.rms * mean + aims.peak * peak * peak + aims.rate * rate
        return cost / reference**2 + aims.energy * energy / reference

    def _motion(self, x: dict[str, Any]) -> list[Row]:
        """Return what ties the nodes together, and the bound on the force's rate."""
        import casadi as ca

        step = self.position[1] - self.position[0]
        a, v, f = self._acceleration(x), x["speed"], x["force"]
        energy = (v[1:] ** 2 - v[:-1] ** 2) / step - (a[:-1] + a[1:])
        allowed = self._spans(x) * (self.rate / HUNDRED)
        change = f[1:] - f[:-1]
        return [
            (energy * 10.0, 0.0, 0.0), (allowed - change, 0.0, ca.inf),
            (allowed + change, 0.0, ca.inf),
        ]  # fmt: skip

    def _envelopes(self, x: dict[str, Any]) -> list[Row]:
        import casadi as ca

        v, f = x["speed"], x["force"]
        return [
            (self.share * self.train.traction.at(v) / HUNDRED - f, 0.0, ca.inf),
            (self.share * self.train.electric_brake.at(v) / HUNDRED + f, 0.0, ca.inf),
        ]

    def _cylinder(self, x: dict[str, Any], applied: Array | None) -> list[Row]:
        """Return how the cylinders follow: the quicker of two lags when the pressure rises."""
        import casadi as ca

        brake = self.train.brake
        assert brake is not None
        lag = brake.settled(x["reduction"]) - x["cylinder"]
        up, down = lag / brake.application_time, lag / brake.release_time
        rounding = SHARP / brake.application_time
        flow = (up + down + ca.sqrt((up - down) ** 2 + rounding**2) - rounding) / 2.0
        if brake.application_time > brake.release_time:
            flow = (up + down - ca.sqrt((up - down) ** 2 + rounding**2) + rounding) / 2.0
        spans, p = self._spans(x), x["cylinder"]
        rows: list[Row] = [(p[1:] - p[:-1] - spans * (flow[:-1] + flow[1:]) / 2.0, 0.0, 0.0)]
        if applied is not None:
            held = np.flatnonzero(applied[:-1] & applied[1:])  # never released in part
            if len(held):
                r = x["reduction"]
                rows.append((r[(held + 1).tolist()] - r[held.tolist()], 0.0, ca.inf))
        return rows

    def _bounds(self, applied: Array | None) -> tuple[Array, Array]:
        count, journey = len(self.position), self.journey
        lower = {"speed": np.full(count, SLOWEST), "force": np.full(count, -math.inf)}
        upper = {"speed": self.limits.copy(), "force": np.full(count, math.inf)}
        for bounds in (lower, upper):
            bounds["speed"][[0, -1]] = journey.start_speed, journey.end_speed
            bounds["force"][0] = 0.0
        brake = self.train.brake
        if self.air and brake is not None:
            held = np.ones(count, dtype=bool) if applied is None else applied
            least = 0.0 if applied is None else brake.minimum
            lower["reduction"] = np.where(held, least, 0.0)
            upper["reduction"] = np.where(held, brake.maximum, 0.0)
            lower["cylinder"], upper["cylinder"] = np.zeros(count), np.ones(count)
            for bounds in (lower, upper):
                bounds["cylinder"][0] = 0.0
        return tuple(
            np.append(np.concatenate([bounds[name] for name in self.names]), last)
            for bounds, last in ((lower, 0.0), (upper, math.inf))
        )  # pyright: ignore[reportReturnType]

    def _guess(self, start: Values | None) -> Array:
        """Return the values to begin with: those given, or an even run."""
        if start is not None:
            found = {**start, "force": start["force"] / HUNDRED}
        else:
            mean = min(self.journey.length / self.journey.time, float(self.limits.min()))
            speed = np.full(len(self.position), mean)
            speed[[0, -1]] = self.journey.start_speed, self.journey.end_speed
            force = self.rigid.resistance(mean) / HUNDRED + self._loads[0]
            zero = np.zeros(len(speed))
            found = {"speed": speed, "force": force, "reduction": zero, "cylinder": zero}
        return np.append(np.concatenate([found[name] for name in self.names]), 10.0)
