"""The heavy-haul train's equations in plain numpy, vehicle by vehicle, retyped for the tests."""

import math
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.models.consist import (
    Consist,
    Coupler,
    DraftGear,
    EndOfTrain,
    Points,
    PowerLaw,
    RunningResistance,
    ShoeBrake,
    Vehicle,
    c80,
    hxd1,
)

Array = NDArray[np.float64]
Line = list[tuple[float, float]]  # m, ‰
G = 9.81


def mixed_train() -> Consist:
    """Return vehicles and couplers of every kind, in no order, with three sources of the brake."""
    heavy, light, full, empty = hxd1(), hxd1(axle_load=23), c80(), c80(loaded=False)
    other = Vehicle(
        name="other", mass=61e3, length=17.5,
        resistance=RunningResistance(constant=1.1, linear=0.01, quadratic=3e-4, starting=4.2),
        brake=ShoeBrake(cylinders=2, shoes=16, cylinder_pressure=300e3, efficiency=0.8,
                        service=((0.0, 0.0), (40.0, 0.2), (140.0, 1.0))),
    )  # fmt: skip
    bare = Vehicle(name="bare", mass=45e3, length=9.0, resistance=other.resistance)
    mt2 = DraftGear(name="MT-2")
    cubic = DraftGear(
        name="cubic", stroke=0.12, loading=PowerLaw(initial_force=60e3, exponent=3.0),
        unloading_ratio=0.35, stiffness=120e6, stop_stiffness=150e6,
    )  # fmt: skip
    odd = DraftGear(name="odd", loading=PowerLaw(exponent=2.2), unloading_ratio=0.5)
    measured = DraftGear(
        name="measured", stroke=0.09, unloading_ratio=0.1,
        loading=Points(points=((0.0, 0.0), (0.01, 150e3), (0.05, 400e3), (0.09, 2e6))),
    )  # fmt: skip
    joints = [(mt2, 0.0095), (measured, 0.0), (cubic, 0.02), (mt2, 0.0), (odd, 0.0095),
              (measured, 0.012), (mt2, 0.0095), (cubic, 0.0), (odd, 0.03)]  # fmt: skip
    return Consist(
        name="mixed",
        vehicles=(heavy, full, other, light, empty, bare, full, heavy, other, empty),
        couplers=tuple(
            Coupler(gear=gear, slack=slack, damping=2e4 + 1e4 * i)
            for i, (gear, slack) in enumerate(joints)
        ),
        groups=((0, 3), (7,)),
        end_of_train=EndOfTrain(radio_delay=0.03),
        radio_delay=0.08,
    )  # fmt: skip


# Draft gears


def loading(gear: DraftGear, used: float) -> float:
    """Force (N) of a loaded gear at a stroke in use (m)."""
    used = min(max(used, 0.0), gear.stroke)
    law = gear.loading
    if isinstance(law, Points):
        strokes, forces = np.array(law.points).T
        return float(np.interp(used, strokes, forces))
    begin = law.initial_force * min(used / law.initial_stroke, 1.0)
    return begin + law.final_force * (used / gear.stroke) ** law.exponent


def bounds(joint: Coupler, d: float) -> tuple[float, float]:
    """Return lo and hi (N) of a joint at the stretch d (m), tension positive."""
    force = loading(joint.gear, abs(d) - joint.slack / 2.0)
    low = joint.gear.unloading_ratio * force
    return (low, force) if d > 0.0 else (-force, -low)


def moved(joint: Coupler, force: float, d: float, to: float) -> float:
    """Return the gear's force after a way d -> to on which d does not turn round."""
    low, high = bounds(joint, to)
    return min(max(force + joint.gear.stiffness * (to - d), low), high)


def stop_force(joint: Coupler, d: float) -> float:
    """Force (N) of the solid stop."""
    beyond = max(abs(d) - joint.slack / 2.0 - joint.gear.stroke, 0.0)
    return math.copysign(joint.gear.stop_stiffness * beyond, d)


# Vehicles


def resistance(v: float, part: RunningResistance) -> float:
    """Running resistance in N/kN; v in m/s."""
    speed = 3.6 * abs(v)
    formula = part.constant + part.linear * speed + part.quadratic * speed**2
    if speed >= 5.0:
        return formula
    if speed <= 2.5:
        return part.starting
    return part.starting + (speed - 2.5) / 2.5 * (formula - part.starting)


def shoe_force(brake: ShoeBrake | None, pressure: float, v: float) -> float:
    """Friction (N) of a vehicle's shoes at a cylinder pressure in kPa; sheet's eq. (7), in mm."""
    if brake is None:
        return 0.0
    bore = 1e3 * brake.cylinder_diameter
    k = math.pi / 4.0 * bore**2 * pressure * brake.efficiency * brake.rigging_ratio
    k *= brake.cylinders / (brake.shoes * 1e6)  # kN a shoe
    speed = 3.6 * abs(v)
    phi = 0.41 * (k + 200.0) / (4.0 * k + 200.0) * (speed + 150.0) / (2.0 * speed + 150.0)
    return 1e3 * brake.shoes * k * phi


def envelope(part: Any, v: float) -> float:
    """Largest force (N) at a speed of v (m/s), not negative."""
    if part is None:
        return 0.0
    speeds, forces = np.array(part.points).T
    force = float(np.interp(v, speeds, forces))
    return force if v <= 0.1 / 3.6 or part.power is None else min(force, part.power / v)


def locomotives(consist: Consist, demands: Array, v: Array) -> Array:
    """Forces (N) of all vehicles for the groups' demands (N)."""
    forces = np.zeros(consist.size)
    for demand, group in zip(demands, consist.groups, strict=True):
        for i in group:
            upper = envelope(consist.vehicles[i].traction, abs(v[i]))
            lower = envelope(consist.vehicles[i].electric_brake, max(v[i], 0.0))
            forces[i] = min(max(demand / len(group), -lower), upper)
    return forces


def height(line: Line, x: float) -> float:
    """Height (m) over that of position 0 of a line (position, ‰), of which the first goes back."""
    total = 1e-3 * line[0][1] * x
    for (_, before), (begin, slope) in pairwise(line):
        total += 1e-3 * (slope - before) * max(x - begin, 0.0)
    return total


def slopes(consist: Consist, line: Line, fronts: Array) -> Array:
    """Mean slope (‰) under each vehicle."""
    return np.array([
        1e3 * (height(line, x) - height(line, x - vehicle.length)) / vehicle.length
        for x, vehicle in zip(fronts, consist.vehicles, strict=True)
    ])  # fmt: skip


def accelerations(
    consist: Consist, forces: Array, couplers: Array, slope: Array
) -> Array:  # fmt: skip
    """Accelerations (m/s²) without friction: locomotives, couplers and gradients."""
    found = []
    for i, vehicle in enumerate(consist.vehicles):
        ahead = couplers[i - 1] if i > 0 else 0.0
        behind = couplers[i] if i < consist.size - 1 else 0.0
        found.append((ahead - behind + forces[i]) / vehicle.mass - G * slope[i] / 1000.0)
    return np.array(found)


# The brake pipe


def sources(consist: Consist) -> list[tuple[int, float]]:
    """Return (vehicle, radio delay in s) of all that vent the pipe, in the order of the inputs."""
    found = [(group[0], consist.radio_delay) for group in consist.groups]
    found[0] = (0, 0.0)
    if consist.end_of_train is not None:
        found.append((consist.size - 1, consist.end_of_train.radio_delay))
    return found


def arrivals(consist: Consist, speed: float) -> Array:
    """Return when (s) the wave of each source has passed each vehicle, [source × vehicle]."""
    ends = [0.0, *accumulate(v.length for v in consist.vehicles)]
    return np.array([
        [delay + (ends[max(i, at) + 1] - ends[min(i, at)]) / speed for i in range(consist.size)]
        for at, delay in sources(consist)
    ])  # fmt: skip


def pipe_rates(
    consist: Consist, reduction: Array, lead: Array, commands: Array
) -> tuple[Array, Array]:
    """Rates (kPa/s) of the pipe's reduction by the locomotives, and of the device's lead over it.

    For the sources' commands (kPa). With the device it is s = reduction + lead: it falls along with
    the other, and follows what the vehicle behind has over its own.
    """
    nearest = arrivals(consist, consist.application_speed)[: len(consist.groups)].argmin(axis=0)
    rates, gains = [], []
    for i, (vehicle, source) in enumerate(zip(consist.vehicles, nearest, strict=True)):
        at = sources(consist)[source][0]
        r = reduction[i]
        before = commands[source] if i == at else reduction[i + (1 if at > i else -1)]
        rates.append(lagged(consist, vehicle, before - r))
        s = r + lead[i]
        if i == consist.size - 1:
            to = max(r, commands[-1])
        else:
            to = max(r, min(r, reduction[i + 1]) + max(lead[i + 1], 0.0))
        gains.append(lagged(consist, vehicle, to - s) + min(rates[i], 0.0) - rates[i])
    return np.array(rates), np.array(gains)


def lagged(consist: Consist, vehicle: Vehicle, rise: float) -> float:
    """Rate (kPa/s) of a vehicle's part of the pipe for what it lacks (kPa)."""
    speed = consist.application_speed if rise > 0.0 else consist.release_speed
    return rise * speed / vehicle.length


def cylinder_rates(consist: Consist, pressure: Array, reduction: Array) -> Array:
    """Rates (kPa/s) of the cylinders' pressures."""
    rates = []
    for vehicle, p, r in zip(consist.vehicles, pressure, reduction, strict=True):
        target = 0.0
        if vehicle.brake is not None:
            reductions, shares = np.array(vehicle.brake.service).T
            target = vehicle.brake.cylinder_pressure / 1e3 * float(np.interp(r, reductions, shares))
        time = consist.application_time if target > p else consist.release_time
        rates.append((target - p) / time)
    return np.array(rates)
