"""Runs of the heavy-haul train: convergence, conservation, waves, another method, and standing."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.special import jv

from railcosim import Delay, Diagram, Fmu, Step
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.models.consist import Consist, EndOfTrain, coal_train
from railcosim.models.heavy_haul import heavy_haul_train
from railcosim.studies.heavy_haul.newmark import simulate
from tests.heavy_haul import FMU2Train, ramp
from tests.heavy_haul_reference import arrivals, height

TRAIN = coal_train(end_of_train=EndOfTrain())
MASS = np.array([v.mass for v in TRAIN.vehicles])
STEPS = (5e-3, 2e-3, 1e-3, 5e-4)
VIOLENT = {"group[1].force": ramp(400e3, 1140e3)}
FREE = {f"vehicle[].resistance_{name}": 0.0
        for name in ("constant", "linear", "quadratic", "starting")}  # fmt: skip
EVEN = FREE | {"vehicle[].resistance_constant": 1.0, "vehicle[].resistance_starting": 1.0}
Start = Callable[..., FMU2Train]
Demand = Callable[[float], float]


@pytest.fixture(scope="module")
def fmu() -> Path:
    return build(heavy_haul_train(TRAIN))


@pytest.fixture(scope="module")
def short() -> Consist:
    return coal_train(locomotives=2, wagons=3, end_of_train=EndOfTrain())


@pytest.fixture(scope="module")
def short_fmu(short: Consist) -> Path:
    return build(heavy_haul_train(short, gradients=2))


@pytest.fixture
def start(fmu: Path, tmp_path: Path) -> Iterator[Start]:
    made: list[FMU2Train] = []

    def started(values: Mapping[str, ArrayLike], *, path: Path = fmu) -> FMU2Train:
        made.append(FMU2Train(path, tmp_path / str(len(made)), values))
        return made[-1]

    yield started
    for train in made:
        train.freeInstance()


def peaks(start: Start, path: Path) -> list[float]:
    """Return the violent start's greatest coupler force for each inner step."""
    found = []
    for h in STEPS:
        train = start({"solver.inner_step": h}, path=path)
        train.go(12.0, 0.01, VIOLENT)
        found.append(float(train.take("coupler[].highest").max()))
    return found


# Convergence with the inner step


def test_the_peak_of_a_violent_start_does_not_depend_on_the_inner_step(start, fmu: Path) -> None:
    found = peaks(start, fmu)
    assert 1.2e6 < found[-1] < 1.9e6  # far above the locomotives' 1140 kN
    assert found == pytest.approx([found[-1]] * len(STEPS), rel=0.01)


def test_with_naive_switching_it_does(start) -> None:
    """The negative control: the same train with a gear that switches on the speed's sign."""
    found = peaks(start, build(heavy_haul_train(TRAIN, hysteresis="switching")))
    assert max(found) > 1.04 * min(found)
    assert abs(found[0] - found[-1]) > 0.04 * found[-1]


@pytest.mark.slow
def test_the_dahl_form_converges_too(start) -> None:
    path = build(heavy_haul_train(TRAIN, hysteresis="dahl"))
    found = peaks(start, path)
    assert found == pytest.approx([found[-1]] * len(STEPS), rel=0.01)
    train = start({}, path=path)
    residual, work = train.go(12.0, 0.01, VIOLENT, ("energy.residual", "energy.traction"))
    assert np.abs(residual).max() < 1e-4 * work[-1]


def test_the_extremes_are_those_of_all_inner_steps(start) -> None:
    train = start({})
    (force,) = train.go(4.0, 0.001, VIOLENT, ("coupler[].force",))
    assert (train.take("coupler[].highest") == force.max(axis=0)).all()
    assert (train.take("coupler[].lowest") == force.min(axis=0)).all()
    coarse = start({})
    coarse.go(4.0, 0.5, {"group[1].force": lambda t: 1e6})
    fine = start({})
    fine.go(4.0, 0.001, {"group[1].force": lambda t: 1e6})
    assert (coarse.take("coupler[].highest") == fine.take("coupler[].highest")).all()


# Conservation


def brake(t: float) -> float:
    return 50.0 if 10.0 <= t < 40.0 else 0.0


RUNS: dict[str, tuple[dict[str, float], dict[str, Demand], float]] = {
    "start-up": ({"gradient[1]": 6.0}, {"group[1].force": ramp(40e3, 1060e3)}, 40.0),
    "braking": (
        {"gradient[1]": -6.0, "initial_speed": 65.0 / 3.6, "location": 5e3},
        {"group[1].force": lambda t: -(150e3 if brake(t) else 350e3) * min(t / 15.0, 1.0),
         "group[1].reduction": brake, "end_of_train.reduction": lambda t: brake(t - 1.0)},
        60.0,
    ),
}  # fmt: skip
WORKS = ("traction", "electric_brake", "gears", "gears_stored", "damping", "resistance",
         "air_brake", "kinetic", "potential", "residual")  # fmt: skip


@pytest.mark.parametrize("name", RUNS)
def test_the_energies_add_up(start, name: str) -> None:
    """Residual against the work put in: by traction, or by the slope and the train's speed."""
    values, demands, stop = RUNS[name]
    train = start(values)
    watched = [f"energy.{work}" for work in WORKS]
    rows = train.go(stop, 0.02, demands, (
        *watched, "group[1].applied", "vehicle[].speed", "vehicle[].position",
    ))  # fmt: skip
    *columns, applied, speed, place = rows
    energy = {work: column[:, 0] for work, column in zip(WORKS, columns, strict=True)}
    kinetic = 0.5 * (MASS * speed**2).sum(axis=1)
    assert energy["kinetic"] == pytest.approx(kinetic, rel=1e-12)
    middle = place - 0.5 * np.array([v.length for v in TRAIN.vehicles])
    level = np.array([[height([(0.0, values["gradient[1]"])], x) for x in row]
                      for row in middle[::250]])  # fmt: skip
    assert energy["potential"][::250] == pytest.approx((9.81 * MASS * level).sum(axis=1), rel=1e-9)
    losses = ("electric_brake", "damping", "resistance", "air_brake")
    heat = np.sum([energy[work] for work in losses], axis=0)
    assert (np.diff(heat) >= 0.0).all()
    mechanical = energy["kinetic"] + energy["potential"]
    mechanical -= mechanical[0]
    stored = energy["gears"] + energy["gears_stored"]
    missing = mechanical + heat + stored - energy["traction"]
    # The gears' heat begins with what a train has before it first moves: nothing.
    turnover = max(energy["traction"][-1], heat[-1])
    assert turnover > 4e6
    assert np.abs(missing - energy["residual"]).max() < 1e-9 * np.abs(energy["potential"]).max()
    assert np.abs(energy["residual"]).max() < 1e-4 * turnover
    # Traction and electric brake by themselves: force times speed, by trapezoids over 20 ms.
    power = applied[:, 0] * 0.5 * (speed[:, 0] + speed[:, 1])
    work = np.sum(0.01 * (power[1:] + power[:-1]))
    assert energy["traction"][-1] - energy["electric_brake"][-1] == pytest.approx(work, rel=5e-3)


def test_without_outer_forces_the_momentum_stays_to_rounding(start) -> None:
    """Vehicles of random speeds, which bump into each other and pull."""
    generator = np.random.default_rng(4)
    train = start(FREE | {"vehicle[].speed": generator.uniform(-0.6, 0.6, TRAIN.size)})
    speed, force = train.go(20.0, 0.01, {}, ("vehicle[].speed", "coupler[].force"))
    assert np.abs(force).max() > 3e5
    momentum = speed @ MASS
    assert np.abs(momentum - momentum[0]).max() < 1e-13 * (np.abs(speed[0]) @ MASS)


@pytest.mark.parametrize("slope", [0.0, 6.0])
def test_slow_forces_share_by_the_mass_behind(start, slope: float) -> None:
    """F_j = (locomotives before j) − F · (mass before j)/(mass of all), resistances being equal.

    So F_j = F · (mass behind j)/(mass of all) behind the locomotives; it holds in the limit of a
    slow ramp, here 2 kN/s, after the slack is taken up.
    """
    speed = 20.0 if slope else 0.1  # so that it neither comes to stand nor meets its power limit
    train = start(EVEN | {"solver.inner_step": 5e-3, "gradient[1]": slope, "initial_speed": speed})
    demands = {"group[1].force": ramp(2e3, 800e3)}
    force, applied = train.go(400.0, 0.1, demands, ("coupler[].force", "group[1].applied"))
    behind = np.cumsum(MASS[::-1])[::-1][1:] / MASS.sum()
    expected = applied * behind
    expected[:, 0] -= 0.5 * applied[:, 0]  # coupler 1 is between the two locomotives
    assert applied[-1, 0] > 799e3
    error = np.abs(force - expected).max(axis=1)
    assert error[1000:].max() < 5e-3 * 800e3


# Waves


def test_an_elastic_wave_runs_as_in_a_chain_of_masses_and_springs(start) -> None:
    """Linear gears of 25 MN/m (100 kN at 4 mm) and 100 t each: sqrt(k/m) vehicles a second.

    One end of a long chain set off at v0: v_n = v0 (J_2n(2ωt) + J_2n+2(2ωt)), until it comes back
    from the other end. Forces stay so small that the gear's power law adds some 1e-4.
    """
    speeds = np.zeros(TRAIN.size)
    speeds[0] = 0.01
    train = start(FREE | {
        "vehicle[].mass": 1e5, "coupler[].slack": 0.0, "coupler[].unloading_ratio": 1.0,
        "coupler[].damping": 0.0, "vehicle[].speed": speeds, "solver.inner_step": 5e-4,
    })  # fmt: skip
    (speed,) = train.go(6.0, 0.01, {}, ("vehicle[].speed",))
    omega = np.sqrt(25e6 / 1e5)
    time = 0.01 * np.arange(len(speed))[:, None]
    n = np.arange(TRAIN.size)
    expected = 0.01 * (jv(2 * n, 2 * omega * time) + jv(2 * n + 2, 2 * omega * time))
    assert np.abs(speed - expected)[:, :80].max() < 0.005 * 0.01
    # The fronts' crests, whose delay after n/ω grows with the cube root of n only.
    crest = time[speed.argmax(axis=0), 0]
    slowness = np.polyfit(np.arange(30, 81), crest[30:81], 1)[0]
    assert 1.0 / slowness == pytest.approx(omega, rel=0.02)


@pytest.mark.parametrize("device", ["silent", "commanded"])
def test_the_brakes_wave_arrives_at_each_vehicle(start, device: str) -> None:
    """Mean delay ∫(1 − r) dt: length over speed, of an application from the nearer end.

    A device that hears nothing leaves the whole train to the front's wave. A release always comes
    from the front, however late the device hears of it.
    """
    train = start({})
    on = 100.0
    demands = {"group[1].reduction": lambda t: on if t < 25.0 else 0.0}
    if device == "commanded":
        demands["end_of_train.reduction"] = lambda t: on if 1.0 <= t < 26.0 else 0.0
    r, p = train.go(50.0, 0.01, demands,
                    ("vehicle[].pipe_reduction", "vehicle[].cylinder_pressure"))  # fmt: skip
    assert r[2499].min() > 0.9999 * on
    assert p[2499, 2:].min() > 0.98 * p[2499].max()  # all wagons are braked
    applied = arrivals(TRAIN, 250.0)
    first = applied[0] if device == "silent" else applied.min(axis=0)
    assert first[-1] == (first.max() if device == "silent" else applied[1, -1])
    for part, expected, sign in ((r[:2500], first, 1.0), (r[2500:], arrivals(TRAIN, 160.0)[0], -1)):
        share = part / on if sign > 0.0 else 1.0 - part / on
        mean = 0.01 * (1.0 - share).sum(axis=0)
        meet = np.abs(applied[0] - applied[1]) < (0.2 if expected is not applied[0] else 0.0)
        assert mean[~meet] == pytest.approx(expected[~meet], rel=1e-3, abs=0.006)  # half a sample
        assert mean[meet] == pytest.approx(expected[meet] - 0.02, abs=0.03)  # the larger of both
        half = 0.01 * (share < 0.5).sum(axis=0)
        assert (half < mean + 0.006)[~meet].all()  # the front is steeper than its tail
        assert half[30:] == pytest.approx(expected[30:], rel=0.05, abs=0.01)


def test_a_device_left_venting_brakes_again_what_was_released(start) -> None:
    """The front's release is first not held up; the device opens again as it comes by."""
    train = start({})
    demands = {"group[1].reduction": lambda t: 100.0 if t < 12.0 else 0.0,
               "end_of_train.reduction": lambda t: 100.0}  # fmt: skip
    (r,) = train.go(30.0, 0.01, demands, ("vehicle[].pipe_reduction",))
    released = 0.01 * (r[1200:] > 50.0).argmin(axis=0)
    expected = arrivals(TRAIN, 160.0)[0]
    assert released[30:90] == pytest.approx(expected[30:90], rel=0.05)
    assert r[-1].min() > 99.0
    again = 30.0 - 0.01 * (r[::-1] < 50.0).argmax(axis=0)
    assert again[0] == pytest.approx(12.0 + expected[-1] + arrivals(TRAIN, 250.0)[0, -1], abs=1.0)


def test_the_radio_delay_is_a_block_of_the_diagram(fmu: Path) -> None:
    """The rear vehicle's wave begins 1 s after the command; the front's at once."""
    diagram = Diagram("radio", step=0.01)
    diagram.add("command", Step(at=0.5, to=100.0, unit="kPa"))
    diagram.add("radio", Delay(1.0, interpolation="hold"))
    diagram.add("train", Fmu.with_values(fmu, {"group[1].force": 0.0}))
    diagram.connect("command.y", "train.group[1].reduction")
    diagram.connect("command.y", "radio.u")
    diagram.connect("radio.y", "train.end_of_train.reduction")
    places = (0, 20, 40, 80, TRAIN.size - 1)
    names = [f"train.vehicle[{i + 1}].pipe_reduction" for i in places]
    frame = diagram.run(stop=7.0, record=[*names, "radio.y"]).frame
    delays = [(0.01 * (1.0 - frame[name] / 100.0)).sum() - 0.5 for name in names]
    expected = arrivals(TRAIN, 250.0)
    assert delays == pytest.approx(expected.min(axis=0)[[*places]], abs=0.015)
    assert expected.argmin(axis=0)[[*places]].tolist() == [0, 0, 0, 1, 1]
    received = frame.index[frame["radio.y"].to_numpy() > 0.0]
    assert received[0] == pytest.approx(1.5, abs=1e-9)


# Another method


def off(t: float) -> float:
    return 0.0


def late(t: float) -> float:
    return 50.0 if 2.0 <= t < 8.0 else 0.0


@pytest.mark.parametrize(
    ("slope", "speed", "force", "reduction", "stop", "h"),
    [
        pytest.param(0.0, 0.0, ramp(400e3, 1140e3), off, 10.0, 0.002, id="violent start"),
        pytest.param(
            -6.0, 65.0 / 3.6, lambda t: -70e3 * min(t, 5.0), late, 13.0, 0.005, id="braking"
        ),
    ],
)
def test_newmarks_method_gives_the_same_forces(
    start: Start, slope: float, speed: float, force: Demand, reduction: Demand, stop: float,
    h: float,
) -> None:  # fmt: skip
    """Within 0.5 % of the peak: each coupler's extremes, and over time in the mean."""
    other = simulate(
        TRAIN, stop=stop, step=h, force=force, reduction=reduction,
        end_of_train=lambda t: reduction(t - 1.0), gradients=((0.0, slope),), speed=speed,
        record=5,
    )  # fmt: skip
    train = start({"gradient[1]": slope, "initial_speed": speed})
    demands = {"group[1].force": force, "group[1].reduction": reduction,
               "end_of_train.reduction": lambda t: reduction(t - 1.0)}  # fmt: skip
    found, pipe = train.go(stop, h, demands, ("coupler[].force", "vehicle[].pipe_reduction"))
    # At the ends the wave is so steep that a jump's place within a step is felt.
    assert np.abs(pipe[::5] - other.reduction)[:, 10:-10].max() < 0.5
    peak = other.peak.max()
    assert peak > 2e5
    assert np.abs(train.take("coupler[].highest") - other.highest).max() < 0.005 * peak
    assert np.abs(train.take("coupler[].lowest") - other.lowest).max() < 0.005 * peak
    error = found[::5] - other.coupler_force
    assert np.sqrt((error**2).mean()) < 0.005 * peak
    # Vehicles swing, each by itself; the train as a whole goes the same way.
    moved = train.take("vehicle[].speed")
    assert np.abs(moved - other.speed[-1]).max() < 0.02
    assert moved @ MASS == pytest.approx(other.speed[-1] @ MASS, abs=1e-3 * MASS.sum())


# The same again


def test_repeated_and_continued_runs_have_the_same_bits(start) -> None:
    """Twice from the start; with a state saved, serialized and restored in another instance."""
    first, again, other = start({}), start({}), start({})
    demands = {**VIOLENT, "group[1].reduction": lambda t: 60.0 if t > 3.0 else 0.0}
    first.go(4.0, 0.01, demands)
    again.go(4.0, 0.01, demands)
    assert first.all_values() == again.all_values()
    state = first.getFMUstate()
    data = first.serializeFMUstate(state)
    first.go(8.0, 0.01, demands)
    again.go(8.0, 0.01, demands)
    expected = again.all_values()
    assert first.all_values() == expected  # saving changed nothing
    first.setFMUstate(state)
    first.freeFMUstate(state)
    brought = other.deSerializeFMUstate(bytes(data))
    other.setFMUstate(brought)
    other.freeFMUstate(brought)
    for train in (first, other):
        train.time = 4.0
        train.go(8.0, 0.01, demands)
        assert train.all_values() == expected


def test_the_communication_step_makes_no_difference(start) -> None:
    """2 and 10 ms with 1 ms inside, and inputs that change every 10 ms."""
    fine, coarse = start({}), start({})
    force = VIOLENT["group[1].force"]
    names = ("coupler[].force", "vehicle[].speed", "vehicle[].position", "energy.residual")
    (*rows,) = coarse.go(8.0, 0.01, VIOLENT, names)
    held = {"group[1].force": lambda t: force(round(t / 0.002) // 5 * 0.01)}
    (*other,) = fine.go(8.0, 0.002, held, names)
    for a, b in zip(rows, other, strict=True):
        assert (a == b[::5]).all()


# Standing


def test_a_stopped_train_stands_on_a_slope_until_its_brakes_release(start) -> None:
    """Uphill at 6 ‰: braked to a stop, ten minutes of it, and back down once released."""
    train = start({"solver.inner_step": 5e-3, "gradient[1]": 6.0, "initial_speed": 5.0})
    braked = {"group[1].reduction": lambda t: 100.0, "end_of_train.reduction": lambda t: 100.0}
    train.go(60.0, 0.1, braked)
    assert train.get("standing") == TRAIN.size
    place = train.take("vehicle[].position")
    assert place[0] > 10.0
    (later,) = train.go(660.0, 1.0, braked, ("vehicle[].position",))
    assert np.abs(later - place).max() < 1e-9
    assert (train.take("vehicle[].speed") == 0.0).all()
    train.go(760.0, 1.0, {name: lambda t: 0.0 for name in braked})
    assert train.get("speed") < -0.5


# The FMU


def test_a_short_trains_fmu_passes_the_check(short_fmu: Path) -> None:
    report = check(short_fmu)
    assert report.passed, str(report)
    assert not report.unchecked, str(report)
