from pathlib import Path

import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Gain, Step, Sum
from railcosim.base.errors import (
    AlgebraicLoopError,
    DiagramError,
    ParameterError,
    RailcosimError,
    UnitError,
)
from railcosim.controllers import PID


@pytest.fixture
def loop(train_fmu: Path) -> Diagram:
    diagram = Diagram("loop", step=0.05)
    diagram.add("target", Step(unit="m/s"))
    diagram.add("pid", PID(kp=1.0, ti=2.0, td=0.0))
    diagram.add("train", Fmu(train_fmu))
    diagram.connect("target.y", "pid.reference")
    diagram.connect("train.speed", "pid.measurement")
    return diagram


def test_connect_errors_name_both_ends_and_the_remedy(loop: Diagram) -> None:
    for source, target, kind, message in (
        ("train.sped", "train.u", DiagramError, "no output 'sped'.*did you mean 'speed'"),
        ("trian.speed", "train.u", DiagramError, "no block 'trian' in 'loop'.*'train'"),
        ("train.u", "pid.reference", DiagramError, "no output 'u'.*other way round"),
        ("train.speed", "pid.reference", DiagramError, r"train\.speed → pid\.reference.*target\.y"),
        ("train.speed", "train.u", UnitError, r"train\.speed \[m/s\] → train\.u \[1\].*differ"),
        ("train", "train.u", DiagramError, "not spelled block.port"),
    ):
        with pytest.raises(kind, match=message):
            loop.connect(source, target)


def test_a_refused_connection_leaves_no_trace(loop: Diagram) -> None:
    with pytest.raises(UnitError):
        loop.connect("train.speed", "train.u")
    loop.connect("pid.u", "train.u")
    assert len(loop.run(0.1).time) == 3


def test_open_inputs_are_listed(loop: Diagram) -> None:
    with pytest.raises(DiagramError, match=r"open inputs: train\.u"):
        loop.run(1.0)


def test_units_travel_through_blocks_without_one(loop: Diagram) -> None:
    loop.add("link", Delay(0.1))
    loop.add("sum", Sum("++"))
    loop.add("off", Constant(0.0, unit="1"))
    loop.connect("link.y", "sum.u1")
    loop.connect("off.y", "sum.u2")
    assert loop.unit(loop.port("link.y", "output")) == "1"
    with pytest.raises(UnitError, match=r"train\.speed \[m/s\] → link\.u \[1\]"):
        loop.connect("train.speed", "link.u")
    loop.connect("pid.u", "link.u")
    loop.connect("sum.y", "train.u")
    assert loop.run(0.1).units["link.y"] == "1"


def test_a_conflict_far_away_is_found() -> None:
    diagram = Diagram("far", step=0.1)
    diagram.add("a", Constant(1.0, unit="m/s"))
    diagram.add("b", Constant(1.0, unit="N"))
    diagram.add("d1", Delay(0.1))
    diagram.add("sum", Sum("++"))
    diagram.connect("d1.y", "sum.u1")
    diagram.connect("b.y", "sum.u2")
    with pytest.raises(UnitError, match=r"\[m/s\].*\[N\]"):
        diagram.connect("a.y", "d1.u")


def test_the_whole_algebraic_loop_is_named() -> None:
    diagram = Diagram("knot", step=0.1)
    diagram.add("one", Sum("+-"))
    diagram.add("two", Gain(2.0))
    diagram.add("three", Gain(3.0))
    diagram.add("in", Constant(1.0))
    for ends in ("in.y one.u1", "one.y two.u", "two.y three.u", "three.y one.u2"):
        diagram.connect(*ends.split())
    with pytest.raises(AlgebraicLoopError) as caught:
        diagram.run(1.0)
    for part in ("one.y → two.u", "two.y → three.u", "three.y → one.u2"):
        assert part in str(caught.value)


def test_periods_must_be_whole_steps(loop: Diagram) -> None:
    loop.add("slow", PID(kp=1.0, ti=1.0, td=0.0, period=0.07))
    loop.connect("target.y", "slow.reference")
    loop.connect("target.y", "slow.measurement")
    loop.connect("pid.u", "train.u")
    with pytest.raises(DiagramError, match=r"block 'slow': period = 0\.07 s"):
        loop.run(1.0)


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf"), "0.1"])
def test_the_step_must_be_a_positive_time(step: float) -> None:
    with pytest.raises(DiagramError, match="step must be a positive time"):
        Diagram("x", step=step)


def test_add_refuses_what_is_no_block(loop: Diagram) -> None:
    with pytest.raises(DiagramError, match="already has a block 'pid'"):
        loop.add("pid", Gain(1.0))
    with pytest.raises(DiagramError, match="cannot name a block"):
        loop.add("my block", Gain(1.0))
    with pytest.raises(DiagramError, match=r"Fmu\(path\)"):
        loop.add("other", "train.fmu")  # type: ignore[arg-type]  # pyright: ignore
    with pytest.raises(UnitError, match="block 'c', port 'y': unknown unit"):
        loop.add("c", Constant(1.0, unit="knots"))


def test_with_values_changes_a_copy(loop: Diagram) -> None:
    loop.connect("pid.u", "train.u")
    before = loop.run(2.0)
    changed = loop.with_values({"pid.kp": 2.0, "train.gain": 3.0})
    assert changed.run(2.0).values.tolist() != before.values.tolist()
    assert loop.run(2.0).values.tolist() == before.values.tolist()
    for values, kind, message in (
        ({"pdi.kp": 2.0}, DiagramError, "did you mean 'pid'"),
        ({"pid.k": 2.0}, ParameterError, "did you mean 'kp'"),
        ({"pid": 2.0}, DiagramError, "not spelled block.parameter"),
        ({"pid.kp": "big"}, ParameterError, "valid number"),
        ({"pid.kp": -1.0}, ParameterError, "kp must be a positive"),
        ({"train.natural_frequency": -1.0}, ParameterError, r"outside \[0\.001, inf\]"),
        ({"train.u": 1.0}, ParameterError, "input port"),
    ):
        with pytest.raises(kind, match=message):
            loop.with_values(values)


def test_an_empty_diagram_and_a_wrong_stop(loop: Diagram) -> None:
    loop.connect("pid.u", "train.u")
    with pytest.raises(DiagramError, match="no blocks"):
        Diagram("empty", step=0.1).run(1.0)
    with pytest.raises(DiagramError, match="must lie after start"):
        loop.run(0.0)
    with pytest.raises(DiagramError, match="nearest"):
        loop.run(0.07)
    with pytest.raises(DiagramError, match="did you mean 'train.speed'"):
        loop.run(1.0, record=["train.sped"])


def test_all_errors_are_one_kind(loop: Diagram) -> None:
    assert issubclass(DiagramError, RailcosimError)
    with pytest.raises(RailcosimError):
        loop.connect("a.b", "c.d")
