"""Who is named when a block of a solved loop, or one between FMUs, gives no number; and guesses."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from railcosim import (
    Block,
    Constant,
    Diagram,
    FixedPoint,
    Fmu,
    Gain,
    GaussSeidel,
    Iterated,
    Newton,
    SimulationError,
    StepDoubling,
    TwoPhase,
)
from railcosim.fmus import build
from tests import plants

in_both_engines = pytest.mark.parametrize("engine", ["python", "compiled"])
ACROSS = [GaussSeidel(), TwoPhase(extrapolation=1), Iterated(), StepDoubling()]


def named(value: Any) -> str:
    """Return a short name for a test of it."""
    return type(value).__name__


@dataclass(frozen=True)
class Breaks(Block):
    """Half of its input, until it breaks at 0.4 s."""

    how: str
    continuous: bool = False
    timed = True
    inputs = {"u": None}
    outputs = {"y": None}

    def step(self, x: Any, t: float, u: float) -> Any:
        if t < 0.35:
            return 0.5 * u, x
        if self.how == "raises":
            raise ZeroDivisionError("no oil")
        if self.how == "exits":
            raise SystemExit(3)
        return BROKEN[self.how], x


BROKEN: dict[str, Any] = {
    "nan": math.nan,
    "infinity": math.inf,
    "text": "high",
    "pair": (1.0, 2.0),
    "none": None,
    "array": np.ones(2),
    "complex": 1j,
}
WAYS = ["raises", "exits", *BROKEN]


@in_both_engines
@pytest.mark.parametrize("how", WAYS)
@pytest.mark.parametrize("loops", [Newton(), FixedPoint()], ids=named)
def test_a_block_of_a_solved_loop_is_named(loops: Any, how: str, engine: str) -> None:
    diagram = Diagram("loop", step=0.1)
    diagram.add("b", Gain(0.5))
    diagram.add("a", Breaks(how))
    diagram.connect("a.y", "b.u")
    diagram.connect("b.y", "a.u")
    with pytest.raises(SimulationError, match=r"block 'a' .*t = 0\.4 s") as caught:
        diagram.run(1.0, algorithm=TwoPhase(loops=loops), engine=engine)
    assert caught.value.run.time.tolist()[:4] == [0.0, 0.1, 0.2, 0.3]


@in_both_engines
@pytest.mark.parametrize("how", WAYS)
@pytest.mark.parametrize("algorithm", ACROSS, ids=named)
def test_a_block_between_fmus_is_named(algorithm: Any, how: str, engine: str) -> None:
    fmu = build(plants.integrator())
    diagram = Diagram("between", step=0.1)
    diagram.add("one", Constant(1.0, unit="1/s"))
    diagram.add("j", Fmu(fmu))
    diagram.add("i", Fmu(fmu))
    diagram.add("a", Breaks(how, continuous=True))
    diagram.add("unit", Gain(1.0, input_unit="1", unit="1/s"))
    for ports in (("one.y", "i.u"), ("i.x", "a.u"), ("a.y", "unit.u"), ("unit.y", "j.u")):
        diagram.connect(*ports)
    with pytest.raises(SimulationError, match=r"block 'a' |\ba\.y is ") as caught:
        diagram.run(1.0, algorithm=algorithm, engine=engine)
    assert caught.value.run.time.tolist()[:3] == [0.0, 0.1, 0.2]


@dataclass(frozen=True)
class Bowl(Block):
    """y = (u² + 1) / 4; with y = u that has the solutions 2 ± √3."""

    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: float) -> tuple[float, Any]:
        return (u * u + 1.0) / 4.0, x


@in_both_engines
@pytest.mark.parametrize("algorithm", [TwoPhase, GaussSeidel, Iterated])
@pytest.mark.parametrize(
    "signals",
    [
        ["g0.y"],
        ["g1.y"],
        ["g2.y"],
        ["bowl.y"],
        ["g2.y", "bowl.y"],
    ],
)
def test_a_guess_for_any_signal_leads_to_its_solution(
    signals: list[str], algorithm: Any, engine: str
) -> None:
    """Newton's way from 5 falls to the upper one; from 0.2 both go to the lower one."""
    diagram = Diagram("bowl", step=0.1)
    diagram.add("bowl", Bowl())
    for i, source in enumerate(("bowl.y", "g0.y", "g1.y")):
        diagram.add(f"g{i}", Gain(1.0))
        diagram.connect(source, f"g{i}.u")
    diagram.connect("g2.y", "bowl.u")
    upper, lower = 2.0 + math.sqrt(3.0), 2.0 - math.sqrt(3.0)
    for solver, start, solution in (
        (Newton, 5.0, upper),
        (Newton, 0.2, lower),
        (FixedPoint, 0.2, lower),
        (FixedPoint, 3.0, lower),
    ):
        loops = solver(guess=dict.fromkeys(signals, start))
        run = diagram.run(0.3, algorithm=algorithm(loops=loops), engine=engine)
        assert run.values == pytest.approx(np.full((4, 4), solution), abs=1e-8)
