"""Many runs by one Runner: bits and errors of `with_values(…).run(…)`, and nothing left behind."""

import gc
import linecache
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from railcosim import (
    Bias,
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Noise,
    Observer,
    RailcosimError,
    Recording,
    Saturation,
    Scenario,
    SetDelay,
    SetParameter,
    SimulationError,
    Sum,
)
from railcosim.base.errors import DiagramError, ParameterError
from railcosim.controllers import PID
from railcosim.cosim import Runner
from railcosim.cosim.blocks.delay import _steps
from railcosim.cosim.fmu.instance import FmuInstance
from railcosim.cosim.fmu.log import _logs
from railcosim.fmus import build
from railcosim.models import second_order_train
from tests.bare_schedules import assert_same
from tests.foreign import STATE, foreign_fmu

STOP = 3.0
both_engines = pytest.mark.parametrize("engine", ["python", "compiled"])


@dataclass(frozen=True, kw_only=True, slots=True)
class Limit(Block):
    """Passes u on, and fails above a limit; its inputs may be two."""

    limit: float = 1e9
    wide: bool = False
    period: float | None = None
    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def step(self, x: Any, u: float) -> tuple[float, Any]:
        if abs(u) > self.limit:
            raise OverflowError(f"{u} is too much")
        return u, x


def loop() -> Diagram:
    """A train, a PID with two held delays behind it, noise, and a block that may fail."""
    made = Diagram("loop", step=0.01)
    blocks = {
        "goal": Constant(1.0, unit="m/s"),
        "noise": Noise(seed=3, deviation=0.01, unit="m/s", period=0.05),
        "seen": Sum("++"),
        "pid": PID(kp=3.0, ti=2.0, td=0.2, period=0.05, limits=(-10.0, 10.0)),
        "limit": Limit(),
        "link": Delay(0.13, interpolation="hold"),
        "second": Delay(0.1, interpolation="hold"),
        "train": Fmu(build(second_order_train()), gain=1.2),
    }
    for name, block in blocks.items():
        made.add(name, block)
    for wire in (
        "goal.y pid.reference", "train.speed seen.u1", "noise.y seen.u2", "seen.y pid.measurement",
        "pid.u limit.u", "limit.y link.u", "link.y second.u", "second.y train.u",
    ):  # fmt: skip
        made.connect(*wire.split())
    return made


def told(run: Any) -> list[Any]:
    """Return all that a run says but for how long it took."""
    return [run.columns, run.units, run.types, run.failure, run.info, run.time, run.values]


def outcome(run: Any) -> list[Any]:
    """Return what a call gave, or its error."""
    try:
        return told(run())
    except SimulationError as error:
        return [str(error), type(error.__cause__), *told(error.run)]
    except RailcosimError as error:
        return [type(error), str(error)]


def same(runner: Runner, diagram: Diagram, values: Mapping[str, Any], scenario: Any = None) -> Any:
    """Assert that the runner gives what the diagram does, and return that."""
    engine, record = runner._options.engine, runner._options.record
    found = outcome(lambda: runner.run(values, scenario=scenario))
    fresh = outcome(
        lambda: diagram.with_values(values).run(
            STOP, engine=engine, record=record, scenario=scenario
        )
    )
    assert_same(found, fresh)
    return found


def drawn(rng: random.Random) -> dict[str, Any]:
    """Return values of every kind, some of which the run does not survive."""
    choices: dict[str, Any] = {
        "train.gain": lambda: rng.uniform(0.5, 2.0),
        "pid.kp": lambda: rng.uniform(1.0, 5.0),
        "pid.period": lambda: rng.choice([0.05, 0.02]),
        "goal.value": lambda: rng.uniform(-2.0, 2.0),
        "noise.seed": lambda: rng.randrange(1000),
        "limit.limit": lambda: rng.choice([1e9, 4.0]),
    }
    values = {name: draw() for name, draw in choices.items() if rng.random() < 0.4}
    for name in ("link.time", "second.time"):
        values[name] = rng.choice(
            [round(rng.uniform(0.0, 0.5), 2), round(rng.uniform(0.0, 0.5), 6), rng.random(), 0.0]
        )
    return values


def scenarios(rng: random.Random) -> Scenario | None:
    changes = [
        Bias("train.speed", 0.3, at=0.5, until=1.013),
        SetDelay("link", 0.0734, at=0.7),
        SetParameter("pid.kp", 2.5, at=1.2),
        Bias("train.u", 0.1, at=0.4, until=0.8),
    ]
    chosen = rng.sample(changes, rng.choice([0, 0, 1, 3]))
    return Scenario(chosen) if chosen else None


@both_engines
@pytest.mark.parametrize("seed", range(3))
def test_runs_are_those_of_the_diagram(engine: str, seed: int) -> None:
    rng, diagram = random.Random(seed), loop()
    failures = 0
    with diagram.runner(STOP, engine=engine) as runner:
        for _ in range(25):
            found = same(runner, diagram, drawn(rng), scenarios(rng))
            failures += isinstance(found[0], str)
    assert 0 < failures < 15


@both_engines
def test_what_is_not_named_is_the_diagrams(engine: str) -> None:
    diagram = loop()
    with diagram.runner(STOP, engine=engine) as runner:
        first = told(runner.run())
        for values in ({"train.gain": 0.7}, {"link.time": 0.4321}, {"pid.kp": 1.0}):
            assert told(runner.run(values))[-1].tobytes() != first[-1].tobytes()
            assert_same(told(runner.run()), first)


@pytest.mark.parametrize(
    "values",
    [
        {"pid.kpp": 1.0},
        {"pod.kp": 1.0},
        {"pid": 1.0},
        {"pid.kp": "much"},
        {"train.gain": float("nan")},
        {"train.nothing": 1.0},
        {"link.time": -1.0},
        {"pid.period": 0.013},
        {"limit.period": -1.0},
        {"goal.unit": "N"},
        {"link.interpolation": "linear"},
        {"link.time": 0.0, "second.time": 0.0},
    ],
)
def test_mistakes_are_told_as_by_run_and_do_no_harm(values: dict[str, Any]) -> None:
    diagram = loop()
    with diagram.runner(STOP) as runner:
        same(runner, diagram, {})
        same(runner, diagram, values)
        same(runner, diagram, {})
        assert runner._kit.instances.made == 1


def test_a_run_that_fails_frees_its_fmu() -> None:
    diagram, before = loop(), len(_logs)
    with diagram.runner(STOP) as runner:
        found = same(runner, diagram, {"limit.limit": 4.0})
        assert "block 'limit' failed" in found[0] and 0 < len(found[-1]) < 301
        assert len(_logs) == before
        same(runner, diagram, {})
        assert runner._kit.instances.made == 2


def test_observers_see_every_run_and_may_end_it() -> None:
    seen: list[float] = []

    def look(t: float, speed: float) -> bool:
        seen.append(t)
        return speed > 0.0 and t > 1.0

    diagram = loop()
    with diagram.runner(STOP, observers=[Observer(look, ["train.speed"])]) as runner:
        first = runner.run()
        count = len(seen)
        assert count == len(first.time) < 301 and first.time[-1] == 1.01
        runner.run({"link.time": 0.2317})
        assert_same(told(runner.run()), told(first))
        assert len(seen) == 3 * count


def test_recordings_and_a_later_start() -> None:
    diagram, kept = loop(), Recording(["train.speed", "pid.u"], every=7)
    with diagram.runner(4.5, start=1.5, record=kept) as runner:
        for values in ({}, {"link.time": 0.0777}, {"link.time": 0.4}):
            fresh = diagram.with_values(values).run(4.5, start=1.5, record=kept)
            assert_same(told(runner.run(values)), told(fresh))


def test_a_closed_runner_and_one_at_work() -> None:
    diagram = loop()
    refused: list[str] = []

    def look(t: float) -> None:
        if t == 0.0:
            with pytest.raises(DiagramError) as caught:
                runner.run()
            refused.append(str(caught.value))

    runner = diagram.runner(0.1, observers=[Observer(look)])
    runner.run()
    assert refused == ["the runner of 'loop' is at work; each thread needs one of its own"]
    runner.close()
    runner.close()
    with pytest.raises(DiagramError, match="the runner of 'loop' is closed"):
        runner.run()
    with pytest.raises(DiagramError, match="no whole number of steps"):
        diagram.runner(0.123)


@pytest.fixture
def freed(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The names of the instances that were freed."""
    names: list[str] = []
    close = FmuInstance.close

    def closing(self: FmuInstance) -> str | None:
        names.append(self.name)
        return close(self)

    monkeypatch.setattr(FmuInstance, "close", closing)
    yield names


@pytest.mark.parametrize(
    ("engine", "runs"),
    [
        ("python", 150),
        ("compiled", 150),
        pytest.param("python", 800, marks=pytest.mark.slow),
        pytest.param("compiled", 1800, marks=pytest.mark.slow),
    ],
)
def test_many_runs_leave_nothing(engine: str, runs: int, freed: list[str]) -> None:
    """Counted are instances, their logs, programs, kept sources, and all objects of Python."""
    rng, diagram = random.Random(1), loop()
    logs = len(_logs)
    with diagram.runner(0.02, engine=engine, record=[]) as runner:

        def some(count: int) -> list[int]:
            for _ in range(count):
                values = {"link.time": rng.uniform(0.0, 0.5), "train.gain": rng.uniform(0.5, 2.0)}
                runner.run(values | {"second.time": rng.choice([0.1, rng.random()])})
            _steps.cache_clear()  # of a fixed size, and not full yet
            gc.collect()
            return [len(gc.get_objects()), len(linecache.cache)]

        before = some(80)
        after = some(runs)
        assert after[0] <= before[0] + 100
        assert after[1] <= before[1]
        assert runner._kit.instances.made == 1 and len(_logs) == logs + 1
        assert len(runner._kit._programs) <= 32 and not freed
    assert freed == ["train"] and len(_logs) == logs


# FMUs of others


def driven(path: Path, **values: Any) -> Diagram:
    made = Diagram("driven", step=0.05)
    made.add("plant", Fmu(path, **values))
    made.add("source", Noise(seed=1, period=0.1))
    made.add("link", Delay(0.17, interpolation="hold"))
    made.connect("source.y", "link.u")
    made.connect("link.y", "plant.u")
    return made


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("others")
    return {
        "honest": foreign_fmu("filter", folder / "honest"),
        "with state": foreign_fmu("filter", folder / "state", declares=STATE),
        "keeps a state": foreign_fmu("filter", folder / "reset", lie="reset"),
    }


@both_engines
@pytest.mark.parametrize("which", ["honest", "with state", "keeps a state"])
def test_an_fmu_of_others_is_reset_only_if_that_works(
    which: str, engine: str, others: dict[str, Path], freed: list[str]
) -> None:
    diagram = driven(others[which])
    with diagram.runner(STOP, engine=engine) as runner:
        for values in ({}, {"plant.tau": 0.7}, {"plant.tau": 1.1, "link.time": 0.2}, {}, {}):
            same(runner, diagram, values)
        made, trusted = runner._kit.instances.made, runner._kit.instances.trusts_others
    assert trusted == (which != "keeps a state")
    # The trial's, and one where tau is not set again; without trust one more for each run.
    assert made == (2 if trusted else 1 + 5)


def test_an_fmu_that_refuses_a_reset_is_made_anew(
    others: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    diagram = loop()
    with diagram.runner(STOP) as runner:
        runner.run()
        monkeypatch.setattr(FmuInstance, "reset", lambda self: self.fail("fmi2Reset", 3))
        same(runner, diagram, {"train.gain": 1.7})
        assert runner._kit.instances.made == 2


def test_an_isolated_fmu_is_kept(others: dict[str, Path]) -> None:
    diagram = loop()
    path = diagram.block("train").path  # pyright: ignore[reportAttributeAccessIssue]
    apart = Diagram("apart", step=0.05)
    apart.add("train", Fmu(path, isolated=True))
    apart.add("goal", Saturation((-1.0, 0.4)))
    apart.add("source", Constant(1.0))
    apart.connect("source.y", "goal.u")
    apart.connect("goal.y", "train.u")
    with apart.runner(STOP) as runner:
        for values in ({}, {"train.gain": 1.5}, {}):
            same(runner, apart, values)
        assert runner._kit.instances.made == 1


def test_an_fmu_that_is_another_file_by_now(tmp_path: Path, others: dict[str, Path]) -> None:
    path = tmp_path / "filter.fmu"
    path.write_bytes(others["honest"].read_bytes())
    diagram = driven(path)
    with diagram.runner(STOP) as runner:
        same(runner, diagram, {})
        path.write_bytes(others["with state"].read_bytes() + b" ")
        same(runner, diagram, {})


def test_values_must_be_of_the_right_kind() -> None:
    with loop().runner(STOP) as runner, pytest.raises(ParameterError, match=r"PID\.kp"):
        runner.run({"pid.kp": None})
