"""The Newmark reference of the heavy-haul train, against what is known without it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from railcosim.base.errors import ConvergenceError, ParameterError
from railcosim.models.consist import (
    Consist,
    Coupler,
    DraftGear,
    Envelope,
    Points,
    PowerLaw,
    RunningResistance,
    Vehicle,
    coal_train,
    mt2,
)
from railcosim.studies.heavy_haul.newmark import Newmark, simulate
from railcosim.studies.heavy_haul.newmark_forces import Couplers, Friction, Gradients

LEVEL = ((0.0, 0.0),)
GRAVITY = 9.81
FREE = RunningResistance(constant=0.0, linear=0.0, quadratic=0.0, starting=0.0)
STRONG = Envelope(points=((0.0, 2e6), (50.0, 2e6)))
STROKE = 0.5
Array = NDArray[Any]


def spring(stiffness: float) -> DraftGear:
    """Return a gear that is a linear spring: one line for loading and unloading."""
    law = PowerLaw(initial_force=0.0, final_force=stiffness * STROKE, exponent=1.0)
    return DraftGear(
        name="spring", stroke=STROKE, loading=law, unloading_ratio=1.0, stiffness=stiffness
    )


def train(
    masses: Sequence[float],
    gear: DraftGear,
    *,
    slack: float = 0.0,
    damping: float = 0.0,
    resistance: RunningResistance = FREE,
) -> Consist:
    vehicles = [
        Vehicle(name=f"v{i}", mass=mass, length=12.0, resistance=resistance)
        for i, mass in enumerate(masses)
    ]
    vehicles[0] = replace(vehicles[0], traction=STRONG, electric_brake=STRONG)
    coupler = Coupler(gear=gear, slack=slack, damping=damping)
    return Consist(
        name="test", vehicles=tuple(vehicles), couplers=(coupler,) * (len(masses) - 1)
    )  # fmt: skip


def without_resistance(consist: Consist) -> Consist:
    vehicles = tuple(replace(each, resistance=FREE) for each in consist.vehicles)
    return replace(consist, vehicles=vehicles)


def test_two_masses_follow_the_rule_s_own_frequency() -> None:
    m, k, h, d = (80e3, 120e3), 20e6, 2e-3, 0.02
    run = simulate(
        train(m, spring(k)), stop=1.0, step=h, gradients=LEVEL, displacement=(d, 0.0)
    )  # fmt: skip
    omega = np.sqrt(k * sum(m) / (m[0] * m[1]))
    angle = 2.0 * np.arctan(omega * h / 2.0)  # the trapezoidal rule turns exactly by this
    expected = k * d * np.cos(angle * np.arange(run.time.size))
    np.testing.assert_allclose(run.coupler_force[:, 0], expected, atol=1e-8 * k * d)
    energy = (0.5 * np.array(m) * run.speed**2).sum(axis=1) + run.coupler_force[:, 0] ** 2 / (2 * k)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


def test_a_chain_converges_with_order_two() -> None:
    m, k, c, pull, stop = np.array([2e5, 1e5, 6e4, 9e4]), 30e6, 4e5, 1e5, 0.4
    joints = np.eye(3, 4) - np.eye(3, 4, 1)
    zero = np.zeros((4, 4))
    system = np.zeros((9, 9))  # u, v and a constant 1
    chain = -joints.T @ joints / m[:, None]
    system[:8, :8] = np.block([[zero, np.eye(4)], [k * chain, c * chain]])
    system[4, 8] = pull / m[0]
    exact = (expm(system * stop) @ np.array([0.0] * 8 + [1.0]))[:8]
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        run = simulate(
            train(list(m), spring(k), damping=c), stop=stop, step=h, force=pull, gradients=LEVEL
        )  # fmt: skip
        errors.append(np.abs(run.speed[-1] - exact[4:]).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)
    assert errors[2] < 1e-4 * exact[4:].max()


def test_a_train_pulled_steadily_shares_the_force_by_trailing_mass() -> None:
    m = np.array([2e5, 1e5, 1e5, 6e4, 2e4])
    run = simulate(
        train(list(m), spring(40e6), damping=1e6), stop=8.0, step=5e-3,
        force=lambda t: 3e5 * min(t / 2.0, 1.0), gradients=LEVEL,
    )  # fmt: skip
    trailing = m.sum() - np.cumsum(m)[:-1]
    np.testing.assert_allclose(run.coupler_force[-1], 3e5 * trailing / m.sum(), rtol=1e-6)
    np.testing.assert_allclose(run.speed[-1], 3e5 * 7.0 / m.sum(), rtol=1e-6)


def test_momentum_is_kept_to_round_off_and_gears_only_take_energy() -> None:
    consist = without_resistance(coal_train(wagons=12))
    m = np.array([each.mass for each in consist.vehicles])
    speed = np.random.default_rng(3).uniform(8.0, 12.0, m.size)
    run = simulate(consist, stop=3.0, step=2e-3, gradients=LEVEL, speed=speed)
    assert run.peak.max() > 1e6
    np.testing.assert_allclose(run.speed @ m, speed @ m, rtol=1e-13)
    assert run.speed[-1] ** 2 @ m < speed**2 @ m


def loading(used: float) -> float:
    """Return fu of the MT-2 pair; written out anew, as are the other laws here."""
    return 100e3 * min(used / 0.004, 1.0) + 2170e3 * (used / 0.166) ** 2.5


def test_an_impact_goes_as_far_as_its_energy() -> None:
    m, slack, closing = 100e3, 0.02, 2.0
    run = simulate(
        train((m, m), mt2(), slack=slack), stop=0.5, step=2.5e-4, gradients=LEVEL,
        speed=(0.0, closing),
    )  # fmt: skip
    energy = 0.5 * (m / 2.0) * closing**2
    solved: Any = brentq(lambda e: quad(loading, 0.0, e)[0] - energy, 0.01, 0.166)
    deepest = float(solved)
    assert -run.coupler_force.min() == pytest.approx(loading(deepest), rel=1e-4)
    assert deepest < 0.166

    def unloading(used: float) -> float:
        return max(0.2 * loading(used), loading(deepest) - 80e6 * (deepest - used))

    returned = quad(unloading, 0.0, deepest, limit=200)[0]
    apart = (run.speed[:, 0] - run.speed[:, 1]).max()
    assert apart == pytest.approx(np.sqrt(returned / (0.25 * m)), rel=2e-3)


CURVE = Points(points=((0.0, 0.0), (0.02, 4e5), (0.1, 9e5), (0.166, 2.2e6)))
GEARS = [mt2(), replace(mt2(), loading=CURVE), replace(mt2(), unloading_ratio=0.0)]


@pytest.mark.parametrize("gear", GEARS)
def test_the_force_stays_within_its_loop_and_its_slope_is_its_derivative(gear: DraftGear) -> None:
    couplers = Couplers([Coupler(gear=gear, slack=0.0095)])
    path = np.cumsum(np.random.default_rng(5).normal(0.0, 4e-3, 600))
    path = 0.18 * np.sin(path) + 1e-3 * np.sin(77.0 * path)
    force, before, small = np.zeros(1), np.zeros(1), 1e-9
    wrong = 0
    for stretch in path[:, None]:
        used = np.maximum(np.abs(stretch) - 0.00475, 0.0)
        upper = gear.force(float(used[0]))
        held, total, slope = couplers.gear(stretch, force, before)
        inside = float((np.sign(stretch) * held)[0])
        assert gear.unloading_ratio * upper - 1e-6 <= inside <= upper + 1e-6
        stop = 100e6 * np.maximum(used - 0.166, 0.0)
        np.testing.assert_allclose(total - held, np.sign(stretch) * stop, atol=1e-6)
        ends = [couplers.gear(stretch + s, force, before)[1] for s in (-small, small)]
        wrong += not np.isclose((ends[1] - ends[0]) / (2.0 * small), slope, rtol=1e-3, atol=1e3)
        force, before = held, stretch
    assert wrong <= 2  # a corner between -small and small


def test_friction_is_the_vehicles_and_its_slope_its_derivative() -> None:
    consist = coal_train(wagons=1, locomotives=1)
    friction = Friction(consist)
    pressure = np.array([0.0, 378e3])
    wagon = consist.vehicles[1].brake
    assert wagon is not None
    k = 1e-3 * np.pi / 4.0 * 0.254**2 * 378e3 * 0.9 * 8.4 / 8  # kN a shoe
    for speed in (0.0, 0.3, 0.9, 1.2, 1.5, 20.0):
        force, slope = friction.force(np.full(2, speed), friction.shoe(pressure))
        v = 3.6 * speed
        phi = 0.41 * (k + 200.0) / (4.0 * k + 200.0) * (v + 150.0) / (2.0 * v + 150.0)
        dry = [GRAVITY * 1e-3 * each.mass * each.resistance.at(speed) for each in consist.vehicles]
        np.testing.assert_allclose(force, [dry[0], dry[1] + 8e3 * k * phi], rtol=1e-12)
        ahead, back = (
            friction.force(np.full(2, speed + s), friction.shoe(pressure))[0] for s in (1e-6, -1e-6)
        )
        if speed:
            np.testing.assert_allclose((ahead - back) / 2e-6, slope, rtol=1e-5, atol=1e-2)


DRY = RunningResistance(constant=4.0, linear=0.0, quadratic=0.0, starting=4.0)


def test_dry_friction_stops_a_train_and_leaves_it_there() -> None:
    rate = 4e-3 * GRAVITY
    run = simulate(
        train((1e5,) * 4, mt2(), damping=5e4, resistance=DRY), stop=60.0, step=1e-2, speed=2.0,
        gradients=((0.0, 3.0),),
    )  # fmt: skip
    stops = 2.0 / (1.75 * rate)  # uphill both work
    sliding = run.time < stops
    np.testing.assert_allclose(
        run.speed[sliding, 2], 2.0 - 1.75 * rate * run.time[sliding], atol=1e-9
    )
    assert (run.standing[~sliding] == 4).all()
    np.testing.assert_array_equal(run.speed[~sliding], 0.0)
    np.testing.assert_array_equal(np.ptp(run.position[~sliding], axis=0), 0.0)
    assert run.position[-1, 0] == pytest.approx(2.0**2 / (3.5 * rate), abs=1e-3)


def test_a_slope_above_the_friction_starts_the_train_and_one_below_does_not() -> None:
    consist = train((1e5,) * 4, mt2(), damping=5e4, resistance=DRY)
    held = simulate(consist, stop=2.0, step=1e-2, gradients=((0.0, 3.999),))
    assert (held.standing == 4).all()
    rolls = simulate(consist, stop=2.0, step=1e-2, gradients=((0.0, 5.0),))
    np.testing.assert_allclose(rolls.speed[-1], -2.0 * 1e-3 * GRAVITY, rtol=1e-12)
    pulled = simulate(consist, stop=2.0, step=1e-2, gradients=LEVEL, force=4e-3 * GRAVITY * 1e5)
    assert (pulled.standing == 4).all()
    loose = train((1e5,) * 4, mt2(), slack=0.01, resistance=DRY)
    off = simulate(loose, stop=0.2, step=1e-2, gradients=LEVEL, force=5e-3 * GRAVITY * 1e5)
    np.testing.assert_allclose(off.speed[-1], [0.2 * 1e-3 * GRAVITY, 0.0, 0.0, 0.0], rtol=1e-12)


def test_a_braked_train_stops_on_the_slope_and_does_not_creep() -> None:
    run = simulate(
        coal_train(wagons=6), stop=25.0, step=2e-2, speed=3.0,
        reduction=lambda t: min(100.0 * t, 150.0),
    )  # fmt: skip
    last = np.flatnonzero(run.standing < run.speed.shape[1])[-1]
    assert 5.0 < run.time[last] < 20.0  # the locomotives, which are not braked, settle last
    np.testing.assert_array_equal(np.ptp(run.position[last + 1 :], axis=0), 0.0)
    np.testing.assert_array_equal(np.ptp(run.coupler_force[last + 1 :], axis=0), 0.0)


def test_a_vehicle_takes_the_slope_in_over_its_length() -> None:
    consist = coal_train(wagons=3)
    line = ((0.0, 2.0), (100.0, -3.0), (104.0, 8.0), (190.0, 1.0))
    gradients = Gradients(consist, line)
    along = np.array([90.0, 101.0, 110.0, 198.0, 300.0])

    def slope(x: float) -> float:
        return [g for begin, g in line if begin <= x or begin == 0.0][-1]

    force, rate = gradients.force(along)
    for i, vehicle in enumerate(consist.vehicles):
        places = along[i] - vehicle.length * (np.arange(20000) + 0.5) / 20000
        mean = np.mean([slope(x) for x in places])
        assert force[i] == pytest.approx(1e-3 * GRAVITY * vehicle.mass * mean, rel=1e-3)
    near = (gradients.force(along + 1e-4)[0] - gradients.force(along - 1e-4)[0]) / 2e-4
    np.testing.assert_allclose(rate, near, atol=1e-3)


def test_the_groups_share_and_keep_within_their_envelopes() -> None:
    consist = coal_train(wagons=6, distributed=True)
    run = simulate(
        consist, stop=10.0, step=2e-2, force=(2e6, -2e6), gradients=LEVEL, speed=(15.0,) * 8
    )  # fmt: skip
    for column, at, sign in ((0, 0, 1.0), (1, consist.groups[1][0], -1.0)):
        vehicle = consist.vehicles[at]
        envelope = vehicle.traction if sign > 0.0 else vehicle.electric_brake
        assert envelope is not None
        expected = [sign * envelope.at(v) for v in run.speed[1:, at]]
        np.testing.assert_allclose(run.applied[1:, column], expected, rtol=1e-12)
    run = simulate(coal_train(wagons=3), stop=0.1, force=[3e5], gradients=LEVEL)
    assert run.applied[-1] == pytest.approx(3e5)


FADING = Envelope(points=((0.0, 0.0), (2.0, 1e6), (50.0, 1e6)))


def test_a_train_that_rolls_back_has_no_electric_brake() -> None:
    bare = train((2e5, 1e5, 1e5), mt2(), damping=5e4)
    first = replace(bare.vehicles[0], electric_brake=FADING)
    consist = replace(bare, vehicles=(first, *bare.vehicles[1:]))
    back, alone = (
        simulate(consist, stop=2.0, step=1e-2, speed=-1.0, force=f, gradients=((0.0, 10.0),))
        for f in (-5e5, 0.0)
    )
    np.testing.assert_array_equal(back.applied, 0.0)
    np.testing.assert_array_equal(back.speed, alone.speed)
    np.testing.assert_allclose(back.speed[-1], -1.0 - 2.0 * 1e-2 * GRAVITY, rtol=1e-9)
    # Uphill it brakes, and no longer once the train comes back.
    turns = simulate(
        consist, stop=8.0, step=1e-2, speed=0.5, force=-5e5, gradients=((0.0, 10.0),)
    )  # fmt: skip
    ahead = turns.speed[1:, 0] > 0.0
    np.testing.assert_allclose(turns.applied[1:][ahead, 0], -5e5 * turns.speed[1:][ahead, 0])
    np.testing.assert_array_equal(turns.applied[1:][~ahead, 0], 0.0)
    assert (turns.speed[-1] < -0.3).all()


def test_the_peak_of_a_violent_start_does_not_depend_on_the_step() -> None:
    runs = [
        simulate(
            coal_train(wagons=20), stop=3.5, step=h, force=lambda t: min(4e5 * t, 1.14e6),
            gradients=LEVEL, record=100,
        )
        for h in (5e-3, 2e-3)
    ]  # fmt: skip
    assert runs[0].peak.max() == pytest.approx(runs[1].peak.max(), rel=0.005)
    assert runs[0].most < 8
    again = simulate(
        coal_train(wagons=20), stop=3.5, step=5e-3, force=lambda t: min(4e5 * t, 1.14e6),
        gradients=LEVEL, record=100,
    )  # fmt: skip
    np.testing.assert_array_equal(again.coupler_force, runs[0].coupler_force)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stop": 1.0, "step": 2.0}, "0 < step <= stop"),
        ({"stop": 1.0, "force": (1.0, 2.0)}, "force must have 1001 rows"),
        ({"stop": 1.0, "force": float("nan")}, "not finite"),
        ({"stop": 1.0, "end_of_train": 50.0}, "no end-of-train device"),
        ({"stop": 1.0, "gradients": ((0.0, 6.0), (-5.0, 3.0))}, "rising positions"),
        ({"stop": 1.0, "speed": (1.0, 2.0)}, "speed must be a number or 5"),
    ],
)
def test_what_cannot_be_simulated_is_said(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        simulate(coal_train(wagons=3), **options)


def test_no_balance_is_an_error_and_so_are_a_method_s_wrong_numbers() -> None:
    with pytest.raises(ConvergenceError, match="out of balance by .* take a shorter step"):
        simulate(coal_train(wagons=3), stop=1.0, force=1e6, method=Newmark(iterations=1))
    with pytest.raises(ParameterError, match="gamma >= 1/2"):
        Newmark(gamma=0.4)
    with pytest.raises(ParameterError, match="tolerance"):
        Newmark(tolerance=0.0)
