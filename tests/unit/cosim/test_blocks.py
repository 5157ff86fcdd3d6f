import math

import numpy as np
import pytest

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Gain,
    Hold,
    Noise,
    Profile,
    Pulse,
    Ramp,
    Run,
    Saturation,
    Step,
    Sum,
)
from railcosim.base.errors import ParameterError


def run_source(block: Block, *, step: float = 0.1, stop: float = 1.0) -> Run:
    diagram = Diagram("source", step=step)
    diagram.add("s", block)
    return diagram.run(stop)


def run_through(source: Block, block: Block, *, step: float = 0.1, stop: float = 1.0) -> Run:
    diagram = Diagram("chain", step=step)
    diagram.add("s", source)
    diagram.add("b", block)
    diagram.connect("s.y", f"b.{next(iter(block.inputs))}")
    return diagram.run(stop)


def test_constant_and_step() -> None:
    assert set(run_source(Constant(2.5))["s.y"]) == {2.5}
    values = run_source(Step(at=0.3, to=2.0, before=-1.0))["s.y"]
    assert values.tolist() == [-1.0] * 3 + [2.0] * 8  # at t = 0.3 exactly the step has happened


def test_pulse_has_its_edges_on_decimal_times() -> None:
    values = run_source(Pulse(at=0.1, width=0.2, height=3.0, base=1.0))["s.y"]
    assert values.tolist() == [1.0, 3.0, 3.0] + [1.0] * 8


def test_ramp() -> None:
    run = run_source(Ramp(slope=2.0, at=0.5, initial=1.0))
    assert run["s.y"] == pytest.approx(1.0 + 2.0 * np.maximum(run.time - 0.5, 0.0), abs=1e-15)


def test_profile_is_linear_with_jumps_and_held_ends() -> None:
    block = Profile(((0.2, 0.0), (0.4, 2.0), (0.4, 5.0), (0.8, 1.0)))
    values = run_source(block)["s.y"]
    expected = [0.0, 0.0, 0.0, 1.0, 5.0, 4.0, 3.0, 2.0, 1.0, 1.0, 1.0]
    assert values == pytest.approx(expected, abs=1e-14)


def test_noise_depends_on_the_seed_alone() -> None:
    one, same = (run_source(Noise(seed=7), stop=300.0)["s.y"] for _ in range(2))
    other = run_source(Noise(seed=8), stop=300.0)["s.y"]
    assert one.tolist() == same.tolist()
    assert one.tolist() != other.tolist()


def test_noise_is_normal() -> None:
    values = run_source(Noise(seed=1, deviation=2.0, mean=3.0), stop=2000.0)["s.y"]
    n = len(values)
    assert abs(values.mean() - 3.0) < 4.0 * 2.0 / math.sqrt(n)
    assert abs(values.std() / 2.0 - 1.0) < 4.0 / math.sqrt(2 * n)
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 4.0 / math.sqrt(n)


def test_noise_holds_over_its_period() -> None:
    values = run_source(Noise(seed=1, period=0.3))["s.y"]
    assert values[0] == values[1] == values[2] != values[3] == values[5]


def test_gain_saturation_hold() -> None:
    ramp = Ramp(slope=1.0)
    assert run_through(ramp, Gain(3.0))["b.y"][-1] == 3.0
    assert run_through(ramp, Saturation((0.2, 0.6)))["b.y"].tolist() == pytest.approx(
        [0.2, 0.2, 0.2, 0.3, 0.4, 0.5, 0.6, 0.6, 0.6, 0.6, 0.6]
    )
    assert run_through(ramp, Hold(0.3))["b.y"].tolist() == pytest.approx(
        [0.0, 0.0, 0.0, 0.3, 0.3, 0.3, 0.6, 0.6, 0.6, 0.9, 0.9]
    )


def test_sum_with_signs() -> None:
    diagram = Diagram("sum", step=0.1)
    for name, value in (("a", 1.0), ("b", 10.0), ("c", 100.0)):
        diagram.add(name, Constant(value))
    diagram.add("sum", Sum("-+-"))
    for i, name in enumerate("abc"):
        diagram.connect(f"{name}.y", f"sum.u{i + 1}")
    assert diagram.run(0.1)["sum.y"].tolist() == [-91.0, -91.0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Constant(math.nan), "value must be a finite number"),
        (lambda: Step(at="soon"), "at must be a finite number"),  # type: ignore[arg-type]  # pyright: ignore
        (lambda: Pulse(width=0.0), "width must be a positive"),
        (lambda: Profile(()), "at least one"),
        (lambda: Profile(((1.0, 0.0), (0.0, 1.0))), "must not decrease"),
        (lambda: Profile(((1.0,),)), "not a pair"),  # pyright: ignore
        (lambda: Noise(seed=-1), "seed must be a whole number"),
        (lambda: Noise(seed=1, deviation=-1.0), "must not be negative"),
        (lambda: Sum("+*"), "signs must be"),
        (lambda: Saturation((2.0, 1.0)), "low < high"),
        (lambda: Hold(0.0), "period must be a positive"),
        (lambda: Delay(-0.1), "from 0"),
        (lambda: Delay(0.1, interpolation="cubic"), "'linear' or 'hold'"),  # pyright: ignore
        (lambda: Gain(math.inf), "k must be a finite"),
    ],
)
def test_wrong_parameters_are_refused(make, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make()


def test_parameters_by_name() -> None:
    gain = Gain(2.0)
    assert gain.with_parameter("k", 3).k == 3
    with pytest.raises(ParameterError, match="no parameter 'kk'; parameters: k,"):
        gain.with_parameter("kk", 1.0)
    with pytest.raises(ParameterError, match="valid number"):
        gain.with_parameter("k", "high")
    with pytest.raises(ParameterError, match="valid number"):
        gain.with_parameter("k", True)
