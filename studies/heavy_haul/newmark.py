"""The heavy-haul paper's own method, as a reference: Newmark-β with equilibrium iterations.

The paper integrates the train with a "high-precision balance iteration based on Newmark-β" and says
no more. Here that is Newmark's method (A method of computation for structural dynamics, J. Eng.
Mech. Div. ASCE 85, 1959) with a full Newton iteration in each step (Bathe, Finite Element
Procedures, ch. 9), until the forces are in balance. Equations and solver are separate from the
plant's, so the two can check each other.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import get_lapack_funcs

from ...base.errors import ConvergenceError, ParameterError
from ...models.consist import Consist
from .newmark_brake import AirBrake
from .newmark_forces import Array, Couplers, Friction, Gradients, Locomotives

(_tridiagonal,) = get_lapack_funcs(("gtsv",), dtype=np.float64)  # LAPACK's dgtsv
Demand = Callable[[float], ArrayLike] | ArrayLike


@dataclass(frozen=True, kw_only=True)
class Newmark:
    """The method's numbers: β = 1/4, γ = 1/2 is the trapezoidal rule, of order 2, without damping.

    A step has converged when no vehicle's forces are out of balance by more than `tolerance` (N);
    after `iterations` without that it fails. Tolerance and iterations are our choice.
    """

    beta: float = 0.25
    gamma: float = 0.5
    tolerance: float = 1e-3
    iterations: int = 50

    def __post_init__(self) -> None:
        if not self.beta > 0.0 or not self.gamma >= 0.5:  # below 1/2 it gains energy
            raise ParameterError(
                f"Newmark needs beta > 0 and gamma >= 1/2, not {self.beta:g} and {self.gamma:g}"
            )
        if not self.tolerance > 0.0 or self.iterations < 1:
            raise ParameterError("Newmark needs a tolerance above 0 N and at least one iteration")


@dataclass(frozen=True, kw_only=True)
class NewmarkRun:
    """What a run gave. Arrays have one row per recorded step, the first at 0 s.

    `coupler_force` (N, tension positive, damping included), one column per coupler; `speed` (m/s),
    `position` (m, of the front end on the line), `reduction` (kPa), `pressure` (Pa, in the
    cylinder), one per vehicle; `applied` (N), one per group of locomotives. `highest` and `lowest`
    are the extremes of the coupler forces over all steps, recorded or not. `iterations` counts the
    evaluations of balance over all steps, `most` those of the worst one.
    """

    time: Array
    coupler_force: Array
    speed: Array
    position: Array
    reduction: Array
    pressure: Array
    applied: Array
    highest: Array
    lowest: Array
    iterations: int
    most: int

    @property
    def peak(self) -> Array:
        """The largest magnitude (N) of each coupler's force over all steps."""
        return np.maximum(self.highest, -self.lowest)

    @property
    def standing(self) -> NDArray[np.intp]:
        """How many vehicles are at rest, per row."""
        return np.count_nonzero(self.speed == 0.0, axis=1)


def simulate(
    consist: Consist,
    *,
    stop: float,
    step: float = 1e-3,
    force: Demand = 0.0,
    reduction: Demand = 0.0,
    end_of_train: Demand = 0.0,
    gradients: Sequence[tuple[float, float]] = ((0.0, 6.0),),
    speed: ArrayLike = 0.0,
    location: float = 0.0,
    displacement: ArrayLike = 0.0,
    record: int = 1,
    method: Newmark = Newmark(),
) -> NewmarkRun:
    """Return the motion of a train from 0 to `stop` s in steps of `step` s.

    `force` (N, what each group of locomotives is to give, traction positive) and `reduction` (kPa,
    of the brake pipe at each group) are functions of the time in s, or arrays with a row for each
    step from 0 on, or constants: one value per group, or one for all. So is `end_of_train` (kPa),
    without groups. They go linearly over a step, so a jump is a ramp over the step before it.
    Forces act within the locomotives' envelopes; neither their rate nor a radio delay is modelled.
    `gradients` are (position in m, ‰), see Gradients; the default is the slope of the paper's line.
    `speed` (m/s) and `displacement` (m, from the places of a train without coupler forces whose
    front is at `location` m) are for all vehicles or for each. Every `record`th step is kept.

    Raise ParameterError for what cannot be simulated, ConvergenceError for a step without balance.
    """
    if not 0.0 < step <= stop or record < 1:
        raise ParameterError(
            f"a Newmark run needs 0 < step <= stop and record >= 1, not step {step:g} s, "
            f"stop {stop:g} s, record {record}"
        )
    steps = round(stop / step)
    time = step * np.arange(steps + 1)
    groups = len(consist.groups)
    demand = _sampled("force", force, time, groups)
    sources = _sampled("reduction", reduction, time, groups)
    rear = _sampled("end_of_train", end_of_train, time, 1)
    if consist.end_of_train:
        sources = np.hstack((sources, rear))
    elif rear.any():
        raise ParameterError(f"{consist.name} has no end-of-train device; leave end_of_train out")
    brake = AirBrake(consist)
    train = _Train(consist, method, step, gradients, location)
    train.place(_each("displacement", displacement, consist), _each("speed", speed, consist))
    train.start(demand[0])
    kept = [train.row(brake)]
    highest, lowest = train.total.copy(), train.total.copy()
    counts = np.zeros(steps, dtype=int)
    braking = np.flatnonzero(sources.any(axis=1))
    first = braking[0] if braking.size else steps + 1  # up to there the brake stays released
    for k in range(1, steps + 1):
        if k >= first:
            brake.advance(step, sources[k - 1], sources[k])
            train.brake(brake.pressure)
        counts[k - 1] = train.advance(demand[k], float(time[k]))
        np.maximum(highest, train.total, out=highest)
        np.minimum(lowest, train.total, out=lowest)
        if k % record == 0:
            kept.append(train.row(brake))
    forces, speeds, positions, reductions, pressures, applied = (
        np.array(rows) for rows in zip(*kept, strict=True)
    )
    return NewmarkRun(
        time=time[::record], coupler_force=forces, speed=speeds, position=positions,
        reduction=reductions, pressure=pressures, applied=applied, highest=highest, lowest=lowest,
        iterations=int(counts.sum()), most=int(counts.max()),
    )  # fmt: skip


class _Train:
    """The state of a run at its last converged step, and the step.

    The unknown of a step is Δv. With it a₁ = Δv/(γh) − (1−γ)/γ a₀ and
    u₁ = u₀ + h v₀ + h² ((½−β) a₀ + β a₁), and the balance is M a₁ = forces(u₁, v₁).

    Friction is set-valued at rest. Each vehicle has a direction: ±1, friction opposes it with its
    full force; 0, the vehicle is held at exactly v = 0 and a = 0, its balance left out. Directions
    change within the Newton iteration (an active set): a vehicle that would reverse is held, one
    that friction cannot hold is let go. The coupled problem has an M-matrix, so this ends.
    """

    def __init__(
        self,
        consist: Consist,
        method: Newmark,
        step: float,
        gradients: Sequence[tuple[float, float]],
        location: float,
    ) -> None:
        self.method, self.step = method, step
        self.mass = np.array([each.mass for each in consist.vehicles])
        lengths = np.array([each.length for each in consist.vehicles])
        self.origin = location - np.concatenate(([0.0], np.cumsum(lengths)[:-1]))
        self.couplers = Couplers(consist.couplers)
        self.friction = Friction(consist)
        self.locomotives = Locomotives(consist)
        self.gradients = Gradients(consist, gradients)
        self.shoe: Array | None = None
        self.holds = self.friction.starting > 0.0  # a vehicle without friction at rest cannot stick
        self.driving = np.zeros(consist.size)

    def place(self, displacement: Array, speed: Array) -> None:
        """Set the train out, with couplers as near to no force as their stretch allows."""
        self.u, self.v = displacement, speed
        self.a = np.zeros_like(speed)
        self.stretch = displacement[:-1] - displacement[1:]
        none = np.zeros_like(self.stretch)
        self.held, self.total, _ = self.couplers.gear(self.stretch, none, self.stretch)
        self.total += self.couplers.damping * (speed[:-1] - speed[1:])

    def start(self, demand: Array) -> None:
        """Find who is held and the accelerations at the start."""
        self.driving, _ = self.locomotives.force(demand, self.v)
        net = self.driving - self.gradients.force(self.origin + self.u)[0] - _pull(self.total)
        friction, _ = self.friction.force(self.v, self.shoe)
        slips = np.where(np.abs(net) > friction, np.sign(net), 0.0)
        rest = np.where(self.holds, slips, 1.0)
        self.direction = np.where(self.v != 0.0, np.sign(self.v), rest)
        self.a = np.where(self.direction, (net - self.direction * friction) / self.mass, 0.0)

    def brake(self, pressure: Array) -> None:
        """Take in the cylinders' pressures (Pa)."""
        self.shoe = self.friction.shoe(pressure)
        self.holds = self.friction.starting + self.shoe > 0.0

    def advance(self, demand: Array, time: float) -> int:
        """Go one step on to `time`, under `demand` (N); return how often balance was evaluated."""
        h, beta, gamma = self.step, self.method.beta, self.method.gamma
        reach = beta * h / gamma  # m of u₁ for 1 m/s of Δv
        drift = h * self.v + (0.5 - beta) * h * h * self.a
        carried = (1.0 - gamma) / gamma * self.a
        direction = self.direction
        dv = np.where(direction == 0.0, -self.v, h * self.a)
        worst, count = np.zeros(1), 0
        for _ in range(self.method.iterations):
            count += 1
            v = self.v + dv
            a = dv / (gamma * h) - carried
            u = drift + beta * h * h * a  # less u₀: differences of it are free of cancellation
            stretch = self.stretch + (u[:-1] - u[1:])
            held, total, slope = self.couplers.gear(stretch, self.held, self.stretch)
            total = total + self.couplers.damping * (v[:-1] - v[1:])
            driving, by_speed = self.locomotives.force(demand, v)
            weight, by_place = self.gradients.force(self.origin + self.u + u)
            friction, by_rate = self.friction.force(v, self.shoe)
            net = driving - weight - _pull(total)
            before = direction
            direction = self._directions(direction, v, net, net - self.mass * a, friction)
            free = direction != 0.0
            if ((before != 0.0) & ~free).any():  # newly held: elsewhere in the step than thought
                dv = np.where(free, dv, -self.v)
                continue
            worst = (self.mass * a - net + direction * friction) * free
            if np.abs(worst).max() <= self.method.tolerance:
                break
            own = self.mass / (gamma * h) - by_speed + reach * by_place + by_rate
            dv = dv - _solved(own, reach * slope + self.couplers.damping, free, worst)
        else:
            raise ConvergenceError(_failure(time, worst, self.method))
        self.u, self.v, self.a = self.u + u, v, a * free
        self.stretch, self.held, self.total = stretch, held, total
        self.direction, self.driving = direction, driving
        return count

    def _directions(
        self, direction: Array, v: Array, net: Array, needed: Array, friction: Array
    ) -> Array:
        """Return the directions for an iterate: who is held, who slides which way.

        A vehicle is let go only where friction could neither keep it at rest (`net`, N) nor bring
        it to rest within the step (`needed`, N).
        """
        ahead = np.where(v < 0.0, -1.0, 1.0)
        slides = np.where(self.holds, direction * (direction * v >= 0.0), ahead)
        at_rest = self.holds & (direction == 0.0)
        if not at_rest.any():
            return slides
        forwards = np.minimum(net, needed) > friction
        backwards = np.maximum(net, needed) < -friction
        return np.where(at_rest, forwards * 1.0 - backwards, slides)

    def row(self, brake: AirBrake) -> tuple[Array, ...]:
        """Return what is recorded of the present step."""
        applied = self.locomotives.applied(self.driving)
        place = self.origin + self.u
        return (self.total, self.v, place, brake.reduction, brake.pressure, applied)


def _pull(coupler: Array) -> Array:
    """Return what the couplers hold each vehicle back with (N)."""
    pull = np.zeros(coupler.size + 1)
    pull[:-1] = coupler
    pull[1:] -= coupler
    return pull


def _solved(own: Array, shared: Array, free: Array, residual: Array) -> Array:
    """Return Δv's correction from the tridiagonal tangent, zero for vehicles that are held.

    LAPACK's solver for it is called as it is: scipy's `solve_banded`, which calls the same, takes
    ten times as long over its checks.
    """
    diagonal = own.copy()
    diagonal[:-1] += shared
    diagonal[1:] += shared
    aside = -shared * (free[:-1] & free[1:])
    *_, solution, info = _tridiagonal(aside, diagonal, aside, residual)
    return solution if info == 0 else np.full_like(residual, np.nan)


def _failure(time: float, worst: Array, method: Newmark) -> str:
    at = int(np.argmax(np.abs(worst)))
    return (
        f"Newmark step to {time:g} s: vehicle {at + 1} is out of balance by {worst[at]:.3g} N "
        f"after {method.iterations} iterations, over {method.tolerance:g} N; take a shorter step"
    )


def _sampled(name: str, demand: Demand, time: Array, columns: int) -> Array:
    """Return a demand at each step, [steps + 1 × columns]."""
    if callable(demand):
        values = np.array([np.broadcast_to(demand(float(t)), columns) for t in time], dtype=float)
    else:
        values = np.asarray(demand, dtype=float)
    if values.shape == time.shape:
        values = values[:, None]
    try:
        values = np.broadcast_to(values, (time.size, columns))
    except ValueError:
        raise ParameterError(
            f"{name} must have {time.size} rows (one per step, from 0 s on) of {columns} values, "
            f"not the shape {values.shape}"
        ) from None
    if not np.isfinite(values).all():
        raise ParameterError(f"{name} has values that are not finite numbers")
    return values


def _each(name: str, value: ArrayLike, consist: Consist) -> Array:
    """Return one value per vehicle."""
    values = np.asarray(value, dtype=float)
    if values.shape not in ((), (consist.size,)) or not np.isfinite(values).all():
        raise ParameterError(f"{name} must be a number or {consist.size} of them, all finite")
    return np.broadcast_to(values, consist.size).copy()
