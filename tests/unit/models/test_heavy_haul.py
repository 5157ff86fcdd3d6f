"""The heavy-haul train's laws, one by one, against formulas retyped and against integrals."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

from railcosim.base.errors import ParameterError
from railcosim.models import Plant
from railcosim.models.consist import Consist, Coupler, EndOfTrain, coal_train, hxd1, mt2
from railcosim.models.heavy_haul import heavy_haul_train
from tests import heavy_haul_reference as reference
from tests.heavy_haul import Array, Laws

KMH = 1.0 / 3.6
SPEEDS = np.linspace(0.0, 130.0, 261)  # km/h
DEVICE = coal_train(end_of_train=EndOfTrain())
LINE = [(0.0, 4.0), (150.0, -6.0), (170.0, 0.0), (260.0, 12.0)]  # m, ‰


# Locomotives


def pair() -> Plant:
    return heavy_haul_train(coal_train(locomotives=1, wagons=1))


def traction(speed: float, axle_load: int) -> float:
    """N at km/h, as the paper's data sheet has it."""
    flat, line = (760.0, 779.0 - 3.8 * speed) if axle_load == 25 else (700.0, 715.8 - 3.169 * speed)
    return 1e3 * min(flat, line, 34560.0 / max(speed, 0.1))


@pytest.mark.parametrize("axle_load", [25, 23])
def test_envelopes_are_the_sheets_and_continuous(axle_load: int) -> None:
    """As many locomotives as there are speeds, each a group of its own."""
    engine, size = hxd1(axle_load=axle_load), SPEEDS.size
    consist = Consist(
        name="engines", vehicles=(engine,) * size, couplers=(Coupler(gear=mt2()),) * (size - 1),
        groups=tuple((i,) for i in range(size)),
    )  # fmt: skip
    laws = Laws(heavy_haul_train(consist), "group[].upper", "group[].lower", "group[].applied",
                given=("vehicle[].speed", "group[].force"))  # fmt: skip
    upper, lower, most = laws(SPEEDS * KMH, 1e7)
    _, _, least = laws(SPEEDS * KMH, -1e7)
    assert (most == upper).all()
    assert (least == lower).all()
    brake = [min(461.0 * np.clip((v - 2.0) / 8.0, 0, 1), 34560.0 / max(v, 0.1)) for v in SPEEDS]
    assert upper == pytest.approx([traction(v, axle_load) for v in SPEEDS], rel=1e-12)
    assert -lower == pytest.approx(1e3 * np.array(brake), rel=1e-12, abs=1e-6)
    # Nowhere steeper than the steepest piece: 8.2 and 57.7 kN for 1 km/h.
    assert np.abs(np.diff(upper)).max() <= 8.3e3 * (SPEEDS[1] - SPEEDS[0])
    assert np.abs(np.diff(lower)).max() <= 57.7e3 * (SPEEDS[1] - SPEEDS[0])
    points = {25: {0: 760, 5: 760, 30: 665, 60: 551, 80: 432, 120: 288},
              23: {0: 700, 4: 700, 30: 620.73, 60: 525.66, 80: 432, 120: 288}}  # fmt: skip
    for v, force in points[axle_load].items():
        assert upper[np.argmin(np.abs(SPEEDS - v))] == pytest.approx(1e3 * force, rel=1e-12)
    for v, force in {1.0: 0.0, 6.0: 230.5, 10.0: 461.0, 74.0: 461.0, 96.0: 360.0}.items():
        assert -lower[np.argmin(np.abs(SPEEDS - v))] == pytest.approx(1e3 * force, abs=1e-6)


def test_rolling_back_it_pulls_but_has_no_electric_brake() -> None:
    laws = Laws(pair(), "group[].upper", "group[].lower", given=("vehicle[].speed",))
    upper, lower = laws(-10.0 * KMH)
    assert upper == pytest.approx(741e3)
    assert lower == 0.0


def test_a_group_shares_its_demand_and_each_keeps_to_its_own_envelope() -> None:
    """A 25 t and a 23 t locomotive in one group: beyond what the weaker gives, only one follows."""
    consist = reference.mixed_train()
    laws = Laws(heavy_haul_train(consist), "der(vehicle[].speed)", "group[].applied",
                "group[].upper", given=("group[].force",))  # fmt: skip
    masses = np.array([v.mass for v in consist.vehicles])
    for demand, each in ((600e3, (300e3, 300e3)), (1440e3, (720e3, 700e3)), (2e6, (760e3, 700e3))):
        rates, applied, upper = laws((demand, 50e3))
        forces = rates * masses
        assert forces[[0, 3, 7]] == pytest.approx((*each, 50e3), rel=1e-12)
        assert np.count_nonzero(forces) == 3
        assert applied == pytest.approx((sum(each), 50e3), rel=1e-12)
        assert upper == pytest.approx((1460e3, 760e3), rel=1e-12)


# Friction


def test_running_resistance_is_the_papers_with_its_blend() -> None:
    laws = Laws(pair(), "friction(vehicle[].speed)", given=("vehicle[].speed",))
    for v in (0.0, 1.0, 2.5, 3.0, 3.75, 5.0, 5.1, 20.0, 65.0, 120.0):
        engine, wagon = 1.4 + 0.0038 * v + 0.0003 * v**2, 0.92 + 0.0048 * v + 0.000125 * v**2
        share = min(max((v - 2.5) / 2.5, 0.0), 1.0)
        expected = 5.0 + share * (engine - 5.0), 3.5 + share * (wagon - 3.5)  # N/kN
        for way in (1.0, -1.0):
            (found,) = laws(way * v * KMH)
            assert found == pytest.approx(np.array(expected) * 9.81 / 1000.0, rel=1e-12)


def test_shoes_of_20_kn_have_the_friction_of_the_sheet() -> None:
    """K = 20 kN: φ = 0.322 (v + 150)/(2 v + 150), 8 shoes of a wagon of 100 t."""
    coefficients = [f"vehicle[].resistance_{name}" for name in
                    ("constant", "linear", "quadratic", "starting")]  # fmt: skip
    laws = Laws(pair(), "friction(vehicle[].speed)",
                given=("vehicle[].cylinder_pressure", "vehicle[].speed",
                       *coefficients))  # fmt: skip
    area = np.pi / 4.0 * 254.0**2 * 0.90 * 8.4 / (8.0 * 1e6)  # kN of a shoe for 1 kPa
    for v in (0.0, 10.0, 65.0, 100.0):
        (found,) = laws(20.0 / area, v * KMH, 0.0, 0.0, 0.0, 0.0)
        assert found[0] == 0.0  # the locomotive has no air brake
        phi = 0.41 * 220.0 / 280.0 * (v + 150.0) / (2.0 * v + 150.0)
        assert phi == pytest.approx(0.322 * (v + 150.0) / (2.0 * v + 150.0), rel=5e-4)
        assert found[1] == pytest.approx(8.0 * 20e3 * phi / 100e3, rel=1e-12)
        for pressure in (0.0, 71.4, 252.0, 420.0):
            k = area * pressure
            phi = 0.41 * (k + 200) / (4 * k + 200) * (v + 150) / (2 * v + 150)
            (found,) = laws(pressure, v * KMH, 0.0, 0.0, 0.0, 0.0)
            assert found[1] == pytest.approx(8e3 * k * phi / 100e3, rel=1e-12, abs=1e-15)


def test_the_cylinder_follows_the_service_curve() -> None:
    """4 s to a higher, 8 s to a lower pressure; linear between the points and level beyond."""
    curve = {0: 0.0, 50: 0.17, 60: 0.28, 70: 0.37, 80: 0.46, 90: 0.53, 100: 0.60, 110: 0.67,
             120: 0.73, 130: 0.78, 140: 0.83, 150: 0.88, 160: 0.93, 170: 0.96}  # fmt: skip
    rates = Laws(pair(), "der(vehicle[].cylinder_pressure)",
                 given=("vehicle[].pipe_reduction", "vehicle[].cylinder_pressure"))  # fmt: skip
    for r in (*curve, 25.0, 57.0, 123.4, 171.0, 300.0):
        most = 420.0 * float(np.interp(r, list(curve), list(curve.values())))
        for pressure in (0.0, 100.0, 410.0):
            (found,) = rates(r, pressure)
            time = 4.0 if most > pressure else 8.0
            assert found[1] == pytest.approx((most - pressure) / time, rel=1e-11, abs=1e-11)


# Gradients


def test_slope_and_potential_energy_are_integrals_along_the_line() -> None:
    consist = reference.mixed_train()
    laws = Laws(heavy_haul_train(consist, gradients=4), "der(vehicle[].speed)",
                "energy.potential", "vehicle[].position",
                given=("gradient_position", "gradient", "location"))  # fmt: skip

    def slope(x: float) -> float:
        return LINE[max(sum(x >= begin for begin, _ in LINE), 1) - 1][1]

    line = np.array(LINE).T
    kinks = [begin for begin, _ in LINE]
    masses = np.array([v.mass for v in consist.vehicles])
    energies, fronts, grades = [], [], []
    for location in np.arange(-30.0, 500.0, 17.3):
        rates, (energy,), front = laws(*line, location)
        for x, vehicle, rate in zip(front, consist.vehicles, rates, strict=True):
            ends = (x - vehicle.length, x)
            inside = [k for k in kinks if ends[0] < k < ends[1]]
            total, _ = quad(slope, *ends, points=inside or None, epsabs=1e-10)
            assert -rate == pytest.approx(9.81e-3 * total / vehicle.length, rel=1e-9, abs=1e-12)
        energies.append(energy)
        fronts.append(front)
        grades.append(-rates)

    def pull(location: float) -> float:
        rates, _, _ = laws(*line, location)
        return float(-(rates * masses).sum())

    # Energy is the integral of gravity's pull, whose kinks lie where a vehicle meets a change.
    behind = fronts[0][0] - fronts[0]
    ends = np.concatenate([behind, behind + [v.length for v in consist.vehicles]])
    for a, b in ((0, 9), (3, 17), (10, 29)):
        low, high = fronts[a][0], fronts[b][0]
        cuts = np.unique(np.clip([k + e for k in kinks for e in ends], low, high))
        cuts = np.unique(np.concatenate([[low], cuts, [high]]))
        work = 0.0  # linear between the kinks: the trapezoids are exact
        for here, there in pairwise(cuts):
            if there - here > 1e-9:
                inset = 1e-9 * (there - here)
                work += 0.5 * (pull(here + inset) + pull(there - inset)) * (there - here)
        assert energies[b] - energies[a] == pytest.approx(work, rel=1e-6, abs=10.0)


# The brake's wave


def steady(rates: Callable[[Array], Array], level: Array) -> Array:
    """Return the matrix of rates that are linear around a level."""
    columns = [(rates(level + 1e-3 * unit) - rates(level - 1e-3 * unit)) / 2e-3
               for unit in np.eye(level.size)]  # fmt: skip
    matrix = np.column_stack(columns)
    matrix[np.abs(matrix) < 1e-3] = 0.0  # rounding
    return matrix


@pytest.mark.parametrize("way", ["application", "release"])
@pytest.mark.parametrize(
    ("consist", "state", "command", "latest"),
    [
        (coal_train(), "pipe_reduction", "group[].reduction", (5.08, 7.94)),
        (coal_train(distributed=True), "pipe_reduction", "group[].reduction", (2.5, 3.9)),
        (DEVICE, "pipe_from_locomotives", "group[].reduction", (5.08, 7.94)),
        (DEVICE, "pipe_lead", "end_of_train.reduction", (5.08, 7.94)),
    ],
    ids=["one group", "two groups", "beside a device", "the device"],
)
def test_the_wave_arrives_after_the_way_over_its_speed(
    consist: Consist, state: str, command: str, latest: tuple[float, float], way: str
) -> None:
    """The law's own matrix A: ∫(1 − r) dt is −A⁻¹ 1; half of it is there a little earlier."""
    laws = Laws(heavy_haul_train(consist), f"der(vehicle[].{state})",
                given=(f"vehicle[].{state}", command))  # fmt: skip
    applied = way == "application"

    def rates(r: Array) -> Array:
        return laws(r, 100.0 if applied else 0.0)[0]

    # Around a level below (above) the command, falling (rising) along the feed's way.
    speed = 250.0 if applied else 160.0
    own = slice(-1, None) if state == "pipe_lead" else slice(len(consist.groups))
    times = reference.arrivals(consist, 250.0)[own]
    order = times.min(axis=0).argsort().argsort()
    matrix = steady(rates, 50.0 - (0.01 if applied else -0.01) * order)
    radio = np.array([[delay] for _, delay in reference.sources(consist)[own]])
    delays = reference.arrivals(consist, speed)[own] - radio
    expected = np.take_along_axis(delays, times.argmin(axis=0)[None], axis=0)[0]
    found = -np.linalg.solve(matrix, np.ones(consist.size))
    assert found == pytest.approx(expected, rel=1e-7)
    assert found.max() == pytest.approx(latest[not applied], abs=0.1)
    last = int(found.argmax())
    # In small steps, whose exponentials have no large numbers that must cancel.
    arrived = 1.0 - np.linalg.matrix_power(expm(matrix * found[last] / 64.0), 64)[last].sum()
    assert 0.5 < arrived < 0.53


def test_longer_vehicles_pass_the_wave_on_later() -> None:
    laws = Laws(
        heavy_haul_train(DEVICE), "der(vehicle[].pipe_from_locomotives)",
        "der(vehicle[].pipe_lead)",
        given=("vehicle[].length", "group[].reduction", "end_of_train.reduction"),
    )  # fmt: skip
    front, rear = laws(20.0, 50.0, 70.0)
    assert front[0] == pytest.approx(50.0 * 250.0 / 20.0, rel=1e-12)
    assert rear[-1] == pytest.approx(70.0 * 250.0 / 20.0, rel=1e-12)


# All at once, types mixed


def test_every_law_is_the_references_with_vehicle_types_mixed() -> None:
    """Ten vehicles of six types and nine joints of four gears, at random states."""
    consist = reference.mixed_train()
    plant = heavy_haul_train(consist, gradients=4)
    laws = Laws(
        plant, "der(vehicle[].speed)", "friction(vehicle[].speed)", "coupler[].force",
        "update(coupler[].gear_force)", "der(vehicle[].pipe_from_locomotives)",
        "der(vehicle[].pipe_lead)", "vehicle[].pipe_reduction",
        "der(vehicle[].cylinder_pressure)", "vehicle[].position", "energy.kinetic",
        "coupler_maximum", "coupler_maximum_at", "coupler_minimum", "coupler_minimum_at",
        "standing",
        given=(
            "gradient_position", "gradient", "vehicle[].speed", "vehicle[].displacement",
            "coupler[].gear_force", "coupler[].stretch", "group[].force",
            "vehicle[].pipe_from_locomotives", "vehicle[].pipe_lead",
            "vehicle[].cylinder_pressure", "group[].reduction", "end_of_train.reduction",
            "location",
        ),
    )  # fmt: skip
    generator = np.random.default_rng(8)
    mass = np.array([v.mass for v in consist.vehicles])
    length = np.array([v.length for v in consist.vehicles])
    beyond = set()
    for _ in range(60):
        v = generator.uniform(-5.0, 35.0, 10) * generator.choice([0.0, 0.05, 1.0])
        d = generator.uniform(-0.2, 0.2, 9)
        before, held = generator.uniform(-0.2, 0.2, 9), generator.uniform(-2e6, 2e6, 9)
        x = 100.0 + np.concatenate([[0.0], -np.cumsum(d)])
        demands = generator.uniform(-1.5e6, 1.5e6, 2)
        wave, lead = generator.uniform(0.0, 170.0, 10), generator.uniform(-50.0, 120.0, 10)
        reduction, commands = wave + np.maximum(lead, 0.0), generator.uniform(0.0, 170.0, 3)
        by_front, by_device = reference.pipe_rates(consist, wave, lead, commands)
        pressure, location = generator.uniform(0.0, 420.0, 10), generator.uniform(-50.0, 400.0)
        values = laws(
            *np.array(LINE).T, v, x, held, before, demands, wave, lead, pressure,
            commands[:2], commands[2], location,
        )  # fmt: skip
        found = dict(zip(laws.names, values, strict=True))
        joints = consist.couplers
        stops = np.array([reference.stop_force(j, e) for j, e in zip(joints, d, strict=True)])
        beyond |= set(np.flatnonzero(stops))
        total = held + stops - np.array([j.damping for j in joints]) * np.diff(v)
        front = location + x - np.concatenate([[0.0], np.cumsum(length)[:-1]])
        resisted = np.array([reference.resistance(s, each.resistance) for s, each in
                             zip(v, consist.vehicles, strict=True)])  # fmt: skip
        shod = np.array([reference.shoe_force(each.brake, p, s) for each, p, s in
                         zip(consist.vehicles, pressure, v, strict=True)])  # fmt: skip
        expected = {
            "coupler[].force": total,
            "update(coupler[].gear_force)": [
                reference.moved(*each) for each in zip(joints, held, before, d, strict=True)
            ],
            "vehicle[].position": front,
            "der(vehicle[].speed)": reference.accelerations(
                consist, reference.locomotives(consist, demands, v), total,
                reference.slopes(consist, LINE, front),
            ),
            "friction(vehicle[].speed)": resisted * 9.81e-3 + shod / mass,
            "der(vehicle[].pipe_from_locomotives)": by_front,
            "der(vehicle[].pipe_lead)": by_device, "vehicle[].pipe_reduction": reduction,
            "der(vehicle[].cylinder_pressure)": reference.cylinder_rates(
                consist, pressure, reduction
            ),
            "energy.kinetic": [0.5 * float((mass * v**2).sum())],
            "coupler_maximum": [total.max()], "coupler_maximum_at": [total.argmax() + 1],
            "coupler_minimum": [total.min()], "coupler_minimum_at": [total.argmin() + 1],
            "standing": [np.count_nonzero(v == 0.0)],
        }  # fmt: skip
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-9), name
    assert beyond == set(range(9))  # each solid stop was met


# What is refused


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hysteresis": "sticky"}, "hysteresis must be one of incremental, dahl, switching"),
        ({"gradients": 0}, "gradients is 1 to 1000, not 0"),
        ({"gradients": 2.0}, "gradients is 1 to 1000, not 2.0"),
        ({"consist": "coal"}, "'coal' is no Consist; see read_consist"),
    ],
)
def test_a_mistake_is_named(options: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        heavy_haul_train(**options)
