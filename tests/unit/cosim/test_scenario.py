"""Scenarios: which tick a change acts at, what a fault does, and what is refused."""

import math
import re
import tomllib
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from railcosim import Block, Constant, Delay, Diagram, Fmu, Gain, Noise, Ramp, Step, Sum
from railcosim.base.errors import DiagramError, FileError, ParameterError
from railcosim.controllers import PID
from railcosim.cosim import scenario as scenario_package
from railcosim.cosim.clock import Clock, rational
from railcosim.cosim.scenario import (
    Bias,
    DropOut,
    FaultBlock,
    Freeze,
    Override,
    Scenario,
    SetDelay,
    SetParameter,
)
from railcosim.fmus import build
from tests import hybrid_plants, plants

ROOT = Path(__file__).parents[3]
TENTH = Clock(Fraction(1, 10))


def carried(*faults: Any, clock: Clock = TENTH, ticks: int = 10) -> list[float]:
    """Return what a port carries whose signal at tick k is k."""
    (block,) = Scenario(faults).faults(clock).values()
    x, found = block.start(), []
    for k in range(ticks + 1):
        y, x = block.step(x, clock.time(k), float(k))
        found.append(y)
    return found


# What the faults do


def test_override_from_the_first_tick_at_or_after_at_and_before_until() -> None:
    expected = [0, 1, 2, 9, 9, 9, 6, 7, 8, 9, 10]
    assert carried(Override("a.y", 9.0, at=0.3, until=0.6)) == expected
    assert carried(Override("a.y", 9.0, at=0.21, until=0.51)) == expected
    assert carried(Override("a.y", 9.0, at=0.8)) == [*range(8), 9, 9, 9]


def test_times_are_the_decimals_that_were_typed() -> None:
    """0.1 + 0.2 > 0.3 in floats, and 3 · 0.1 too."""
    for k in range(1, 200):
        fault = Override("a.y", -1.0, at=k / 10, until=(k + 1) / 10)
        found = carried(fault, ticks=k + 1)
        assert [i for i, y in enumerate(found) if y == -1.0] == [k]
    third = Clock(Fraction(1, 3))
    assert carried(Bias("a.y", 1.0, at=1 / 3, until=Fraction(2, 3)), clock=third, ticks=3) == [
        0, 2, 2, 3,
    ]  # fmt: skip


def test_times_are_the_runs_not_counted_from_its_start() -> None:
    clock = Clock(Fraction(1, 10), Fraction(5))
    assert carried(Override("a.y", -1.0, at=5.2), clock=clock, ticks=3) == [0, 1, -1, -1]
    assert carried(Override("a.y", -1.0, at=1.0), clock=clock, ticks=2) == [-1, -1, -1]
    over = Override("a.y", -1.0, at=1.0, until=5.0)
    assert Scenario([over]).faults(clock) == {}


def test_a_profile_is_interpolated_in_the_runs_time() -> None:
    profile = [(0.0, 0.0), (0.4, 4.0), (0.4, 10.0), (0.6, 12.0)]
    found = carried(Override("a.y", profile=profile, at=0.2, until=0.9))
    assert found == pytest.approx([0, 1, 2, 3, 10, 11, 12, 12, 12, 9, 10])


def test_bias_adds() -> None:
    assert carried(Bias("a.y", -2.5, at=0.4, until=0.6), ticks=6) == [0, 1, 2, 3, 1.5, 2.5, 6]


def test_freeze_holds_the_value_of_the_first_active_tick() -> None:
    assert carried(Freeze("a.y", at=0.35, until=0.7), ticks=8) == [0, 1, 2, 3, 4, 4, 4, 7, 8]
    assert carried(Freeze("a.y", at=0.0), ticks=3) == [0, 0, 0, 0]


def test_drop_out_shows_a_value_or_what_came_last() -> None:
    assert carried(DropOut("a.y", at=0.3, until=0.5), ticks=6) == [0, 1, 2, 0, 0, 5, 6]
    assert carried(DropOut("a.y", 7.0, at=0.3, until=0.5), ticks=5) == [0, 1, 2, 7, 7, 5]
    assert carried(DropOut("a.y", "last", at=0.3, until=0.5), ticks=6) == [0, 1, 2, 2, 2, 5, 6]


def test_nothing_has_come_before_the_first_tick() -> None:
    scenario = Scenario([DropOut("a.y", "last", at=0.0)])
    with pytest.raises(DiagramError, match=r"change 1 \(drop_out\).*nothing has come in before"):
        scenario.faults(TENTH)


def test_faults_on_one_port_act_in_their_order() -> None:
    override = Override("a.y", 100.0, at=0.2, until=0.5)
    bias = Bias("a.y", 1.0, at=0.3, until=0.6)
    assert carried(override, bias, ticks=6) == [0, 1, 100, 101, 101, 6, 6]
    assert carried(bias, override, ticks=6) == [0, 1, 100, 100, 100, 6, 6]
    frozen = Freeze("a.y", at=0.4)
    assert carried(bias, frozen, ticks=6) == [0, 1, 2, 4, 5, 5, 5]
    first, second = Override("a.y", 1.5, at=0.1, until=0.4), Override("a.y", 2.5, at=0.3)
    assert carried(first, second, ticks=5) == [0, 1.5, 1.5, 2.5, 2.5, 2.5]


def test_the_ticks_at_which_a_fault_matters() -> None:
    clock = Clock(Fraction(1, 3_000_000))  # whose times are no short decimals
    faults = [
        Bias("a.y", 1.0, at=Fraction(7, 3_000_000), until=Fraction(9, 3_000_000)),
        Freeze("a.y", at=0.0),
        DropOut("a.y", "last", at=Fraction(5, 3_000_000)),
    ]
    stages = Scenario(faults).faults(clock)["a.y"].stages
    assert [stage.ticks for stage in stages] == [(7, 9), (0, math.inf), (4, math.inf)]


def test_one_fault_twice_on_a_port() -> None:
    """Each has its own held value."""
    faults = (Freeze("a.y", at=0.1, until=0.3), Freeze("a.y", at=0.6, until=0.8))
    assert carried(*faults, ticks=9) == [0, 1, 1, 3, 4, 5, 6, 6, 8, 9]


def test_the_block_keeps_the_protocol() -> None:
    """In a diagram, between what drives a port and what reads it; twice with the same result."""
    clock = TENTH
    faults = [Freeze("r.y", at=0.3, until=0.6), Bias("r.y", 1.0, at=0.5)]
    diagram = Diagram("faulty", step=0.1)
    diagram.add("r", Ramp(slope=1.0, unit="m/s"))
    diagram.add("fault", Scenario(faults).faults(clock)["r.y"])
    diagram.add("g", Gain(1.0))
    diagram.connect("r.y", "fault.u")
    diagram.connect("fault.y", "g.u")
    run = diagram.run(0.7)
    assert run["g.y"] == pytest.approx([0, 0.1, 0.2, 0.3, 0.3, 1.3, 1.6, 1.7])
    assert run.units["g.y"] == "m/s"
    assert diagram.run(0.7).values.tobytes() == run.values.tobytes()


def test_a_fault_between_two_ticks_is_refused() -> None:
    scenario = Scenario([Bias("a.y", 1.0, at=0.31, until=0.39)])
    with pytest.raises(DiagramError, match=r"no tick lies in 0\.31 s ≤ t < 0\.39 s.*step is 0\.1"):
        scenario.faults(TENTH)


# Parameters and delays


def test_rewrites_are_sorted_by_time() -> None:
    scenario = Scenario(
        [
            SetParameter("pid.kp", 3.0, at=0.52),
            SetDelay("link", 0.4, at=0.55),
            SetParameter("pid.kp", 2.0, at=0.51),
            SetParameter("train.mass.total", 1.0, at=-3.0),
            Bias("pid.u", 1.0, at=0.1),
        ]
    )
    assert scenario.rewrites(TENTH) == [
        (0, "train", "mass.total", 1.0),
        (6, "pid", "kp", 2.0),
        (6, "pid", "kp", 3.0),
        (6, "link", "time", 0.4),
    ]
    assert scenario.delays() == {"link": [0.4]}
    assert list(scenario.faults(TENTH)) == ["pid.u"]
    assert Scenario().rewrites(TENTH) == []


def test_one_parameter_set_twice_at_one_time_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"change 2 .*change 1 sets 'pid\.kp' at 1 s as well"):
        Scenario([SetParameter("pid.kp", 3.0, at=1.0), SetParameter("pid.kp", 2.0, at=1)])
    with pytest.raises(ParameterError, match="change 1 sets 'link' at 1 s as well"):
        Scenario([SetDelay("link", 0.3, at=1.0), SetDelay("link", 0.2, at=1.0)])


# Values


ANY: Any = scenario_package  # whatever is passed


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: ANY.Bias("a.y", math.nan, at=0.0),
            "Bias: offset must be a finite number",
        ),
        (lambda: ANY.Bias("a.y", "x", at=0.0), "Bias: offset must be a finite number, not 'x'"),
        (lambda: ANY.Bias("ay", 1.0, at=0.0), "Bias: port must be spelled block.port, not 'ay'"),
        (lambda: ANY.Bias("a.", 1.0, at=0.0), "port must be spelled block.port"),
        (lambda: ANY.Bias(3, 1.0, at=0.0), "port must be spelled block.port, not 3"),
        (lambda: ANY.Bias("a.y", 1.0, at="0"), "at must be a time in s, not '0'"),
        (lambda: ANY.Bias("a.y", 1.0, at=math.inf), "at must be a time in s, not inf"),
        (lambda: ANY.Bias("a.y", 1.0, at=True), "at must be a time in s, not True"),
        (lambda: ANY.Freeze("a.y", at=2.0, until=2.0), "until = 2 s must lie after at = 2 s"),
        (lambda: ANY.Freeze("a.y", at=2.0, until=math.nan), "until must be a time in s"),
        (
            lambda: ANY.DropOut("a.y", "first", at=0.0),
            "must be a number or 'last', not 'first'",
        ),
        (lambda: ANY.Override("a.y", at=0.0), "needs either a value or a profile"),
        (lambda: ANY.Override("a.y", 1.0, profile=((0, 1),), at=0.0), "needs either a value or a"),
        (lambda: ANY.Override("a.y", math.inf, at=0.0), "value must be a finite number, not inf"),
        (lambda: ANY.Override("a.y", profile=[], at=0.0), "profile: points must hold at least one"),
        (
            lambda: ANY.Override("a.y", profile=[1, 2], at=0.0),
            "profile must be points (time, value), not [1, 2]",
        ),
        (
            lambda: ANY.Override("a.y", profile=[(1, 2), (0, 1)], at=0.0),
            "profile: times must not decrease, but 0 s follows 1 s",
        ),
        (lambda: ANY.SetDelay("a", -0.1, at=0.0), "time must be a number of seconds from 0"),
        (lambda: ANY.SetDelay("a", "0.1", at=0.0), "time must be a time in s"),
        (lambda: ANY.SetParameter("kp", 1.0, at=0.0), "must be spelled block.parameter, not 'kp'"),
        (lambda: ANY.Scenario(["bias"]), "change 1: 'bias' is no change"),
        (lambda: ANY.Scenario(ANY.Freeze("a.y", at=0.0)), "a scenario needs a list of changes"),
    ],
)
def test_wrong_values_are_refused_where_they_are_made(make: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(message)):
        make()


def test_changes_are_values() -> None:
    assert Override("a.y", profile=[(0, 1)], at=1.0) == Override("a.y", profile=((0, 1),), at=1)
    assert hash(SetParameter("a.limits", [-1.0, 1.0], at=1.0))
    assert Scenario([Bias("a.y", 1.0, at=0.0)]) == Scenario((Bias("a.y", 1.0, at=0.0),))


# Against a diagram


@dataclass(frozen=True, slots=True)
class Switch(Block):
    """Gives truth values and whole numbers; the size of its state is a parameter."""

    size: int = 2
    outputs = {"on": "1", "count": "1"}
    types = {"on": "bool", "count": "int64"}
    feedthrough = False

    def start(self) -> tuple[float, ...]:
        return (0.0,) * self.size

    def output(self, x: Any) -> Any:
        return True, 3


@pytest.fixture
def loop(train_fmu: Path) -> Diagram:
    """The README's diagram."""
    loop = Diagram("speed_hold", step=0.05)
    loop.add("target", Step(at=1.0, to=10.0, unit="m/s"))
    loop.add("pid", PID(kp=6.65, ti=2.83, td=0.707, limits=(-10, 10)))
    loop.add("link", Delay(0.4))
    loop.add("train", Fmu(train_fmu, gain=2.2))
    loop.connect("target.y", "pid.reference")
    loop.connect("train.speed", "pid.measurement")
    loop.connect("pid.u", "link.u")
    loop.connect("link.y", "train.u")
    return loop


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (Bias("trian.speed", 1.0, at=0.0), "no block 'trian' in 'speed_hold'.*mean 'train'"),
        (Bias("train.sped", 1.0, at=0.0), "'train' has no port 'sped'.*did you mean 'speed'"),
        (SetParameter("pd.kp", 1.0, at=0.0), "no block 'pd'.*did you mean 'pid'"),
        (SetParameter("pid.kq", 1.0, at=0.0), "no parameter 'kq'.*did you mean 'kp'"),
        (SetParameter("pid.kp", "high", at=0.0), "PID.kp = 'high': input should be a valid number"),
        (SetParameter("pid.limits", [1.0, -1.0], at=0.0), "limits must be a pair"),
        (SetParameter("pid.period", 0.1, at=0.0), "'pid.period' cannot change.*period would"),
        (SetParameter("link.time", 0.1, at=0.0), r"cannot change in a run; use SetDelay\('link'"),
        (SetParameter("link.initial", 0.1, at=0.0), "'link.initial' cannot change in a run"),
        (SetParameter("link.tiem", 0.1, at=0.0), "no parameter 'tiem'"),
        (SetParameter("target.unit", "m", at=0.0), "the block's outputs would change"),
        (
            SetParameter("train.gain", 2.0, at=0.0),
            "'gain' of .*cannot change in a run: its variability is 'fixed'; tunable .*: none",
        ),
        (SetParameter("train.u", 2.0, at=0.0), r"input port, not a parameter; use Override\('tr"),
        (SetParameter("train.speed", 2.0, at=0.0), "is a start value: it acts before a run only"),
        (SetParameter("train.gian", 2.0, at=0.0), "nothing to set named 'gian'.*mean 'gain'"),
        (SetDelay("train", 0.1, at=0.0), "'train' is a Fmu, no Delay; delays: link"),
        (SetDelay("lnk", 0.1, at=0.0), "no block 'lnk'.*did you mean 'link'"),
    ],
)
def test_what_a_diagram_cannot_have(loop: Diagram, change: Any, message: str) -> None:
    scenario = Scenario([Freeze("train.u", at=1.0), change])
    with pytest.raises((DiagramError, ParameterError), match=rf"change 2 \({change.kind}\).*"):
        scenario.check(loop)
    with pytest.raises((DiagramError, ParameterError), match=message):
        scenario.check(loop)


def test_what_can_change_in_a_diagram(loop: Diagram) -> None:
    loop.add("plant", Fmu(build(plants.everything()), u=[1.0, 2.0]))
    loop.add("noise", Noise(seed=1))
    Scenario(
        [
            SetParameter("pid.kp", 5.0, at=1.0),
            SetParameter("pid.limits", [-5.0, 5.0], at=1.0),
            SetParameter("plant.c", 0.7, at=1.0),
            SetParameter("plant.u[1]", 0.7, at=1.0),  # held at a value, and no port
            SetParameter("noise.deviation", 0.0, at=1.0),
            SetDelay("link", 0.05, at=1.0),
            Bias("train.u", 1.0, at=1.0),
            Override("target.y", 1.0, at=1.0),
        ]
    ).check(loop)
    with pytest.raises(ParameterError, match="'u' of .* is a vector; change its elements one by"):
        Scenario([SetParameter("plant.u", [1.0, 2.0], at=1.0)]).check(loop)
    with pytest.raises(ParameterError, match="outside"):
        Scenario([SetParameter("plant.u[1]", 9.0, at=1.0)]).check(loop)


def test_the_state_must_fit() -> None:
    diagram = Diagram("switch", step=0.1)
    diagram.add("s", Switch())
    with pytest.raises(ParameterError, match="'s.size' cannot change in a run: the state would"):
        Scenario([SetParameter("s.size", 3, at=1.0)]).check(diagram)


def whole() -> Diagram:
    diagram = Diagram("whole", step=0.1)
    diagram.add("s", Switch())
    diagram.add("stop", Fmu(build(hybrid_plants.braking())))
    return diagram


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (Override("s.on", 0.5, at=0.0), "s.on is a Boolean, 0.5 is not"),
        (Override("s.on", 2.0, at=0.0), "s.on is a Boolean, 2.0 is not"),
        (Bias("s.on", 1.0, at=0.0), "s.on is a Boolean, to which nothing can be added"),
        (Bias("s.count", 0.5, at=0.0), "s.count is a Integer, 0.5 is not"),
        (DropOut("s.count", 0.5, at=0.0), "s.count is a Integer, 0.5 is not"),
        (Override("s.count", profile=[(0, 0), (1, 2)], at=0.0), "which has no slopes; use jumps"),
        (Override("stop.mode", 0.5, at=0.0), "stop.mode is a Integer, 0.5 is not"),
    ],
)
def test_a_port_of_whole_numbers_stays_one(fault: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Scenario([fault]).check(whole())


def test_what_a_port_of_whole_numbers_takes() -> None:
    Scenario(
        [
            Override("s.on", True, at=0.0),
            Freeze("s.on", at=0.0),
            DropOut("s.on", at=0.0),
            DropOut("s.count", "last", at=0.1),
            Bias("s.count", -2, at=0.0),
            Override("s.count", profile=[(0, 0), (1, 0), (1, 2)], at=0.0),
            Override("stop.mode", 1, at=0.0),
        ]
    ).check(whole())


# Files


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_the_documentations_file(loop: Diagram, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    scenario = Scenario.load(write(tmp_path / "faults.toml", example))
    assert scenario.changes == (
        SetParameter("pid.kp", 5.0, at=20.0),
        Bias("train.speed", 0.5, at=30.0, until=35.0),
        Freeze("train.speed", at=40.0, until=41.5),
        DropOut("link.u", "last", at=45.0, until=46.0),
        Override("target.y", profile=[(50.0, 10.0), (55.0, 5.0)], at=50.0),
        SetDelay("link", 0.6, at=52.0),
    )
    scenario.check(loop)
    assert set(scenario.faults(Clock(rational(0.05)))) == {"train.speed", "link.u", "target.y"}
    assert Scenario.from_dict(tomllib.loads(example)) == scenario
    assert Scenario.from_dict(scenario.to_dict()) == scenario


FREEZE = '[[change]]\nkind = "freeze"\nport = "a.y"\nat = 1.0\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[change]]\nkind = "bias"\nport = "a.y"\nofset = 1.0\nat = 1.0',
         r"change 2 \(bias\): no key 'ofset'; keys: port, offset, at, until; .* 'offset'\?"),
        ('[[change]]\nkind = "bias"\nport = "a.y"\nat = 1.0',
         r"change 2 \(bias\): 'offset' is missing; keys: port, offset, at, until"),
        ('[[change]]\nkind = "bais"\nport = "a.y"\nat = 1.0',
         r"change 2: no kind 'bais'; kinds: set_parameter, .*; did you mean 'bias'\?"),
        ('[[change]]\nport = "a.y"\nat = 1.0', "change 2: 'kind' is missing; kinds: set_parameter"),
        ('[[change]]\nkind = ["bias"]\nat = 1.0', r"change 2: no kind \['bias'\]"),
        ('[[change]]\nkind = "bias"\nport = "a.y"\noffset = "1"\nat = 1.0',
         r"change 2 \(bias\): offset must be a finite number, not '1'"),
        ('[[change]]\nkind = "bias"\nport = "a.y"\noffset = nan\nat = 1.0',
         r"change 2 \(bias\): offset must be a finite number, not nan"),
        ('[[change]]\nkind = "freeze"\nport = "a.y"\nat = 1979-05-27', "at must be a time in s"),
        ('[[change]]\nkind = "freeze"\nport = "a.y"\nat = 2.0\nuntil = 1.0',
         r"change 2 \(freeze\): until = 1 s must lie after at = 2 s"),
        ("[[changes]]\nkind = 1", "no key 'changes'; each change .*; did you mean 'change'"),
        ("[[change]\n", "is not TOML: .*line 5"),
    ],
)  # fmt: skip
def test_a_files_mistakes_are_named(text: str, message: str, tmp_path: Path) -> None:
    path = write(tmp_path / "faults.toml", FREEZE + text)
    with pytest.raises(FileError, match=rf"faults\.toml.*{message}"):
        Scenario.load(path)


def test_other_mistakes_with_files(tmp_path: Path, loop: Diagram) -> None:
    with pytest.raises(FileError, match=r"cannot read .*none\.toml"):
        Scenario.load(tmp_path / "none.toml")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(FileError, match="is not TOML"):
        Scenario.load(tmp_path / "b.toml")
    with pytest.raises(FileError, match="a list of tables"):
        Scenario.load(write(tmp_path / "c.toml", "change = 3"))
    with pytest.raises(FileError, match="change 1: 3 is no table"):
        Scenario.load(write(tmp_path / "c.toml", "change = [3]"))
    twice = '[[change]]\nkind = "set_delay"\nblock = "a"\ntime = 1\nat = 2\n'
    with pytest.raises(FileError, match=r"c\.toml, change 2 \(set_delay\): change 1 sets 'a'"):
        Scenario.load(write(tmp_path / "c.toml", 2 * twice))
    with pytest.raises(ParameterError, match="a table with a list 'change' is needed, not 3"):
        Scenario.from_dict(3)  # type: ignore[arg-type]  # pyright: ignore
    # Against a diagram and in a run, too, the file is named.
    scenario = Scenario.load(write(tmp_path / "d.toml", FREEZE))
    with pytest.raises(DiagramError, match=r"d\.toml, change 1 \(freeze\): no block 'a'"):
        scenario.check(loop)


def test_an_empty_file_changes_nothing(tmp_path: Path) -> None:
    assert Scenario.load(write(tmp_path / "a.toml", "# nothing\n")) == Scenario()


def test_a_fault_costs_little_while_it_is_not_active() -> None:
    """One comparison: the state is handed on as it is."""
    block = Scenario([Freeze("a.y", at=5.0, until=6.0)]).faults(TENTH)["a.y"]
    assert isinstance(block, FaultBlock)
    x = block.start()
    assert block.step(x, 4.9, 1.0)[1] is x
    assert block.step(x, 6.0, 1.0)[1] is x


def test_faults_in_a_diagram_of_several_rates() -> None:
    """The fault has the diagram's step, also behind a slow block, and its times are exact there."""
    diagram = Diagram("rates", step=0.1)
    diagram.add("slow", Noise(seed=1, period=0.5))
    diagram.add(
        "fault", Scenario([Override("slow.y", 9.0, at=0.3, until=0.7)]).faults(TENTH)["slow.y"]
    )
    diagram.add("zero", Constant(0.0))
    diagram.add("sum", Sum("++"))
    for ends in ("slow.y fault.u", "fault.y sum.u1", "zero.y sum.u2"):
        diagram.connect(*ends.split())
    run = diagram.run(1.0)
    faulty = [k for k in range(11) if run["sum.y"][k] == 9.0]
    assert faulty == [3, 4, 5, 6]
    assert run["sum.y"][[0, 1, 2, 7, 8, 9, 10]].tolist() == (
        run["slow.y"][[0, 1, 2, 7, 8, 9, 10]].tolist()
    )
