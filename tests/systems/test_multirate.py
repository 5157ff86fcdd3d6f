"""Blocks and FMUs with periods of their own: what they take and show, and when."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from railcosim import Block, Constant, Diagram, Fmu, Gain, Hold, Noise, Ramp, Step, Sum
from railcosim.base.errors import DiagramError
from railcosim.cosim.algorithms import GaussSeidel, Iterated, Jacobi, StepDoubling, TwoPhase
from railcosim.fmus import build
from tests import plants
from tests.coupled_diagrams import names, wired

H = 0.01
EVERY = [
    TwoPhase(),
    TwoPhase(extrapolation=1),
    GaussSeidel(),
    GaussSeidel(extrapolation=1),
    Iterated(),
    Iterated(extrapolation=1),
    StepDoubling(),
]


def integrator(start: float = 0.0, **options: Any) -> Fmu:
    return Fmu(build(plants.integrator(start=start)), **options)


@pytest.mark.parametrize("algorithm", [*EVERY, Jacobi()], ids=names)
def test_a_slow_fmu_takes_its_input_at_its_hits_and_shows_its_output_there(algorithm) -> None:
    """A ramp's value at each hit is held for 4 steps; between hits the output stands."""
    blocks = {
        "ramp": Ramp(slope=1.0, initial=0.5, unit="1/s"),
        "slow": integrator(2.0, period=4 * H),
    }
    run = wired(Diagram("slow", step=H), blocks, "ramp.y slow.u").run(0.4, algorithm=algorithm)
    at_hits = 2.0 + np.cumsum([0.0] + [4 * H * (0.5 + 4 * H * n) for n in range(10)])
    assert run["slow.x"] == pytest.approx(at_hits[np.arange(41) // 4], abs=1e-14)


@pytest.mark.parametrize("algorithm", [*EVERY, Jacobi()], ids=names)
def test_a_slow_fmu_beside_events(algorithm) -> None:
    """Jumps between the ticks concern those that step at every tick."""
    blocks = {
        "jump": Step(at=0.1234, to=1.0, unit="1/s"),
        "fast": integrator(),
        "slow": integrator(period=4 * H),
    }
    run = wired(Diagram("events", step=H), blocks, "jump.y fast.u slow.u").run(
        0.4, algorithm=algorithm
    )
    assert run["fast.x"] == pytest.approx(np.maximum(run.time - 0.1234, 0.0), abs=1e-14)
    seen = 0.04 * np.maximum(np.arange(41) // 4 - 4, 0)  # first taken at 0.16 s
    assert run["slow.x"] == pytest.approx(seen, abs=1e-14)


@pytest.mark.parametrize("algorithm", [TwoPhase(), Jacobi(), GaussSeidel()], ids=names)
def test_fast_and_slow_fmus_drive_each_other(algorithm) -> None:
    """a' = b every step, b' = −a every third one, c' = a every second one."""
    blocks = {
        "a": integrator(1.0),
        "b": integrator(0.5, period=3 * H),
        "c": integrator(-1.0, period=2 * H),
        "turn": Gain(-1.0, input_unit="1", unit="1/s"),
        "rate": Gain(1.0, input_unit="1", unit="1/s"),
        "pass_on": Gain(1.0, input_unit="1", unit="1/s"),
    }
    wires = ("a.x turn.u pass_on.u", "turn.y b.u", "b.x rate.u", "rate.y a.u", "pass_on.y c.u")
    run = wired(Diagram("rates", step=H), blocks, *wires).run(0.6, algorithm=algorithm)
    rows = []
    a, b, c = 1.0, 0.5, -1.0
    slope_b = slope_c = 0.0
    late = [(a, b)]
    for k in range(61):
        rows.append((a, b, c))
        # Jacobi's gains are slaves: what they compute at t_k shows at t_{k+1}.
        seen_a, seen_b = late[0] if algorithm == Jacobi() else (a, b)
        late = [(a, b)]
        if k % 3 == 0:
            slope_b = -seen_a
        if k % 2 == 0:
            slope_c = seen_a
        a += H * seen_b
        if k % 3 == 2:
            b += 3 * H * slope_b
        if k % 2 == 1:
            c += 2 * H * slope_c
    found = np.column_stack([run["a.x"], run["b.x"], run["c.x"]])
    assert found == pytest.approx(np.array(rows), abs=1e-13)


def test_a_slow_controller_on_a_fast_plant() -> None:
    """Sampled at every 5th step: exact between the samples, at any base step."""
    for part in (1, 2, 5, 10):
        blocks = {
            "plant": integrator(1.0),
            "hold": Hold(0.05),
            "gain": Gain(-8.0, input_unit="1", unit="1/s"),
        }
        wires = ("plant.x hold.u", "hold.y gain.u", "gain.y plant.u")
        run = wired(Diagram("sampled", step=0.05 / part), blocks, *wires).run(1.0)
        n = np.arange(len(run.time))
        exact = 0.6 ** (n // part) * (1.0 - 0.4 * (n % part) / part)
        assert run["plant.x"] == pytest.approx(exact, abs=1e-13)


@dataclass(frozen=True)
class Counter(Block):
    """y counts its hits, and u is added to what it has."""

    period: float
    inputs = {"u": "1"}
    outputs = {"hits": "1", "total": "1"}
    feedthrough = False

    def start(self) -> Any:
        return 0.0, 0.0

    def output(self, x: Any) -> Any:
        return x

    def update(self, x: Any, u: float) -> Any:
        return x[0] + 1.0, x[1] + u


@pytest.mark.parametrize("start", [0.0, 0.03])
def test_hits_are_counted_from_the_runs_start(start: float) -> None:
    blocks = {
        "two": Counter(2 * H),
        "three": Counter(3 * H),
        "one": Constant(1.0),
        "between": Gain(10.0),
    }
    wires = ("one.y two.u", "two.hits between.u", "between.y three.u")
    run = wired(Diagram("counters", step=H), blocks, *wires).run(start + 0.12, start=start)
    k = np.arange(13)
    # A block without feedthrough shows at its hit what its updates before have made.
    assert run["two.hits"].tolist() == (k // 2).tolist()
    assert run["three.hits"].tolist() == (k // 3).tolist()
    taken = [10.0 * (3 * n // 2) for n in range(4)]  # of `two` as it stands at 0, 3, 6, 9
    assert run["three.total"].tolist() == [sum(taken[: n // 3]) for n in k]


def test_slow_noise_is_held() -> None:
    run = wired(
        Diagram("noise", step=H), {"n": Noise(seed=1, period=0.05), "m": Noise(seed=1)}
    ).run(1.0)
    assert run["n.y"].tolist() == run["m.y"][np.arange(101) // 5].tolist()


@pytest.mark.parametrize("period", [0.015, 0.001, 0.0149999])
def test_a_period_of_no_whole_number_of_steps_is_refused(period: float) -> None:
    for block in (integrator(period=period, u=1.0), Hold(period)):
        diagram = wired(Diagram("odd", step=H), {"odd": block, "one": Constant(1.0)})
        if block.inputs:
            diagram.connect("one.y", "odd.u")
        with pytest.raises(DiagramError, match=r"odd.*period"):
            diagram.run(1.0)


@pytest.mark.parametrize("algorithm", EVERY, ids=names)
def test_fast_fmus_are_coupled_the_same_beside_a_slow_one(algorithm) -> None:
    """A slow FMU that only listens changes nothing, to the last bit."""
    blocks = {
        "a": integrator(1.0),
        "b": integrator(0.5),
        "turn": Gain(-1.0, input_unit="1", unit="1/s"),
        "rate": Gain(1.0, input_unit="1", unit="1/s"),
    }
    wires = ("a.x turn.u", "turn.y b.u", "b.x rate.u", "rate.y a.u")
    plain = wired(Diagram("pair", step=H), blocks, *wires).run(1.0, algorithm=algorithm)
    diagram = wired(Diagram("pair", step=H), blocks, *wires)
    wired(diagram, {"slow": integrator(period=0.05)}, "rate.y slow.u")
    beside = diagram.run(1.0, algorithm=algorithm)
    assert beside["a.x"].tolist() == plain["a.x"].tolist()
    assert beside["b.x"].tolist() == plain["b.x"].tolist()
    if algorithm.extrapolation == 1:
        exact = np.cos(plain.time) + 0.5 * np.sin(plain.time)
        assert plain["a.x"] == pytest.approx(exact, abs=1e-4)


def test_a_block_without_feedthrough_breaks_a_loop_at_any_rate() -> None:
    blocks = {"count": Counter(0.05), "sum": Sum("++"), "one": Constant(1.0)}
    wires = ("count.total sum.u1", "one.y sum.u2", "sum.y count.u")
    run = wired(Diagram("doubling", step=H), blocks, *wires).run(0.2)
    n = np.arange(21) // 5
    assert run["count.total"].tolist() == (2.0**n - 1.0).tolist()
