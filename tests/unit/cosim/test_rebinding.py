"""A schedule with another plan's values in it: the same as one that was made for that plan."""

from typing import Any

import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Gain
from railcosim.controllers import PID
from railcosim.cosim.engine.generate import all_pieces
from railcosim.cosim.plan import make_plan
from railcosim.cosim.schedule.forms import apart
from railcosim.cosim.schedule.operations import Record
from railcosim.cosim.schedule.rebinding import Rebinding
from railcosim.cosim.schedule.schedule import Schedule, make_schedule
from railcosim.fmus import build
from railcosim.models import second_order_train

RECORD = Record(registers=("y0",), every=1)


def loop() -> Diagram:
    made = Diagram("loop", step=0.01)
    made.add("goal", Constant(1.0, unit="m/s"))
    made.add("pid", PID(kp=3.0, ti=2.0, td=0.2, period=0.05))
    made.add("gain", Gain(2.0))
    made.add("link", Delay(0.13, initial=lambda t: 2.0 * t, interpolation="hold"))
    made.add("train", Fmu(build(second_order_train()), gain=1.2))
    wires = (
        ("goal.y", "pid.reference"), ("train.speed", "pid.measurement"), ("pid.u", "gain.u"),
        ("gain.y", "link.u"), ("link.y", "train.u"),
    )  # fmt: skip
    for source, target in wires:
        made.connect(source, target)
    return made


def values_of(schedule: Schedule) -> list[Any]:
    return [apart(piece)[1] for piece in all_pieces(schedule, RECORD, (), ())]


@pytest.fixture(scope="module")
def instances() -> Any:
    block: Any = loop().block("train")
    made = {"train": block.instance("train")}
    yield made
    made["train"].close()


def rebinding(
    instances: Any, values: dict[str, Any], first_values: dict[str, Any] | None = None
) -> tuple[Any, Any]:
    """Return what rebinding makes of the values, and the schedule that is made for them."""
    diagram = loop().with_values(first_values or {})
    first = make_plan(diagram, 0.0)
    schedule = make_schedule(first, instances)
    made = Rebinding.of(schedule, all_pieces(schedule, RECORD, (), ()))
    if made is None:
        return None, None
    plan = make_plan(diagram.with_values(values), 0.0, like=first)
    return made.to(plan), make_schedule(plan, instances)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"pid.kp": 1.0, "goal.value": 2.0, "train.gain": 1.1},
        {"link.time": 0.4, "link.initial": 3.0},
        {"link.time": 0.01, "gain.k": -1.0},
    ],
)
def test_values_are_those_of_a_schedule_made_anew(values: dict[str, Any], instances: Any) -> None:
    found, fresh = rebinding(instances, values)
    if "link.initial" in values:  # a number in place of a function: another form
        assert found is None
        return
    schedule, bound = found
    assert bound == values_of(fresh)
    for what in ("registers", "labels", "start", "plan"):
        assert getattr(schedule, what) == getattr(fresh, what)
    assert schedule.coupling.plan is schedule.plan


@pytest.mark.parametrize("first", [0.125, 0.0123])
@pytest.mark.parametrize("values", [{}, {"link.time": 0.0031}, {"link.time": 0.041, "pid.kp": 2.0}])
def test_divided_ticks_too(first: float, values: dict[str, Any], instances: Any) -> None:
    (schedule, bound), fresh = rebinding(instances, values, {"link.time": first})
    history = [v for v in zip(bound, values_of(fresh), strict=True) if v[0] != v[1]]
    for ours, theirs in history:  # a history inside a tick is a function of its own
        for one, other in zip(ours, theirs, strict=True):
            same = one(3) == other(3) if callable(one) else one == other
            assert same
    for what in ("registers", "labels", "start", "plan"):
        assert getattr(schedule, what) == getattr(fresh, what)


@pytest.mark.parametrize(
    ("first", "time"), [(0.13, 0.0), (0.13, 0.125), (0.125, 0.13), (0.125, 0.0)]
)
def test_another_form_is_told(first: float, time: float, instances: Any) -> None:
    assert rebinding(instances, {"link.time": time}, {"link.time": first})[0] is None
