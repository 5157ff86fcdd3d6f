"""Slopes of Python blocks: right where there are any, refused by name where there are none."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest

from railcosim import Block, Constant, Diagram, Noise
from railcosim.cosim.linear.block import LinearisationError


def linear(diagram: Diagram, at: float, **options: Any) -> Any:
    """Return the map as Any: python-control declares its matrices as lists."""
    return diagram.linearise(at, **options)


@dataclass(frozen=True)
class Function(Block):
    """y = f(u)."""

    f: Any
    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: float) -> Any:
        return self.f(u), x


def slope_of(f: Any, u: float) -> float:
    diagram = Diagram("slope", step=0.1)
    diagram.add("u", Constant(u))
    diagram.add("f", Function(f))
    diagram.connect("u.y", "f.u")
    system = linear(diagram, 0.1, outputs=["f.y"])
    assert system.nstates == 0
    return float(system.D[0, 0])


@pytest.mark.parametrize(
    ("f", "u"),
    [
        (lambda u: 1.0 if u >= 0.0 else -1.0, 0.0),
        (lambda u: 1.0 if u > 1e-9 else -1.0, 0.0),
        (lambda u: math.copysign(1.0, u - 3.0), 3.0),
        (abs, 0.0),
        (lambda u: min(u, 10.0), 10.0),
        (lambda u: max(-10.0, u), -10.0),
        (lambda u: 100.0 * u if u < 2.0 else 101.0 * u - 2.0, 2.0),
        (lambda u: 1e6 * u + (1e5 if u >= 1.0 else 0.0), 1.0),
        (lambda u: round(1000.0 * u) / 1000.0, 0.0005),
    ],
)
def test_jumps_and_bends_are_refused_by_name(f: Any, u: float) -> None:
    with pytest.raises(
        LinearisationError, match=r"block 'f' at t = 0.1 s: output 'y' jumps or bend"
    ):
        slope_of(f, u)


def test_the_refusal_gives_the_slopes_of_both_sides() -> None:
    with pytest.raises(LinearisationError) as caught:
        slope_of(lambda u: max(0.0, 2.0 * u), 0.0)
    assert str(caught.value) == (
        "block 'f' at t = 0.1 s: output 'y' jumps or bends where input 'u' is 0 (slope 0 below, 2 "
        "above); linearise at another time, or put a smooth block in its place"
    )


@pytest.mark.parametrize(
    ("f", "u", "slope"),
    [
        (lambda u: 3.0 * u + 1e6, 0.1, 3.0),
        (lambda u: 1e-9 * u, 22.0, 1e-9),
        (lambda u: 5.0, 2.0, 0.0),
        (lambda u: (u + 1e9) - 1e9 - u, 0.3, 0.0),
        (lambda u: u * u, 0.0, 0.0),
        (lambda u: u**3, 0.0, 0.0),
        (lambda u: u * abs(u), 0.0, 0.0),
        (lambda u: u**3, 17.0, 3 * 17.0**2),
        (math.sin, 1.0, math.cos(1.0)),
        (math.exp, 20.0, math.exp(20.0)),
        (lambda u: math.tanh(100.0 * u), 0.0, 100.0),
        (lambda u: min(2.0 * u, 10.0), 4.999, 2.0),
        (lambda u: min(2.0 * u, 10.0), 5.001, 0.0),
        (lambda u: 1e-3 / u, 1e-2, -10.0),
        (math.sqrt, 1e-2, 5.0),
        (lambda u: u**0.5, 1e-5, 0.5 / 1e-5**0.5),
    ],
)
def test_slopes(f: Any, u: float, slope: float, recwarn: pytest.WarningsRecorder) -> None:
    assert slope_of(f, u) == pytest.approx(slope, rel=1e-7, abs=1e-7 if slope == 0.0 else 0.0)
    assert not recwarn.list


@pytest.mark.parametrize(
    ("f", "u", "place"),
    [
        (lambda u: 1.0 if u > 0.0 else -1.0, 3e-4, 0.0),
        (lambda u: round(100.0 * u) / 100.0, 3.0148, 3.015),
        (lambda u: u if u < 1.0005 else u + 1e-3, 1.0, 1.0005),
    ],
)
def test_a_jump_nearby_is_told(f: Any, u: float, place: float) -> None:
    with pytest.warns(UserWarning) as caught:
        slope_of(f, u)
    (text,) = (str(w.message) for w in caught)
    assert text.startswith("block 'f' at t = 0.1 s: output 'y' jumps where input 'u' is ")
    assert float(text.split(" is ")[1].split(",")[0]) == pytest.approx(place, abs=1e-12)


def test_a_domain_that_ends_beside_the_point() -> None:
    with pytest.raises(
        LinearisationError, match=r"block 'f' at t = 0.1 s cannot be evaluated besi"
    ):
        slope_of(math.sqrt, 0.0)


# Python blocks' states


@dataclass(frozen=True)
class Counting(Block):
    """Counts in whole numbers, and integrates; at every third hit it resets when it `resets`."""

    resets: bool = False
    inputs = {"u": "1"}
    outputs = {"y": "1"}
    feedthrough = False

    def start(self) -> Any:
        return 0, 0, "on"

    def output(self, x: Any) -> Any:
        return x[1]

    def update(self, x: Any, u: float) -> Any:
        count, total, word = x
        return count + 1, u if self.resets and count % 3 == 0 else total + u, word


def counting(block: Block) -> Diagram:
    diagram = Diagram("counting", step=0.1)
    diagram.add("noise", Noise(seed=1))
    diagram.add("sum", block)
    diagram.connect("noise.y", "sum.u")
    return diagram


def test_whole_numbers_are_modes_but_a_sum_that_begins_with_one_is_a_state() -> None:
    for at in (0.0, 0.5):
        system = linear(counting(Counting()), at, outputs=["sum.y"])
        assert system.state_labels == ["sum.x[1]"]
        matrices = [M.tolist() for M in (system.A, system.B, system.C, system.D)]
        assert matrices == [[[1.0]], [[1.0]], [[1.0]], [[0.0]]]


def test_a_mode_that_changes_what_the_block_does_is_refused() -> None:
    with pytest.raises(LinearisationError, match="'sum' at t = 0.6 s does something else at its n"):
        linear(counting(Counting(resets=True)), 0.6)


class Marks(NamedTuple):
    level: float
    last: float


@dataclass(frozen=True)
class Marked(Block):
    """A lag with a named tuple for a state, in which infinity stands for never."""

    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def start(self) -> Marks:
        return Marks(0.0, -math.inf)

    def step(self, x: Marks, u: float) -> tuple[float, Marks]:
        return x.level, Marks(0.5 * x.level + u, x.last)


def test_a_named_tuple_and_an_infinite_mark() -> None:
    system = linear(counting(Marked()), 0.3, outputs=["sum.y"])
    assert system.state_labels == ["sum.x[0]"]
    assert (system.A.tolist(), system.B.tolist()) == ([[0.5]], [[1.0]])


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ([0.0], r"its state holds a list; linearise\(\) needs a \(nested\) tuple of numbers"),
        (np.zeros(2), "its state holds a ndarray"),
        ((), "its state changes its shape; linearise later"),
    ],
)
def test_states_of_other_kinds(start: Any, message: str) -> None:
    class Other(Block):
        inputs = {"u": "1"}
        outputs = {"y": "1"}

        def start(self) -> Any:
            return start

        def step(self, x: Any, u: float) -> Any:
            return u, x if isinstance(start, list | np.ndarray) else (*x, u)

    with pytest.raises(LinearisationError, match=message):
        linear(counting(Other()), 0.1)
