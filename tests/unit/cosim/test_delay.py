"""The delay against what it must do by its definition, not against its own formula."""

import math

import numpy as np
import pytest

from railcosim import Block, Delay, Diagram, Profile, Ramp, Run, Step
from railcosim.cosim.blocks.source import Source


class Sine(Source):
    """sin(omega t)."""

    __slots__ = ("omega",)
    timed = True

    def __init__(self, omega: float) -> None:
        object.__setattr__(self, "unit", "1")
        object.__setattr__(self, "omega", omega)
        object.__setattr__(self, "outputs", {"y": "1"})

    def output(self, x: object, t: float) -> float:
        return math.sin(self.omega * t)


def delayed(source: Block, delay: Delay, *, step: float = 0.1, stop: float = 3.0) -> Run:
    diagram = Diagram("delay", step=step)
    diagram.add("s", source)
    diagram.add("d", delay)
    diagram.connect("s.y", "d.u")
    return diagram.run(stop)


@pytest.mark.parametrize("time", [0.1, 0.13, 0.25, 0.3, 1.0, 1.2345])
def test_a_ramp_is_exact_for_any_delay_from_the_step_on(time: float) -> None:
    run = delayed(Ramp(slope=3.0, initial=2.0), Delay(time, initial=-7.0))
    expected = np.where(run.time < time - 1e-12, -7.0, 2.0 + 3.0 * (run.time - time))
    assert run["d.y"] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.05, 0.0999])
def test_a_ramp_is_exact_below_the_step_too(time: float) -> None:
    run = delayed(Ramp(slope=3.0), Delay(time))
    expected = np.where(run.time < time - 1e-12, 0.0, 3.0 * (run.time - time))
    assert run["d.y"] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("omega", [0.5, 2.0, 7.0])
def test_a_sine_at_half_a_sample(omega: float) -> None:
    """Linear interpolation at half a sample: gain cos(ωh/2), no phase error."""
    h, time = 0.1, 1.05
    run = delayed(Sine(omega), Delay(time), step=h)
    after = run.time > time
    expected = math.cos(omega * h / 2) * np.sin(omega * (run.time - time))
    assert np.max(np.abs(run["d.y"] - expected)[after]) < 1e-12


def test_no_delay_is_no_delay() -> None:
    for interpolation in ("linear", "hold"):
        run = delayed(Step(at=0.5), Delay(0.0, initial=9.0, interpolation=interpolation))
        assert run["d.y"].tolist() == run["s.y"].tolist()


@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_three_tenths_is_three_steps_of_a_tenth(interpolation: str) -> None:
    run = delayed(Step(at=0.2), Delay(0.3, interpolation=interpolation))  # pyright: ignore
    assert run.time[run["d.y"] > 0.5][0] == 0.5


def test_an_edge_exactly_at_the_delay() -> None:
    """At t = T the block gives u(0): the step at 0 is through."""
    run = delayed(Step(at=0.0, to=5.0), Delay(0.4, initial=1.0))
    assert run["d.y"].tolist()[:6] == [1.0, 1.0, 1.0, 1.0, 5.0, 5.0]


def test_hold_takes_the_sample_before() -> None:
    run = delayed(Ramp(slope=10.0), Delay(0.25, interpolation="hold"))
    assert run["d.y"].tolist()[:6] == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0, 2.0])
    below = delayed(Ramp(slope=10.0), Delay(0.05, interpolation="hold"))
    assert below["d.y"].tolist()[:3] == pytest.approx([0.0, 0.0, 1.0])


def test_a_jump_between_history_and_signal_is_not_smeared() -> None:
    """Until t = T the history holds, also where T lies between two samples."""
    run = delayed(Step(to=1.0), Delay(0.25, initial=-1.0))
    assert run["d.y"].tolist()[:4] == [-1.0, -1.0, -1.0, 1.0]


def test_history_as_a_function() -> None:
    run = delayed(Ramp(slope=1.0), Delay(0.55, initial=lambda t: t))
    assert run["d.y"] == pytest.approx(run.time - 0.55, abs=1e-14)


def test_start_time_is_where_history_ends() -> None:
    diagram = Diagram("late", step=0.1)
    diagram.add("s", Profile(((5.0, 1.0),)))
    diagram.add("d", Delay(0.2, initial=9.0))
    diagram.connect("s.y", "d.u")
    run = diagram.run(5.4, start=5.0)
    assert run.time.tolist() == [5.0, 5.1, 5.2, 5.3, 5.4]
    assert run["d.y"].tolist() == [9.0, 9.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(("time", "feedthrough"), [(0.0, True), (0.05, True), (0.1, False)])
def test_a_delay_breaks_a_loop_from_one_step_on(time: float, feedthrough: bool) -> None:
    from railcosim import Gain
    from railcosim.base.errors import AlgebraicLoopError

    diagram = Diagram("loop", step=0.1)
    diagram.add("d", Delay(time, initial=1.0))
    diagram.add("g", Gain(0.5))
    diagram.connect("d.y", "g.u")
    diagram.connect("g.y", "d.u")
    if feedthrough:
        with pytest.raises(AlgebraicLoopError):
            diagram.run(1.0)
    else:
        assert diagram.run(0.3)["d.y"].tolist() == [1.0, 0.5, 0.25, 0.125]


def test_hold_below_the_step_breaks_a_loop() -> None:
    from railcosim import Gain

    diagram = Diagram("loop", step=0.1)
    diagram.add("d", Delay(0.05, initial=1.0, interpolation="hold"))
    diagram.add("g", Gain(0.5))
    diagram.connect("d.y", "g.u")
    diagram.connect("g.y", "d.u")
    assert diagram.run(0.2)["d.y"].tolist() == [1.0, 0.5, 0.25]
