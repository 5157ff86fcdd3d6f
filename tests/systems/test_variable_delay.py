"""The variable delay in diagrams: in loops over FMUs, against known solutions and against Delay."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from railcosim import Block, Constant, Delay, Diagram, Fmu, Gain, Noise, Ramp, Run, SimulationError
from railcosim.base.errors import AlgebraicLoopError
from railcosim.cosim.blocks.source import Source
from railcosim.cosim.blocks.variable_delay import VariableDelay
from railcosim.fmus import build
from tests import plants

KINDS = ["time", "transport"]


class Signal(Source):
    """A function of time."""

    __slots__ = ("function",)
    timed = True

    def __init__(self, function: Callable[[float], float], unit: str = "1") -> None:
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "function", function)
        object.__setattr__(self, "outputs", {"y": unit})

    def output(self, x: object, t: float) -> float:
        return self.function(t)


def beside(delay: float, variable: VariableDelay, *, step: float = 0.1, start: float = 0.0) -> Run:
    """Run noise through a Delay and a VariableDelay of the same time."""
    diagram = Diagram("beside", step=step)
    diagram.add("s", Noise(seed=3))
    diagram.add("time", Constant(delay, unit="s"))
    diagram.add("d", Delay(delay, initial=variable.initial, interpolation=variable.interpolation))
    diagram.add("v", variable)
    diagram.connect("s.y", "d.u")
    diagram.connect("s.y", "v.u")
    diagram.connect("time.y", "v.delay")
    return diagram.run(start + 1000 * step, start=start)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("interpolation", ["linear", "hold"])
@pytest.mark.parametrize("start", [0.0, -7.3, 86400.1])
@pytest.mark.parametrize("delay", [0.1, 0.3, 0.7, 5.0])
def test_whole_steps_are_those_of_delay_bit_for_bit(
    kind: Any, interpolation: Any, start: float, delay: float
) -> None:
    variable = VariableDelay(maximum=5.0, kind=kind, interpolation=interpolation, initial=9.0)
    run = beside(delay, variable, start=start)
    assert run["v.y"].tolist() == run["d.y"].tolist()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("delay", [0.02, 0.25, 0.3333, 1.2345])
def test_parts_of_a_step_are_those_of_delay(kind: Any, delay: float) -> None:
    """With "hold" bit for bit; a straight line differs by the rounding of t − delay."""
    held = VariableDelay(maximum=2.0, kind=kind, interpolation="hold", initial=9.0)
    run = beside(delay, held)
    assert run["v.y"].tolist() == run["d.y"].tolist()
    run = beside(delay, VariableDelay(maximum=2.0, kind=kind, initial=math.sin))
    assert run["v.y"] == pytest.approx(run["d.y"], abs=2e-12)


# Loops over an FMU: x' = −gain · (x, delayed)


def retarded(
    link: Block,
    step: float,
    stop: float,
    *,
    delay: Callable[[float], float] | None = None,
    gain: float = 1.0,
    start: float = 1.0,
) -> Run:
    diagram = Diagram("retarded", step=step)
    diagram.add("plant", Fmu(build(plants.integrator(start=start))))
    diagram.add("link", link)
    diagram.add("minus", Gain(-gain, input_unit="1", unit="1/s"))
    if delay is not None:
        diagram.add("delay", Signal(delay, "s"))
        diagram.connect("delay.y", "link.delay")
    diagram.connect("plant.x", "link.u")
    diagram.connect("link.y", "minus.u")
    diagram.connect("minus.y", "plant.u")
    return diagram.run(stop)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("smallest", [0.0, 0.05])
def test_the_retarded_loop_is_that_of_delay(kind: Any, smallest: float) -> None:
    """With x(3) = −1/6 by the method of steps, and the stability boundary, as Delay shows them."""
    variable = VariableDelay(maximum=1.0, smallest=smallest, kind=kind, initial=1.0)
    run = retarded(variable, 0.05, 20.0, delay=lambda t: 1.0)
    same = retarded(Delay(1.0, initial=1.0), 0.05, 20.0)
    assert run["plant.x"].tolist() == same["plant.x"].tolist()
    assert run["plant.x"][60] == pytest.approx(-1.0 / 6.0, abs=0.03)


@pytest.mark.parametrize("kind", KINDS)
def test_the_boundary_of_stability_shows_no_hidden_step(kind: Any) -> None:
    """K = (2/h) sin(π / (2 (2d + 1))) for d = 20 steps: below it decays, above it grows."""
    h, d = 0.05, 20
    boundary = 2.0 / h * math.sin(math.pi / (2.0 * (2 * d + 1)))
    for gain, grows in ((boundary - 0.01, False), (boundary + 0.01, True)):
        variable = VariableDelay(maximum=1.0, kind=kind, initial=1.0)
        x = np.abs(retarded(variable, h, 400.0, delay=lambda t: 1.0, gain=gain)["plant.x"])
        third = len(x) // 3
        assert bool(x[-third:].max() > x[third : 2 * third].max()) == grows


def pantograph(t: float, q: float) -> float:
    """Return the solution of x'(t) = −x(q t), x(0) = 1: Σ (−t)^n q^(n (n − 1) / 2) / n!."""
    total, term = 1.0, 1.0
    for n in range(1, 80):
        term *= -t * q ** (n - 1) / n
        total += term
    return total


def orders(run: Callable[[float], Run], exact: Callable[[float], float]) -> np.ndarray:
    errors = []
    for step in (0.1, 0.05, 0.025, 0.0125):
        result = run(step)
        truth = np.array([exact(t) for t in result.time])
        errors.append(float(np.max(np.abs(result["plant.x"] - truth))))
    assert errors[-1] < 0.01
    return np.log2(np.array(errors[:-1]) / errors[1:])


def test_the_pantograph_equation() -> None:
    """τ = t / 2: x'(t) = −x(t / 2), no delay at all at the start, none of it history."""

    def unused(t: float) -> float:
        raise AssertionError(f"history asked for at {t} s")

    link = VariableDelay(maximum=4.0, initial=unused)
    found = orders(
        lambda step: retarded(link, step, 8.0, delay=lambda t: t / 2),
        lambda t: pantograph(t, 0.5),
    )
    assert found[-1] == pytest.approx(1.0, abs=0.1)


def test_the_pantograph_equation_through_a_pipe() -> None:
    """τ = 0.8 + 0.2 t as a transit: t_in + 4 = (t + 4) e^−0.2, the equation with s = t + 4.

    In the history the block keeps τ at 0.8, so its place θ there stands for s = 4 e^(θ / 4).
    """
    q = math.exp(-0.2)
    found = orders(
        lambda step: retarded(
            VariableDelay(
                maximum=3.0,
                kind="transport",
                initial=lambda t: pantograph(4.0 * math.exp(t / 4.0), q),
            ),
            step,
            6.0,
            delay=lambda t: 0.8 + 0.2 * t,
            start=pantograph(4.0, q),
        ),
        lambda t: pantograph(t + 4.0, q),
    )
    assert found[-1] == pytest.approx(1.0, abs=0.1)


# Loops without an FMU


def block_loop(smallest: float, *, period: float = 0.1) -> Diagram:
    diagram = Diagram("loop", step=0.1)
    diagram.add("time", Constant(period, unit="s"))
    diagram.add("v", VariableDelay(maximum=5.0, smallest=smallest, initial=1.0))
    diagram.add("g", Gain(0.5))
    diagram.connect("time.y", "v.delay")
    diagram.connect("v.y", "g.u")
    diagram.connect("g.y", "v.u")
    return diagram


def test_a_declared_smallest_delay_breaks_a_loop() -> None:
    assert block_loop(0.1).run(0.4)["v.y"].tolist() == [1.0, 0.5, 0.25, 0.125, 0.0625]
    assert block_loop(0.1, period=0.2).run(0.4)["v.y"].tolist() == [1.0, 1.0, 0.5, 0.5, 0.25]


def test_without_one_the_loop_is_algebraic_however_long_the_delay() -> None:
    with pytest.raises(AlgebraicLoopError, match=r"v\.y → g\.u"):
        block_loop(0.0, period=5.0).run(1.0)


def test_a_loop_through_the_delay_time_stays_algebraic() -> None:
    diagram = Diagram("loop", step=0.1)
    diagram.add("s", Ramp())
    diagram.add("v", VariableDelay(maximum=5.0, smallest=0.1, initial=1.0))
    diagram.add("g", Gain(0.5, input_unit="1", unit="s"))
    diagram.connect("s.y", "v.u")
    diagram.connect("v.y", "g.u")
    diagram.connect("g.y", "v.delay")
    with pytest.raises(AlgebraicLoopError, match=r"g\.y → v\.delay"):
        diagram.run(1.0)


# Failures name the block, the time and the values


@pytest.mark.parametrize(
    ("block", "delay", "words"),
    [
        (
            VariableDelay(maximum=1.0),
            lambda t: 0.85 + t,
            "delay = 1.05 s must lie from smallest = 0 s to maximum = 1 s",
        ),
        (
            VariableDelay(maximum=1.0, smallest=0.3),
            lambda t: 0.45 - t,
            "delay = 0.25 s must lie from smallest = 0.3 s to maximum = 1 s",
        ),
        (
            VariableDelay(maximum=1.0, kind="transport"),
            lambda t: 0.2 - t,
            "delay = 0 s must be positive",
        ),
        (
            VariableDelay(maximum=0.1, kind="transport"),
            lambda t: 9.0,
            "what leaves has been inside for more than maximum = 0.1 s",
        ),
        (
            VariableDelay(maximum=1.0, smallest=0.01),
            lambda t: 0.35 - 1.5 * t,
            "delay = 0.05 s with smallest = 0.01 s asks for a sample that is not there",
        ),
    ],
)
def test_a_failure_names_the_block_and_the_time(
    block: Block, delay: Callable[[float], float], words: str
) -> None:
    diagram = Diagram("failing", step=0.1)
    diagram.add("s", Ramp())
    diagram.add("time", Signal(delay, "s"))
    diagram.add("pipe", block)
    diagram.connect("s.y", "pipe.u")
    diagram.connect("time.y", "pipe.delay")
    with pytest.raises(SimulationError, match="block 'pipe' failed at t = 0.2 s") as caught:
        diagram.run(1.0)
    assert words in str(caught.value)
    assert caught.value.run.time.tolist() == [0.0, 0.1]
