"""Rows hold what belongs to their time, and jumps between the steps act when they happen."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from railcosim import Block, Constant, Diagram, Fmu, Gain, Profile, Pulse, Ramp, Step, Sum
from railcosim.cosim.algorithms import GaussSeidel, Iterated, Jacobi, StepDoubling, TwoPhase
from railcosim.fmus import build
from tests import plants
from tests.coupled_diagrams import names, wired

EVERY = [
    TwoPhase(),
    TwoPhase(extrapolation=1),
    Jacobi(),
    GaussSeidel(),
    GaussSeidel(extrapolation=1),
    Iterated(),
    Iterated(extrapolation=1),
    StepDoubling(),
]
CONTINUOUS = [a for a in EVERY if a != Jacobi()]  # of which a gain is no slave that samples
STEPS = [0.2, 0.1, 0.05, 0.02, 0.01]


def driven(source: Block, step: Any, *chain: Block, start: float = 0.0) -> Diagram:
    """An integrator behind a source and a chain of blocks."""
    blocks = {f"block{n}": block for n, block in enumerate((source, *chain))}
    wires = [f"block{n}.y block{n + 1}.u" for n in range(len(chain))]
    wires.append(f"block{len(chain)}.y plant.u")
    plant = {"plant": Fmu(build(plants.integrator(start=start)))}
    return wired(Diagram("driven", step=step), blocks | plant, *wires)


# Rows


@pytest.mark.parametrize("algorithm", EVERY, ids=names)
def test_rows_hold_the_values_of_their_own_time(algorithm) -> None:
    """x' = −x and an integrator behind it, neither at rest: 1/x and the sum are known."""
    blocks = {
        "decay": Fmu(build(plants.tunable())),
        "plant": Fmu(build(plants.integrator(start=-3.0))),
        "rate": Constant(2.0, unit="1/s"),
    }
    diagram = wired(Diagram("decay", step=0.1), blocks, "rate.y plant.u")
    run = diagram.run(2.0, algorithm=algorithm)
    assert run.time.tolist() == [k / 10 for k in range(21)]
    assert run["decay.x"] == pytest.approx(np.exp(-run.time), abs=1e-12)
    assert run["plant.x"] == pytest.approx(2.0 * run.time - 3.0, abs=1e-13)
    assert run["decay.x"][0] == 1.0 and run["plant.x"][0] == -3.0


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_n_steps_give_n_plus_one_rows(count: int) -> None:
    for step in (Fraction(1, 3), 0.1, 0.05):
        diagram = driven(Constant(1.0, unit="1/s"), step, start=5.0)
        run = diagram.run(count * Fraction(str(step)))
        assert len(run.time) == count + 1
        # The FMU's solver makes inner steps of 2 ms at most, each with its rounding.
        rounding = 1e-16 * (run.time / 0.002 + 10.0) * (5.0 + run.time)
        assert np.all(np.abs(run["plant.x"] - 5.0 - run.time) <= rounding)
        assert run.time.tolist() == [float(k * Fraction(str(step))) for k in range(count + 1)]


def test_a_later_start_counts_its_rows_from_there() -> None:
    diagram = driven(Ramp(slope=1.0, unit="1/s"), 0.1, start=2.0)
    run = diagram.run(3.0, start=2.5, algorithm=TwoPhase(extrapolation=1))
    assert run.time.tolist() == [2.5, 2.6, 2.7, 2.8, 2.9, 3.0]
    assert run["plant.x"] == pytest.approx(2.0 + 0.5 * (run.time**2 - 2.5**2), abs=1e-13)


def test_a_proportional_loop_tells_the_two_semantics_apart() -> None:
    """x' = 4 (1 − x): native x_{k+1} = x_k + 4 h (1 − x_k); Jacobi computes a step late."""
    blocks = {
        "r": Constant(1.0),
        "error": Sum("+-"),
        "gain": Gain(4.0, input_unit="1", unit="1/s"),
        "plant": Fmu(build(plants.integrator(start=0.25))),
    }
    wires = ("r.y error.u1", "plant.x error.u2", "error.y gain.u", "gain.y plant.u")
    diagram = wired(Diagram("loop", step=0.05), blocks, *wires)
    native, jacobi = (diagram.run(2.0, algorithm=a) for a in (TwoPhase(), Jacobi()))
    x = [0.25]
    for _ in range(40):
        x.append(x[-1] + 0.2 * (1.0 - x[-1]))
    assert native["plant.x"] == pytest.approx(x, abs=1e-14)
    late = [0.25]  # two slaves, error and gain, each a step late; before the start all stood still
    for k in range(40):
        late.append(late[-1] + 0.2 * (1.0 - late[max(k - 2, 0)]))
    assert jacobi["plant.x"] == pytest.approx(late, abs=1e-14)
    assert np.abs(native["plant.x"] - jacobi["plant.x"]).max() > 0.1


# Sources that jump between steps


@pytest.mark.parametrize("algorithm", EVERY, ids=names)
@pytest.mark.parametrize("step", STEPS)
def test_a_step_between_two_ticks(algorithm, step: float) -> None:
    run = driven(Step(at=0.537, to=2.0, before=-1.0, unit="1/s"), step).run(
        1.0, algorithm=algorithm
    )
    exact = np.where(run.time <= 0.537, -run.time, -0.537 + 2.0 * (run.time - 0.537))
    assert run["plant.x"] == pytest.approx(exact, abs=2e-14)
    assert run["block0.y"].tolist() == [2.0 if t >= 0.537 else -1.0 for t in run.time]


@pytest.mark.parametrize("algorithm", CONTINUOUS, ids=names)
@pytest.mark.parametrize("step", STEPS)
def test_a_pulse_inside_one_step(algorithm, step: float) -> None:
    """Both edges in one step of 0.2 s down to 0.02 s; no tick ever sees the pulse there."""
    source = Pulse(at=0.403, width=0.011, height=50.0, base=1.0, unit="1/s")
    run = driven(source, step, Gain(2.0)).run(1.0, algorithm=algorithm)
    exact = 2.0 * (run.time + 49.0 * np.clip(run.time - 0.403, 0.0, 0.011))
    assert run["plant.x"] == pytest.approx(exact, abs=5e-14)


@pytest.mark.parametrize("at", [0.3, 0.3 + 1e-13, 0.3 - 1e-13, 0.1 + 0.2, 0.35, 0.0, 1.0, 7.0])
def test_a_jump_on_a_tick_or_beside_it(at: float) -> None:
    run = driven(Step(at=at, to=1.0, unit="1/s"), 0.1).run(1.0)
    assert run["plant.x"][-1] == pytest.approx(max(0.0, 1.0 - at), abs=2e-14)
    assert len(run.time) == 11


def test_two_jumps_at_one_time_and_several_in_a_step() -> None:
    edges = (0.512, 0.512, 0.537, 0.55, 0.5999999)
    blocks: dict[str, Block] = {"sum": Sum("+" * len(edges))}
    blocks |= {f"s{n}": Step(at=at, to=n + 1.0, unit="1/s") for n, at in enumerate(edges)}
    blocks["plant"] = Fmu(build(plants.integrator()))
    wires = [f"s{n}.y sum.u{n + 1}" for n in range(len(edges))]
    diagram = wired(Diagram("several", step=0.1), blocks, "sum.y plant.u", *wires)
    for algorithm in CONTINUOUS:
        run = diagram.run(1.0, algorithm=algorithm)
        exact = sum((n + 1) * np.maximum(run.time - at, 0.0) for n, at in enumerate(edges))
        assert run["plant.x"] == pytest.approx(exact, abs=2e-14)


@dataclass(frozen=True)
class Square(Block):
    """±1, changing every `half` s: a user's own source."""

    half: float
    outputs = {"y": "1/s"}
    feedthrough = False
    timed = True

    def output(self, x: Any, t: float) -> float:
        return 1.0 if self._count(t) % 2 == 0 else -1.0

    def next_event(self, x: Any, t: float) -> float:
        return (self._count(t) + 1) * self.half

    def _count(self, t: float) -> int:
        count = math.floor(t / self.half)
        while (count + 1) * self.half <= t:
            count += 1
        while count * self.half > t:
            count -= 1
        return count


@pytest.mark.parametrize("half", [0.173, 0.0173])
@pytest.mark.parametrize("algorithm", EVERY, ids=names)
def test_a_users_own_events(algorithm, half: float) -> None:
    for step in (0.1, 0.05):
        run = driven(Square(half=half), step).run(2.0, algorithm=algorithm)
        triangle = half - np.abs((run.time % (2.0 * half)) - half)
        assert run["plant.x"] == pytest.approx(triangle, abs=1e-12)


@pytest.mark.parametrize("algorithm", CONTINUOUS, ids=names)
@pytest.mark.parametrize("jump", [0.5, 0.55])
def test_a_profile_with_a_jump(algorithm, jump: float) -> None:
    """Its lines are followed where inputs are extrapolated, and its jump ends a line."""
    points = ((0.0, 0.0), (jump, 2.0 * jump), (jump, 3.0), (1.0, 3.0))
    run = driven(Profile(points, unit="1/s"), 0.1).run(1.0, algorithm=algorithm)
    if algorithm.extrapolation == 1:
        t = np.minimum(run.time, jump)
        assert run["plant.x"] == pytest.approx(t * t + 3.0 * (run.time - t), abs=1e-13)
    else:  # held from tick to tick, and at the jump
        held = np.cumsum([0.0] + [0.1 * 0.2 * k if k < 5 else 0.3 for k in range(10)])
        if jump == 0.55:
            held[6:] += 0.05 * (1.0 - 3.0)
        assert run["plant.x"] == pytest.approx(held, abs=1e-13)


@pytest.mark.parametrize("algorithm", CONTINUOUS, ids=names)
def test_at_an_event_continuous_signals_are_taken_anew(algorithm) -> None:
    """x' = x + r: with held inputs the FMU's own output is fed back again where r jumps."""
    blocks = {
        "plant": Fmu(build(plants.integrator(start=1.0))),
        "r": Step(at=0.14, to=1.0, unit="1/s"),
        "sum": Sum("++"),
        "back": Gain(1.0, input_unit="1", unit="1/s"),
    }
    wires = ("plant.x back.u", "back.y sum.u1", "r.y sum.u2", "sum.y plant.u")
    run = wired(Diagram("feedback", step=0.1), blocks, *wires).run(0.3, algorithm=algorithm)
    if algorithm == TwoPhase():
        x = [1.0, 1.1]
        middle = 1.1 + 0.04 * 1.1
        x.append(middle + 0.06 * (middle + 1.0))
        x.append(x[-1] + 0.1 * (x[-1] + 1.0))
        assert run["plant.x"] == pytest.approx(x, abs=1e-14)
    exact = np.exp(run.time) + np.expm1(np.maximum(run.time - 0.14, 0.0))
    assert run["plant.x"] == pytest.approx(exact, abs=0.1 if algorithm.extrapolation == 0 else 0.02)
