"""Every controller on CasADi symbols equals itself on floats: at random, at edges, in loops."""

import math
import random
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from railcosim import Block, Gain, Saturation, Sum
from railcosim.base.errors import BuildError
from railcosim.controllers import PID, FuzzySpeed, SingleNeuron, SoftSwitching
from railcosim.controllers.rules import SPEED_RULES
from railcosim.fmus import trace
from railcosim.fmus.tracing import flat
from tests.tracing import largest_difference

CONTROLLERS: dict[str, Block] = {
    "pid": PID(kp=6.65, ti=2.83, td=0.707),
    "pid_kick": PID(kp=4.743, ti=8.94, td=1.972, filter_time=0.294, kick=True),
    "fuzzy": FuzzySpeed.recommended(),
    "fuzzy_literal": FuzzySpeed.literal(),
    "fuzzy_sampled": FuzzySpeed(rules=replace(SPEED_RULES, defuzzify="sampled")),
    "neuron": SingleNeuron.recommended(),
    "neuron_fixed": SingleNeuron.recommended(gain_rules=None),
    "neuron_literal": SingleNeuron.literal(),
    "composite": SoftSwitching.recommended(),
    "composite_literal": SoftSwitching.literal(),
    "saturation": Saturation((-1.0, 1.0)),
    "gain": Gain(3.0),
    "sum": Sum("+-"),
}
TOLERANCE = 1e-12


def random_state(block: Block, generator: random.Random) -> Any:
    """A state that a run could have: numbers of its size, and a first-sample flag of 0 or 1."""

    def like(part: Any) -> Any:
        if isinstance(part, tuple):
            return tuple(like(p) for p in part)
        return generator.uniform(-2.0, 2.0)

    state = like(block.start())
    if isinstance(block, SingleNeuron):  # weights are floored or at least never all zero
        weights = tuple(generator.uniform(0.1, 50.0) for _ in range(3))
        return (generator.uniform(-10, 10), *state[1:3], weights, float(generator.random() < 0.1))
    if isinstance(block, SoftSwitching):
        neuron = random_state(block.neuron, generator)
        return (state[0], neuron, state[2], float(generator.random() < 0.1))
    return state


@pytest.mark.parametrize("name", CONTROLLERS)
def test_at_random_points(name: str) -> None:
    block, generator = CONTROLLERS[name], random.Random(11)
    states, inputs = [], []
    for _ in range(10_000):
        states.append(random_state(block, generator))
        inputs.append(tuple(generator.uniform(-3.0, 3.0) for _ in block.inputs))
    assert largest_difference(block, states, inputs) <= TOLERANCE


def edges() -> list[float]:
    """Errors at set peaks and universe ends of all rule bases, at 0, and one ulp either side."""
    peaks = {0.0}
    for scale, count in ((0.6 / 0.4, 7), (1.0, 7), (1.0, 6), (1.0, 5), (0.6, 7)):
        peaks |= {scale * p for p in np.linspace(-1.0, 1.0, count).tolist()}
    peaks |= {p * 0.05 for p in (-1.0, -0.5, 0.5, 1.0)}  # rates at peaks, from differences
    found = []
    for p in sorted(peaks):
        found += [p, math.nextafter(p, -math.inf), math.nextafter(p, math.inf)]
    return found


@pytest.mark.parametrize("name", CONTROLLERS)
def test_on_the_edges(name: str) -> None:
    """Every pair of edge values as (this error, last error), so that e and its rate are edges."""
    block = CONTROLLERS[name]
    if len(block.inputs) != 2:
        points = [(e,) for e in edges()]
        states = [block.start() for _ in points]
    else:
        points, states = [], []
        for last in edges():
            _, state = block.step(block.start(), last, 0.0)
            for e in edges():
                points.append((e, 0.0))
                states.append(state)
    assert largest_difference(block, states, points) <= TOLERANCE


@pytest.mark.parametrize("name", [n for n, b in CONTROLLERS.items() if len(b.inputs) == 2])
def test_in_closed_loops_of_1000_steps(name: str) -> None:
    """The loop is closed twice, over floats and over the traced function, each with its state."""
    block = CONTROLLERS[name]
    traced, shape = trace(block), block.start()
    a = np.array([[0.0, 1.0], [-0.0324, -0.4356]])
    h = float(block.period or 0.05)

    def plant(x: np.ndarray, u: float) -> np.ndarray:
        return x + h * (a @ x + np.array([0.0, 0.07128 * u]))

    x_float, x_trace = np.zeros(2), np.zeros(2)
    state, flat_state = shape, ca.DM(flat(shape))
    for k in range(1000):
        r = 1.0 if k < 500 else -0.4
        y, state = block.step(state, r, float(x_float[0]))
        u = y[0] if isinstance(y, tuple) else y
        y_trace, flat_state = traced(flat_state, [r, x_trace[0]], [])
        assert abs(float(y_trace[0]) - u) <= TOLERANCE
        x_float, x_trace = plant(x_float, u), plant(x_trace, float(y_trace[0]))


def test_a_parameter_can_be_a_symbol() -> None:
    traced = trace(PID(kp=1.0, ti=2.0, td=0.5), parameters=["kp", "ti"])
    y, _ = traced([0.0, 0.0, 0.0, 1.0], [0.3, 0.1], [4.0, 8.0])
    expected, _ = PID(kp=4.0, ti=8.0, td=0.5).step((0.0, 0.0, 0.0, 1.0), 0.3, 0.1)
    assert float(y) == expected


class Branches(Block):
    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: Any) -> Any:
        return (u if u > 0 else -u), x


class UsesMath(Block):
    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: Any) -> Any:
        return u * math.sqrt(2.0) + math.nan, x


def test_what_cannot_be_traced_is_refused_by_name() -> None:
    with pytest.raises(BuildError, match=r"Branches cannot be traced.*railcosim\.base\.ops"):
        trace(Branches())
    with pytest.raises(BuildError, match="UsesMath cannot be traced: it holds a NaN"):
        trace(UsesMath())


def test_tracing_leaves_casadi_as_it_was() -> None:
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    trace(PID(kp=1.0, ti=1.0, td=1.0))
    assert ca.GlobalOptions.getSimplificationOnTheFly() == before
