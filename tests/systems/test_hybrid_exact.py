"""Hybrid plants against their solutions on paper."""

import math
from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models.solver import DormandPrince, RungeKutta4
from tests import hybrid_plants
from tests.instances import FMU2Named

G = 9.81


def slave_of(plant, folder: Path, **values: float) -> FMU2Named:
    made = FMU2Named(build(plant), folder)
    for name, value in values.items():
        made.set(name, value)
    made.initialize()
    return made


# Braking: m v' = -(F + c v²), so v0 = √(F/c) tan(√(cF)/m T) and s = m/(2c) ln(1 + c v0²/F).
FORCE, DRAG, MASS, V0 = 1e5 + 6e3, 12.0, 2e5, 20.0
STOP_TIME = MASS / math.sqrt(DRAG * FORCE) * math.atan(V0 * math.sqrt(DRAG / FORCE))
STOP_PLACE = MASS / (2.0 * DRAG) * math.log1p(DRAG * V0 * V0 / FORCE)


@pytest.mark.parametrize("step", [0.01, 0.1, 1.0, 60.0])
@pytest.mark.parametrize("inner", [0.002, 0.01])
def test_a_train_stops_where_and_when_it_must(tmp_path: Path, inner: float, step: float) -> None:
    """Within 1e-9 m and 1e-9 s with a 10 ms inner step."""
    slave = slave_of(hybrid_plants.braking(solver=RungeKutta4(inner_step=inner)), tmp_path)
    slave.run(60.0, step)
    assert slave.get("stopped") == pytest.approx(STOP_TIME, rel=0, abs=1e-9)
    assert slave.get("position") == pytest.approx(STOP_PLACE, rel=0, abs=1e-9)
    assert slave.get("speed") == 0.0
    assert slave.get("mode") == hybrid_plants.STANDING
    slave.freeInstance()


def test_a_standing_train_stays_until_the_drive_exceeds_the_resistance(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.braking(), tmp_path)
    slave.run(60.0, 1.0)
    place = slave.get("position")
    slave.set("drive", FORCE)  # exactly the resistance: not more
    slave.doStep(60.0, 600.0)
    assert (slave.get("position"), slave.get("speed")) == (place, 0.0)
    slave.set("drive", FORCE + 1e4)
    slave.doStep(660.0, 1.0)
    assert slave.get("mode") == hybrid_plants.MOVING
    assert slave.get("speed") == pytest.approx(1e4 / MASS, rel=1e-4)
    slave.freeInstance()


def test_a_train_that_is_let_go_at_the_start_goes(tmp_path: Path) -> None:
    """What holds at the start fires at the start."""
    slave = slave_of(
        hybrid_plants.braking(), tmp_path, mode=1, speed=0.0, drive=2e5, drag=0.0
    )  # fmt: skip
    assert slave.get("mode") == hybrid_plants.MOVING
    slave.doStep(0.0, 1.0)
    assert slave.get("speed") == pytest.approx((2e5 - FORCE) / MASS, rel=1e-12)
    slave.freeInstance()


def test_a_train_that_rolls_back_at_once_is_held_at_zero(tmp_path: Path) -> None:
    """Moving by mode, at v = 0 and pushed backwards: it stops in the first instant."""
    slave = slave_of(hybrid_plants.braking(), tmp_path, speed=0.0)
    slave.doStep(0.0, 1.0)
    assert (slave.get("speed"), slave.get("position")) == (0.0, 0.0)
    assert slave.get("stopped") == pytest.approx(0.0, abs=1e-12)
    slave.freeInstance()


def bounce_times(e: float, count: int) -> np.ndarray:
    """Times of the bounces of a ball dropped from 1 m."""
    first = math.sqrt(2.0 / G)
    flights = 2.0 * math.sqrt(2.0 * G) * e ** np.arange(1, count) / G
    return first + np.concatenate([[0.0], np.cumsum(flights)])


@pytest.mark.parametrize("solver", [RungeKutta4(inner_step=0.01), DormandPrince()])
def test_twenty_bounces(tmp_path: Path, solver) -> None:
    times = bounce_times(0.8, 21)
    slave = slave_of(hybrid_plants.ball(solver=solver), tmp_path)
    now = 0.0
    for n in range(1, 21):
        middle = 0.5 * (times[n - 1] + times[n])
        slave.doStep(now, middle - now)
        now = middle
        top = (math.sqrt(2.0 * G) * 0.8**n) ** 2 / (2.0 * G)
        assert slave.get("bounces") == n
        assert slave.get("height") == pytest.approx(top, rel=0, abs=1e-11)
        assert slave.get("speed") == pytest.approx(0.0, abs=1e-10)
    slave.freeInstance()


def test_bounces_without_end_are_refused_by_name(tmp_path: Path) -> None:
    """e = 0.8 bounces infinitely often before t = 4.06 s; the state before it is kept."""
    slave = slave_of(hybrid_plants.ball(), tmp_path)
    slave.doStep(0.0, 4.0)
    end = math.sqrt(2.0 / G) * (1.0 + 2.0 * 0.8 / 0.2)
    slave.fails(
        lambda: slave.doStep(4.0, 0.2), "event 'bounce' fires again and again at t = 4.06371"
    )
    assert "chatters" in slave.log[-1]
    assert float(slave.log[-1].split("t = ")[-1].split(":")[0]) == pytest.approx(end, abs=1e-6)
    assert slave.get("height") == pytest.approx(0.0, abs=1e-9)
    slave.freeInstance()


def test_bounces_settle_in_a_mode_of_their_own(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.ball(rest=1e-3), tmp_path)
    slave.run(10.0, 0.1)
    assert (slave.get("height"), slave.get("speed"), slave.get("lying")) == (0.0, 0.0, 1)
    speed = math.sqrt(2.0 * G)
    assert slave.get("bounces") == math.ceil(math.log(1e-3 / speed) / math.log(0.8)) + 1
    slave.freeInstance()


@pytest.mark.parametrize(("inner", "allowed"), [(0.01, 5e-9), (0.002, 1e-11)])
def test_stick_slip(tmp_path: Path, inner: float, allowed: float) -> None:
    """Slip: x = ¼ + ⅛ cos 2τ + 1/20 sin 2τ until v is the belt's again, τ = π − atan(5/2)."""
    slave = slave_of(hybrid_plants.stick_slip(solver=RungeKutta4(inner_step=inner)), tmp_path)
    slip = math.pi - math.atan(2.5)
    stick_place = 0.25 + 0.125 * math.cos(2.0 * slip) + 0.05 * math.sin(2.0 * slip)
    period = slip + (0.375 - stick_place) / 0.1

    def exact(t: float) -> float:
        if t <= 3.75:
            return 0.1 * t
        t = (t - 3.75) % period
        if t < slip:
            return 0.25 + 0.125 * math.cos(2.0 * t) + 0.05 * math.sin(2.0 * t)
        return stick_place + 0.1 * (t - slip)

    for k in range(400):
        slave.doStep(k / 20, 0.05)
        assert slave.get("position") == pytest.approx(exact((k + 1) / 20), abs=allowed)
    slave.freeInstance()


@pytest.mark.parametrize("level", [0.0, 0.5, 0.999999, -0.999999, 1.0 - 1e-9])
def test_crossings_are_counted_in_both_directions(tmp_path: Path, level: float) -> None:
    """Also two within one inner step: above 0.999999 sin stays for 2.8 ms, the step is 10 ms."""
    slave = slave_of(hybrid_plants.counters(), tmp_path, level=level)
    slave.run(61.0, 0.1)
    # sin t rises through the level at asin + 2πk, falls at π − asin + 2πk.
    rise, fall = math.asin(level), math.pi - math.asin(level)
    rises = [rise + 2 * math.pi * k for k in range(-1, 11)]
    falls = [fall + 2 * math.pi * k for k in range(-1, 11)]
    ups = sum(0.0 <= t < 61.0 for t in rises)
    downs = [t for t in falls if 0.0 <= t < 61.0]
    if level < 0.0:  # sin 0 > level: no crossing, but true at the start, which fires
        ups += 1
    assert slave.get("up") == ups
    starts_below = level > 0.0
    assert slave.get("down") == len(downs) + starts_below
    crossings = sorted([t for t in (*rises, *falls) if 0.0 <= t < 61.0])
    assert slave.get("both") == len(crossings)
    # The solver's own phase error is h⁴/120 a second; the slower it crosses, the less sharp.
    allowed = 1.1 * 0.01**4 / 120.0 * 61.0 + 1e-9
    sharp = 1.0 / math.sqrt(1.0 - level * level)
    assert slave.get("last") == pytest.approx(crossings[-1], abs=allowed * sharp)
    slave.freeInstance()


def test_events_a_picosecond_apart_keep_their_order(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.twins(apart=1e-12), tmp_path)
    slave.run(1.0, 0.1)
    assert slave.get("order") == 12
    assert slave.get("second") - slave.get("first") == pytest.approx(1e-12, abs=2e-15)
    slave.freeInstance()


def test_simultaneous_events_fire_in_the_order_of_declaration(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.twins(), tmp_path)
    slave.run(1.0, 0.1)
    assert slave.get("order") == 21
    assert slave.get("second") == slave.get("first") == pytest.approx(0.5, abs=1e-15)
    slave.freeInstance()


def test_an_event_at_a_communication_point_fires_once(tmp_path: Path) -> None:
    """At x = 0.5 exactly, where one step ends and the next begins."""
    for step in (0.5, 0.25, 0.1, 0.05):
        slave = slave_of(hybrid_plants.twins(), tmp_path / str(step))
        slave.run(1.0, step)
        assert slave.get("order") == 21
        slave.freeInstance()


def test_chattering_is_refused_by_name(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.chatter(), tmp_path)
    slave.fails(lambda: slave.doStep(0.0, 2.0), "event 'down' fires again and again at t = 0.99999")
    slave.get("x")
    slave.reset()
    slave.initialize()
    slave.doStep(0.0, 0.5)
    assert slave.get("x") == pytest.approx(0.5, abs=1e-14)
    slave.freeInstance()


@pytest.mark.parametrize("step", [0.1, 0.3, 1.0, 3.1])
def test_time_events_are_landed_on(tmp_path: Path, step: float) -> None:
    slave = slave_of(hybrid_plants.clock(), tmp_path)
    slave.run(3.1, step) if step < 3 else slave.doStep(0.0, 3.1)
    end = step * round(3.1 / step)
    slave_ticks = math.floor(end / 0.3 + 1e-9)
    assert slave.get("ticks") == slave_ticks
    assert slave.get("x") == pytest.approx(end - 0.3 * slave_ticks, abs=1e-12)
    slave.freeInstance()


def test_each_element_of_a_vector_event_fires_for_itself(tmp_path: Path) -> None:
    slave = slave_of(hybrid_plants.fleet(), tmp_path)
    slave.run(2.5, 0.1)
    for i in range(1, 6):
        assert slave.get(f"vehicle[{i}].still") == (6.043 / i < 2.5)
        expected = max(6.043 - i * 2.5, 0.0)
        assert slave.get(f"vehicle[{i}].speed") == pytest.approx(expected, abs=1e-12)
    slave.freeInstance()


def test_hysteresis_is_the_path_s_and_not_the_step_s(tmp_path: Path) -> None:
    """A path that visits both envelopes ends at the same force at any step, and any speed."""
    forces = []
    for inner, pace in ((0.01, 1.0), (0.001, 1.0), (0.002, 0.25)):
        plant = hybrid_plants.draft_gear(solver=RungeKutta4(inner_step=inner))
        slave = slave_of(plant, tmp_path / f"{inner}-{pace}")
        now, path = 0.0, []
        for rate, time in ((0.05, 1.0), (-0.05, 0.5), (0.05, 0.2)):
            slave.set("rate", rate * pace)
            slave.doStep(now, time / pace)
            now += time / pace
            path.append(slave.get("force"))
        forces.append(path)
        slave.freeInstance()
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    assert forces[2] == pytest.approx(forces[0], rel=1e-9)
    # Loading ends on the upper envelope, unloading on the lower one; reloading: elastic, upper.
    assert forces[0][:2] == pytest.approx([2e6 * 0.05 + 1e4, -(2e6 * 0.025 + 1e4)])
    assert forces[0][2] == pytest.approx(2e6 * 0.035 + 1e4)


def test_dependent_parameters_follow_their_parameters(tmp_path: Path) -> None:
    slave = FMU2Named(build(hybrid_plants.geared()), tmp_path)
    slave.set("teeth[1]", 30.0)
    slave.set("torque", 3.0)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    assert slave.get("ratio") == 2.0
    assert slave.get("inertia") == 0.5
    slave.exitInitializationMode()
    slave.doStep(0.0, 1.0)
    assert slave.get("rate") == pytest.approx(6.0, rel=1e-12)
    slave.set("load", 4.0)  # tunable
    assert slave.get("inertia") == 1.0
    slave.doStep(1.0, 1.0)
    assert slave.get("rate") == pytest.approx(9.0, rel=1e-12)
    slave.fails(lambda: slave.set("ratio", 1.0), "ratio is computed")
    slave.freeInstance()
