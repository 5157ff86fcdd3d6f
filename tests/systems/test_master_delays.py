"""Transport delays under each algorithm: of every length, held and linear, in loops, undone."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from railcosim import Block, Delay, Diagram, Fmu, Gain, Hold, Ramp, Run, Step, Sum
from railcosim.cosim.algorithms import GaussSeidel, Iterated, StepDoubling, TwoPhase
from railcosim.fmus import build
from tests import coupled_plants, plants
from tests.coupled_diagrams import names, oscillator, wired
from tests.systems import master_references as references
from tests.systems.test_events_and_edges import CONTINUOUS, EVERY, STEPS, driven

LINEAR = [TwoPhase(extrapolation=1), GaussSeidel(extrapolation=1), Iterated(extrapolation=1)]


@pytest.mark.parametrize("time", [0.05, 0.3, 0.1, 0.137, 0.95])
@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_a_ramp_through_a_delay(time: float, interpolation) -> None:
    """At ticks exact for any time with lines; held, the last sample before."""
    blocks = {
        "ramp": Ramp(slope=2.0, initial=1.0),
        "link": Delay(time, initial=-5.0, interpolation=interpolation),
    }
    run = wired(Diagram("ramp", step=0.05), blocks, "ramp.y link.u").run(2.0)
    shifted = [Fraction(k, 20) - Fraction(str(time)) for k in range(41)]
    if interpolation == "hold":
        shifted = [Fraction(math.floor(s * 20), 20) for s in shifted]
    expected = [1.0 + 2.0 * float(s) if s >= 0 else -5.0 for s in shifted]
    assert run["link.y"] == pytest.approx(expected, abs=1e-14)


def test_a_sine_is_damped_by_half_a_sample_and_not_shifted() -> None:
    """Lines between samples: gain cos(ω h / 2) half-way, and no error of phase."""
    step, w, time = 0.05, 2.0, 0.225
    blocks = {"sine": _Sine(w), "link": Delay(time, initial=lambda t: math.sin(w * t))}
    run = wired(Diagram("sine", step=step), blocks, "sine.y link.u").run(20.0)
    late = run.time >= time
    basis = np.column_stack([np.sin(w * (run.time - time)), np.cos(w * (run.time - time))])
    (gain, phase), *_ = np.linalg.lstsq(basis[late], run["link.y"][late], rcond=None)
    assert gain == pytest.approx(math.cos(0.5 * w * step), abs=1e-14)
    assert abs(phase) < 1e-14


@dataclass(frozen=True)
class _Sine(Block):
    """y = sin(w t)."""

    w: float
    outputs = {"y": "1"}
    feedthrough = False
    timed = True

    def output(self, x: Any, t: float) -> float:
        return math.sin(self.w * t)


def test_no_time_passes_at_once_and_a_short_one_as_a_line() -> None:
    for time in (0.0, 0.01, 0.049):
        run = retarded(1.0, 0.05, 1.0, TwoPhase(), delay=time)
        x, part = [1.0], time / 0.05
        for k in range(20):
            delayed = (1.0 - part) * x[k] + part * x[max(k - 1, 0)]
            x.append(x[-1] - 0.05 * delayed)
        assert run["plant.x"] == pytest.approx(x, abs=1e-14)


@pytest.mark.parametrize("time", [0.3, 0.1 + 0.2, 0.7, 1.1])
def test_times_whose_ratio_to_the_step_is_whole_on_paper_only(time: float) -> None:
    """0.3 / 0.1 is 2.9999999999999996 in floats, 0.1 + 0.2 is more than 0.3."""
    count = round(time / 0.1)
    for interpolation in ("linear", "hold"):
        block = Delay(round(time, 12), initial=9.0, interpolation=interpolation)
        run = driven(Ramp(slope=1.0, unit="1/s"), 0.1, block).run(2.0)
        expected = [9.0] * count + [k / 10 for k in range(21 - count)]
        assert run["block1.y"] == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("algorithm", EVERY, ids=names)
def test_an_edge_exactly_at_the_delays_end(algorithm) -> None:
    """The row at t0 + T shows u(t0), and so does what acts on the plant from there on."""
    for interpolation in ("linear", "hold"):
        block = Delay(0.4, initial=-1.0, interpolation=interpolation)
        source = Step(at=0.0, to=3.0, unit="1/s")
        run = driven(source, 0.1, block).run(1.0, algorithm=algorithm)
        assert run["block1.y"].tolist() == [-1.0] * 4 + [3.0] * 7
        # The jump there is no line over the step before.
        exact = np.where(run.time <= 0.4, -run.time, -0.4 + 3.0 * (run.time - 0.4))
        assert run["plant.x"] == pytest.approx(exact, abs=1e-13)


@pytest.mark.parametrize("algorithm", CONTINUOUS, ids=names)
@pytest.mark.parametrize("step", STEPS)
def test_held_edges_between_ticks(algorithm, step: float) -> None:
    """Samples every 0.2 s, 0.137 s later: the same edges at every step of the diagram."""
    link = Delay(0.137, initial=-2.0, interpolation="hold")
    diagram = driven(Ramp(slope=1.0, initial=0.5, unit="1/s"), step, Hold(0.2), link, Gain(3.0))
    run = diagram.run(2.0, algorithm=algorithm)
    grid = run.time
    exact = -6.0 * np.minimum(grid, 0.137)
    for n in range(10):
        span = np.clip(grid - (0.2 * n + 0.137), 0.0, 0.2)
        exact = exact + 3.0 * (0.5 + 0.2 * n) * span
    assert run["plant.x"] == pytest.approx(exact, abs=2e-13)


def sampled_loop(step: float, algorithm: Any) -> Run:
    """A sampled controller (0.2 s), a link of 0.137 s that holds, and an integrator."""
    blocks = {
        "r": Step(at=0.41, to=2.0),
        "error": Sum("+-"),
        "hold": Hold(0.2),
        "gain": Gain(1.5, input_unit="1", unit="1/s"),
        "link": Delay(0.137, interpolation="hold"),
        "plant": Fmu(build(plants.integrator(start=1.0))),
    }
    wires = (
        "r.y error.u1", "plant.x error.u2", "error.y hold.u", "hold.y gain.u", "gain.y link.u",
        "link.y plant.u",
    )  # fmt: skip
    diagram = wired(Diagram("sampled", step=step), blocks, *wires)
    return diagram.run(4.0, algorithm=algorithm)


@pytest.mark.parametrize("algorithm", CONTINUOUS, ids=names)
def test_a_sampled_loop_is_the_same_at_every_base_step(algorithm) -> None:
    x, sent, samples = 1.0, 0.0, [1.0]
    for n in range(20):
        u = 1.5 * ((2.0 if 0.2 * n >= 0.41 else 0.0) - x)
        x += 0.137 * sent + 0.063 * u
        sent = u
        samples.append(x)
    for step in STEPS:
        run = sampled_loop(step, algorithm)
        assert run["plant.x"][:: round(0.2 / step)] == pytest.approx(samples, abs=1e-13)


# Delay differential equations: x' = −K x(t − 1), history 1


def retarded(gain: float, step: float, stop: float, algorithm: Any, delay: float = 1.0) -> Run:
    blocks = {
        "plant": Fmu(build(plants.integrator(start=1.0))),
        "link": Delay(delay, initial=1.0),
        "minus": Gain(-gain, input_unit="1", unit="1/s"),
    }
    wires = ("plant.x link.u", "link.y minus.u", "minus.y plant.u")
    diagram = wired(Diagram("retarded", step=step), blocks, *wires)
    return diagram.run(stop, algorithm=algorithm)


@pytest.mark.parametrize("algorithm", LINEAR, ids=names)
def test_a_linear_delayed_input_has_order_two(algorithm) -> None:
    """The delay knows the line over the step: x(3) = −1/6 − h²/12."""
    for step in (0.1, 0.05, 0.025, 0.0125):
        run = retarded(1.0, step, 3.0, algorithm)
        assert run["plant.x"][-1] + 1.0 / 6.0 == pytest.approx(-step * step / 12.0, rel=1e-8)
        expected = references.retarded(1.0, step, round(1 / step), round(3 / step), linear=True)
        assert run["plant.x"] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("algorithm", [TwoPhase(), GaussSeidel(), Iterated()], ids=names)
def test_a_held_delayed_input_has_order_one(algorithm) -> None:
    for step in (0.1, 0.05):
        expected = references.retarded(1.0, step, round(1 / step), round(3 / step), linear=False)
        found = retarded(1.0, step, 3.0, algorithm)["plant.x"]
        assert found == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("algorithm", "expected", "hidden"),
    [
        (TwoPhase(), 1.5321, 1.4609),
        (GaussSeidel(), 1.5321, 1.4609),
        (TwoPhase(extrapolation=1), 1.5716, 1.4967),
        (GaussSeidel(extrapolation=1), 1.5716, 1.4967),
        (Iterated(extrapolation=1), 1.5716, 1.4967),
    ],
    ids=names,
)
def test_the_stability_boundary(algorithm, expected: float, hidden: float) -> None:
    h, d, linear = 0.05, 20, algorithm.extrapolation == 1
    exact = references.stability_boundary(h, d, linear=linear)
    assert exact == pytest.approx(expected, abs=5e-5)
    assert references.stability_boundary(h, d + 1, linear=linear) == pytest.approx(hidden, abs=5e-5)
    if not linear:
        assert exact == pytest.approx(references.held_boundary(h, d), abs=1e-7)
    for gain, grows in ((exact - 2e-4, False), (exact + 2e-4, True)):
        x = np.abs(retarded(gain, h, 400.0, algorithm)["plant.x"])
        third = len(x) // 3
        assert (x[-third:].max() > x[third : 2 * third].max()) is np.bool_(grows)


def test_the_delay_may_be_no_whole_number_of_steps() -> None:
    """Order two all the same, against steps that divide the delay."""
    exact = retarded(1.0, 0.000625, 3.0, TwoPhase(extrapolation=1))["plant.x"][-1]
    ends = [
        retarded(1.0, 0.3 / n, 3.0, TwoPhase(extrapolation=1))["plant.x"][-1] for n in (8, 16, 32)
    ]
    errors = np.abs(np.array(ends) - exact)
    assert errors[-1] < 2e-4
    assert np.log2(errors[0] / errors[-1]) / 2.0 == pytest.approx(2.0, abs=0.35)


# Steps that are undone


@pytest.mark.parametrize(
    "algorithm",
    [Iterated(), Iterated(extrapolation=1), StepDoubling(tolerance=1e-4), GaussSeidel()],
    ids=names,
)
@pytest.mark.parametrize("time", [0.01, 0.05, 0.123])
def test_a_rollback_leaves_the_delays_samples_alone(algorithm, time: float) -> None:
    """What a delay beside repeated or refused steps shows are the rows' own values, shifted."""
    step = 0.01
    delays = {
        "link": Delay(time, initial=7.0),
        "held": Delay(time, initial=7.0, interpolation="hold"),
    }
    diagram = wired(oscillator(step), delays, "one.x link.u", "two.v held.u")
    run = diagram.run(1.0, algorithm=algorithm)
    whole, part = divmod(round(time * 1000), 10)
    x, v, part = run["one.x"], run["two.v"], part / 10
    for k in range(101):
        before = k - whole - (1 if part else 0)
        line = 7.0 if before < 0 else (1.0 - part) * x[k - whole] + part * x[before]
        assert run["link.y"][k] == pytest.approx(line, abs=1e-14)
        assert run["held.y"][k] == (7.0 if before < 0 else v[before])


def delayed_coupling(step: float) -> Diagram:
    """The oscillator, its force reaching the driven mass 0.05 s late."""
    blocks = {
        "one": Fmu(build(coupled_plants.driven_mass()), x=1.0),
        "two": Fmu(build(coupled_plants.sprung_mass()), ck=5.0),
        "link": Delay(0.05, initial=0.0),
    }
    wires = ("one.x two.far", "one.v two.far_speed", "two.force link.u", "link.y one.force")
    return wired(Diagram("late", step=step), blocks, *wires)


DELAYED = ("one.x", "one.v", "two.x", "two.v")


@pytest.mark.parametrize(
    ("algorithm", "order"),
    [(TwoPhase(), 1), (TwoPhase(extrapolation=1), 2), (GaussSeidel(), 1),
     (GaussSeidel(extrapolation=1), 2), (Iterated(extrapolation=1), 2)],
    ids=str,
)  # fmt: skip
def test_a_coupling_through_a_delay_keeps_the_order(algorithm, order: int) -> None:
    exact = references.delayed_oscillator(1 / 20480, 1024, 2 * 20480, ck=5.0)[-1]
    errors = []
    for count in (80, 160, 320):
        run = delayed_coupling(1 / count).run(2.0, algorithm=algorithm)
        errors.append(np.linalg.norm([run[name][-1] for name in DELAYED] - exact))
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.05)


def test_step_size_control_beside_a_delay() -> None:
    """The delay has samples at the base steps and lines between them: all else is divided."""
    exact = references.delayed_oscillator(1 / 40, 2, 80, ck=5.0)
    plain = delayed_coupling(1 / 40).run(2.0, algorithm=GaussSeidel(extrapolation=1))
    coarse = np.abs(np.column_stack([plain[name] for name in DELAYED]) - exact).max()
    for tolerance in (1e-4, 1e-5, 1e-6):
        run = delayed_coupling(1 / 40).run(2.0, algorithm=StepDoubling(tolerance=tolerance))
        assert len(run.time) == 81
        error = np.abs(run["two.x"] - exact[:, 2]).max()
        assert error < 10.0 * tolerance
        assert error < coarse
        assert run.info["steps"] > 2 * 80
