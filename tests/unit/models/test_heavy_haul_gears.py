"""The heavy-haul train's draft gears: drawn along paths, against the curves and their integrals."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from railcosim.fmus import build
from railcosim.models.consist import Consist, DraftGear, PowerLaw, coal_train
from railcosim.models.heavy_haul import heavy_haul_train
from railcosim.models.heavy_haul.couplers import loading_curve
from tests import heavy_haul_reference as reference
from tests.heavy_haul import Array, FMU2Train, Laws


def random_path(generator: Any, joints: int, reach: float, turns: int) -> Array:
    """Return turning points [turn × joint] from 0 to 0."""
    path = generator.uniform(-reach, reach, (turns, joints))
    path[0] = path[-1] = 0.0
    return path


def sampled(path: Array, steps: int) -> Array:
    """Return the path with so many steps between turning points."""
    share = np.linspace(0.0, 1.0, steps + 1)[1:, None]
    pieces = [a + share * (b - a) for a, b in pairwise(path)]
    return np.concatenate([path[:1], *pieces])


class Joints:
    """A consist's joints, drawn along a path of stretches."""

    def __init__(self, consist: Consist, coupler: Any = "incremental") -> None:
        plant = heavy_haul_train(consist, hysteresis=coupler)
        memories = [f"coupler[].{name}" for name in ("gear_force", "gear_work")]
        memories += ["coupler[].branch"] if coupler == "dahl" else []
        self.update = Laws(
            plant, *(f"update({name})" for name in memories),
            given=("coupler[].stretch", "vehicle[].displacement", "vehicle[].speed", *memories),
        )  # fmt: skip
        self.energy = Laws(plant, "energy.gears", "energy.gears_stored",
                           given=("coupler[].stretch", *memories[:2]))  # fmt: skip
        self.none = [np.zeros(consist.size - 1) for _ in memories]

    def drawn(self, path: Array, speed: float = 0.0) -> tuple[Array, Array, Array, Array]:
        """Return forces and works [row × joint], heat in the gears and energy stored [row]."""
        memories, before, rows = self.none, path[0], []
        for d in path:
            place = np.concatenate([[0.0], -np.cumsum(d)])
            way = np.concatenate([[0.0], -np.cumsum(d - before)])
            memories = self.update(before, place, speed * way, *memories)
            before = d
            heat, stored = self.energy(d, *memories[:2])
            rows.append((*memories[:2], heat[0], stored[0]))
        force, work, heat, stored = (np.array(column) for column in zip(*rows, strict=True))
        return force, work, heat, stored


@pytest.mark.parametrize("coupler", ["incremental", "dahl"])
def test_closed_cycles_dissipate_and_stay_between_the_curves(coupler: str) -> None:
    consist = reference.mixed_train()
    path = sampled(random_path(np.random.default_rng(1), consist.size - 1, 0.15, 8), 60)
    force, work, _, _ = Joints(consist, coupler).drawn(path)
    for d, row in zip(path, force, strict=True):
        for joint, stretch, f in zip(consist.couplers, d, row, strict=True):
            low, high = reference.bounds(joint, stretch)
            assert low - 1e-6 <= f <= high + 1e-6  # N, of MN: rounding
    trapezoids = 0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0)
    assert work[-1] == pytest.approx(trapezoids.sum(axis=0), rel=1e-9)
    assert (force[-1] == 0.0).all()  # closed: at rest again as at the start
    assert (work[-1] > 1e3).all()


@pytest.mark.parametrize("coupler", ["incremental", "dahl"])
def test_the_force_is_the_ways_and_not_the_speeds(coupler: str) -> None:
    """Three speeds, to the last bit; and however finely the same way is gone (incremental)."""
    consist = reference.mixed_train()
    turns = random_path(np.random.default_rng(2), consist.size - 1, 0.12, 10)
    joints = Joints(consist, coupler)
    path = sampled(turns, 12)
    slow, middle, fast = (joints.drawn(path, speed)[0] for speed in (1.0, 30.0, 1000.0))
    assert (slow == middle).all()
    assert (slow == fast).all()
    if coupler == "dahl":
        return
    for steps in (1, 3, 60):
        force, *_ = joints.drawn(sampled(turns, steps))
        assert np.abs(force[::steps] - slow[::12]).max() < 1e-6  # N
    expected = [np.zeros(consist.size - 1)]
    for before, after in pairwise(turns):
        expected.append(np.array([
            reference.moved(joint, *step)
            for joint, *step in zip(consist.couplers, expected[-1], before, after, strict=True)
        ]))  # fmt: skip
    assert np.abs(slow[::12] - np.array(expected)).max() < 1e-6


def test_heat_never_flows_back_and_what_is_stored_comes_back() -> None:
    """The account's heat does not fall along a way; at rest again all of the work is heat."""
    consist = reference.mixed_train()
    path = sampled(random_path(np.random.default_rng(3), consist.size - 1, 0.11, 8), 300)
    _, work, heat, stored = Joints(consist).drawn(path)
    total = work[-1].sum()
    assert heat[-1] == pytest.approx(total, rel=1e-9)
    assert stored[-1] == pytest.approx(0.0, abs=1e-3)
    assert stored.min() >= -1e-6 * total
    assert np.diff(heat).min() > -1e-5 * total  # the trapezoids, over a kink


def test_a_full_stroke_takes_119_kj_and_gives_a_fifth_back() -> None:
    """59.7 kJ a gear; on the way back first down the slope of 80 MN/m, then along 0.2 fu."""
    consist = coal_train(locomotives=1, wagons=1)

    def upper(e: float) -> float:
        return 100e3 * min(e / 0.004, 1.0) + 2170e3 * (e / 0.166) ** 2.5

    loaded, _ = quad(upper, 0.0, 0.166, points=[0.004], epsabs=1e-6)
    assert loaded / 2.0 == pytest.approx(59.7e3, rel=1e-3)
    back, _ = quad(
        lambda e: max(2270e3 - 80e6 * (0.166 - e), 0.2 * upper(e)), 0.0, 0.166,
        points=[0.004, 0.14, 0.145], epsabs=1e-6, limit=500,
    )  # fmt: skip
    end = 0.166 + 0.0095 / 2.0
    path = sampled(np.array([[0.0], [end], [0.0]]), 1000)
    force, work, heat, stored = Joints(consist).drawn(path)
    assert force[1000, 0] == pytest.approx(2270e3, rel=1e-9)
    assert work[1000, 0] == pytest.approx(loaded, rel=1e-5)
    assert stored[1000] == pytest.approx(back, rel=1e-5)
    assert work[-1, 0] == pytest.approx(loaded - back, rel=1e-5)
    assert heat[-1] == pytest.approx(loaded - back, rel=1e-5)


@pytest.mark.parametrize("exponent", [1.0, 1.2, 1.5, 2.0, 2.2, 2.5, 3.0])
def test_at_rest_the_curves_have_their_slopes(exponent: float) -> None:
    """The derivatives of a power at zero are numbers: the curve begins with its first part."""
    law = PowerLaw(exponent=exponent)
    gear = DraftGear(name="gear", loading=law, stiffness=200e6)
    d = ca.MX.sym("d")
    slope = ca.Function("slope", [d], [ca.jacobian(loading_curve(gear, d), d)])
    first = 100e3 / 0.004 + (2170e3 / 0.166 if exponent == 1.0 else 0.0)
    assert float(slope(0.0)) == pytest.approx(first, rel=1e-12)
    for way in (1.0, -1.0):
        expected = 2170e3 * exponent * 0.08 ** (exponent - 1.0) / 0.166**exponent
        assert float(slope(0.08 * way)) == pytest.approx(expected, rel=1e-12)


def test_a_stretched_start_is_a_way_from_rest(tmp_path: Path) -> None:
    """The Dahl form over the start's stretch, retyped: its branch goes with its force."""
    stretch, path = 0.02, build(heavy_haul_train(coal_train(wagons=1), hysteresis="dahl"))
    places = np.array([2.0, 1.0, 0.0]) * stretch
    train = FMU2Train(path, tmp_path, {"vehicle[].displacement": places})
    loading = 100e3 + 2170e3 * ((stretch - 0.0095 / 2.0) / 0.166) ** 2.5
    low, high = 0.2 * loading, loading
    branch = 1.0 - np.exp(-stretch * 80e6 / (high - low + 10e3))
    force = 0.5 * (high + low) + 0.5 * (high - low) * branch
    assert train.take("coupler[].branch") == pytest.approx([branch] * 2, rel=1e-12)
    assert train.take("coupler[].gear_force") == pytest.approx([force] * 2, rel=1e-12)
