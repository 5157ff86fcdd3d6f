"""Algebraic loops of blocks and of FMUs: refused with their ports, solved, or not to be solved."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Gain,
    Hold,
    Ramp,
    SimulationError,
    Step,
    Sum,
)
from railcosim.base.errors import AlgebraicLoopError, ConvergenceError
from railcosim.cosim.algorithms import FixedPoint, Iterated, Jacobi, Newton, TwoPhase
from railcosim.fmus import build
from tests import plants
from tests.coupled_diagrams import same, wired


def test_without_a_solver_a_loop_of_blocks_is_refused_with_its_ports() -> None:
    blocks = {"r": Constant(1.0), "error": Sum("+-"), "gain": Gain(3.0), "link": Delay(0.0)}
    wires = ("r.y error.u1", "error.y gain.u", "gain.y link.u", "link.y error.u2")
    diagram = wired(Diagram("loop", step=0.1), blocks, *wires)
    with pytest.raises(AlgebraicLoopError) as refused:
        diagram.run(1.0)
    message = str(refused.value)
    chain = ["error.u2", "error.y", "gain.u", "gain.y", "link.u", "link.y"]
    assert all(port in message for port in chain), message
    assert re.search(r"\br\.y", message) is None
    # Each port is followed by the next of the circle, wherever it is begun.
    places = [message.index(port) for port in chain]
    turn = places.index(min(places))
    assert places[turn:] + places[:turn] == sorted(places)
    for solver in (Newton(), Newton(tolerance=1e-13)):
        run = diagram.run(1.0, algorithm=TwoPhase(loops=solver))
        assert run["gain.y"] == pytest.approx(0.75, abs=1e-10)  # 3 (1 − y)


def test_a_solver_must_converge_even_where_plain_iteration_would_not() -> None:
    """y = 3 (1 − y) repeated diverges; relaxed by 1/4 it is there at once."""
    blocks = {"r": Constant(1.0), "error": Sum("+-"), "gain": Gain(3.0)}
    wires = ("r.y error.u1", "error.y gain.u", "gain.y error.u2")
    diagram = wired(Diagram("loop", step=0.1), blocks, *wires)
    run = diagram.run(0.5, algorithm=TwoPhase(loops=FixedPoint(relaxation=0.25)))
    assert run["gain.y"] == pytest.approx(0.75, abs=1e-9)
    with pytest.raises((ConvergenceError, SimulationError), match="0 s") as failed:
        diagram.run(0.5, algorithm=TwoPhase(loops=FixedPoint()))
    assert "gain.y" in str(failed.value) or "error.y" in str(failed.value)


def test_a_chain_of_fmus_that_feed_through_is_no_loop() -> None:
    """y = 2 u three times over: at the start all agree, without a solver."""
    diagram = Diagram("chain", step=0.1)
    diagram.add("source", Constant(1.5))
    before = "source.y"
    for name in ("three", "one", "two"):  # added in another order than they are connected
        diagram.add(name, Fmu(build(plants.passing("passing"))))
    for name in ("one", "two", "three"):
        diagram.connect(before, f"{name}.u")
        before = f"{name}.y"
    run = diagram.run(0.5)
    assert run["three.y"] == pytest.approx(12.0, abs=1e-12)


@dataclass(frozen=True)
class More(Block):
    """y = u + 1: of which there is no u = y."""

    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: float) -> Any:
        return u + 1.0, x


@pytest.mark.parametrize("solver", [Newton(), FixedPoint(iterations=50)])
def test_no_solution_names_unknown_residual_and_time(solver) -> None:
    """From t = 0.3 on, where a switch closes the loop."""
    blocks = {"more": More(), "switch": _Switch(at=0.25)}
    diagram = wired(Diagram("loop", step=0.1), blocks, "more.y switch.u", "switch.y more.u")
    with pytest.raises((ConvergenceError, SimulationError)) as failed:
        diagram.run(1.0, algorithm=TwoPhase(loops=solver))
    message = str(failed.value)
    assert "0.3 s" in message
    assert "more.y" in message or "switch.y" in message
    assert "residual" in message or "differ" in message
    assert _is_about_convergence(failed.value)


def _is_about_convergence(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, ConvergenceError):
        error = error.__cause__
    return error is not None


@dataclass(frozen=True)
class _Switch(Block):
    """y = u from a time on, before that 0."""

    at: float
    inputs = {"u": "1"}
    outputs = {"y": "1"}
    timed = True

    def step(self, x: Any, t: float, u: float) -> Any:
        return (u if t >= self.at else 0.0), x


def fed_back(share: float, *, at: float) -> Diagram:
    """An FMU with feedthrough, y = 2 (share · y + r), r a step from 0 to 1."""
    blocks = {
        "pass_on": Fmu(build(plants.passing("passing"))),
        "back": Gain(share),
        "r": Step(at=at, to=1.0),
        "sum": Sum("++"),
    }
    wires = ("pass_on.y back.u", "back.y sum.u1", "r.y sum.u2", "sum.y pass_on.u")
    return wired(Diagram("loop", step=0.1), blocks, *wires)


@pytest.mark.parametrize("solver", [Newton(), FixedPoint(iterations=50)])
def test_steps_that_do_not_agree_name_unknown_residual_and_time(solver) -> None:
    with pytest.raises((ConvergenceError, SimulationError)) as failed:
        # Any y for r = 0, none behind the step.
        fed_back(0.5, at=0.25).run(1.0, algorithm=Iterated(solver=solver))
    message = str(failed.value)
    assert "pass_on.y" in message
    assert "0.2" in message or "0.3 s" in message  # the step from 0.2 s to 0.3 s
    assert "residual" in message or "differ" in message
    assert _is_about_convergence(failed.value)
    assert isinstance(failed.value, SimulationError)
    assert failed.value.run.time == pytest.approx([0.0, 0.1, 0.2], abs=1e-15)


def test_a_loop_through_an_fmu_is_none_after_the_start() -> None:
    """gain → FMU → gain: the FMU's output at t_k is that of its step; u and y alternate."""
    diagram = fed_back(0.25, at=0.2)
    run = diagram.run(1.0, algorithm=TwoPhase(loops=Newton()))
    y = [0.0]
    for k in range(10):  # y_{k+1} = 2 u_k = 2 (y_k / 4 + r_k)
        y.append(2.0 * (0.25 * y[-1] + (1.0 if k >= 2 else 0.0)))
    assert run["pass_on.y"] == pytest.approx(y, abs=1e-14)
    repeated = diagram.run(1.0, algorithm=Iterated(extrapolation=1))
    assert repeated["pass_on.y"][4:] == pytest.approx(4.0, abs=1e-8)  # y = 2 (y / 4 + 1)


@pytest.mark.parametrize("solver", [Newton(), FixedPoint(relaxation=0.5)])
def test_a_delay_below_a_step_in_a_loop(solver) -> None:
    """y = r − x, x on the line between y now (60 %) and y one step ago, but for the history."""
    blocks = {"r": Ramp(slope=1.0, initial=1.0), "sum": Sum("+-"), "link": Delay(0.04, initial=0.5)}
    diagram = wired(
        Diagram("short", step=0.1), blocks, "r.y sum.u1", "sum.y link.u", "link.y sum.u2"
    )
    with pytest.raises(AlgebraicLoopError, match=r"link\.u.*link\.y|link\.y.*link\.u"):
        diagram.run(1.0)
    run = diagram.run(1.0, algorithm=TwoPhase(loops=solver))
    y = [0.5]  # at the start the delay shows its history
    for k in range(1, 11):
        y.append((1.0 + 0.1 * k - 0.4 * y[-1]) / 1.6)
    assert run["sum.y"] == pytest.approx(y, abs=1e-9)


def test_a_loop_that_is_closed_only_at_some_hits() -> None:
    """A hold with a longer period: at its hits y = (y − 3) / 2 + 1, between them no loop."""
    blocks = {
        "hold": Hold(0.3), "half": Gain(0.5), "sum": Sum("++"), "r": Ramp(slope=1.0, initial=-0.5)
    }  # fmt: skip
    wires = ("sum.y hold.u", "hold.y half.u", "half.y sum.u1", "r.y sum.u2")
    run = wired(Diagram("slow", step=0.1), blocks, *wires).run(
        0.9, algorithm=TwoPhase(loops=Newton())
    )
    r = -0.5 + run.time
    held = 2.0 * r[np.arange(10) // 3 * 3]  # y = y / 2 + r
    assert run["hold.y"] == pytest.approx(held, abs=1e-12)
    assert run["sum.y"] == pytest.approx(0.5 * held + r, abs=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_random_linear_loops(seed: int) -> None:
    """y = M y + r with blocks: each row solves the equations."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    m = np.where(rng.random((n, n)) < 0.6, rng.uniform(-0.9, 0.9, (n, n)), 0.0)
    blocks: dict[str, Block] = {"r": Ramp(slope=1.0, initial=0.3)}
    wires = []
    for i in range(n):
        row = np.flatnonzero(m[i])
        blocks[f"y{i}"] = Sum("+" * (len(row) + 1))
        wires.append(f"r.y y{i}.u1")
        for place, j in enumerate(row):
            blocks[f"g{i}_{j}"] = Gain(float(m[i, j]))
            wires += [f"y{j}.y g{i}_{j}.u", f"g{i}_{j}.y y{i}.u{place + 2}"]
    diagram = wired(Diagram("loops", step=0.1), blocks, *wires)
    run = diagram.run(1.0, algorithm=TwoPhase(loops=Newton()))
    exact = np.outer(0.3 + run.time, np.linalg.solve(np.eye(n) - m, np.ones(n)))
    found = np.column_stack([run[f"y{i}.y"] for i in range(n)])
    assert found == pytest.approx(exact, abs=1e-9 * max(1.0, np.abs(exact).max()))
    mixed = diagram.run(1.0, algorithm=TwoPhase(loops=Newton()), engine="python")
    assert same(mixed, run)


def test_under_jacobi_a_loop_is_one_only_at_the_start() -> None:
    """Slaves are late by a step: e = r − g, g = 3 e become e_{k+1} = r_k − g_k, g_{k+1} = 3 e_k."""
    blocks = {"r": Step(at=0.3, to=2.0, before=1.0), "error": Sum("+-"), "gain": Gain(3.0)}
    wires = ("r.y error.u1", "gain.y error.u2", "error.y gain.u")
    diagram = wired(Diagram("loop", step=0.1), blocks, *wires)
    with pytest.raises(AlgebraicLoopError):
        diagram.run(1.0, algorithm=Jacobi())
    run = diagram.run(0.8, algorithm=Jacobi(loops=Newton()))
    e, g = [0.25, 0.25], [0.75, 0.75]
    for k in range(1, 8):
        r = 1.0 if k < 3 else 2.0
        e, g = [*e, r - g[-1]], [*g, 3.0 * e[-1]]
    assert run["error.y"] == pytest.approx(e, abs=1e-8)
    assert run["gain.y"] == pytest.approx(g, abs=1e-8)
