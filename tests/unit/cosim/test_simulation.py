"""A simulation as an object: its ends, its failures, its observers; and whom failures name."""

import math
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import casadi as ca
import pytest

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Gain,
    GaussSeidel,
    Iterated,
    Jacobi,
    Noise,
    Observer,
    Pace,
    Ramp,
    Recording,
    Run,
    Scenario,
    SetDelay,
    Simulation,
    SimulationError,
    Step,
    StepDoubling,
    TwoPhase,
)
from railcosim.base.errors import DiagramError
from railcosim.fmus import build
from railcosim.models import Plant
from tests import plants

in_both_engines = pytest.mark.parametrize("engine", ["python", "compiled"])
ACROSS = [GaussSeidel(), TwoPhase(extrapolation=1), Iterated(), StepDoubling()]


def named(value: Any) -> str:
    """Return a short name for a test of it."""
    return value if isinstance(value, str) else type(value).__name__


@dataclass(frozen=True)
class Breaks(Block):
    """Half of its input, until it breaks at 0.4 s."""

    value: float
    timed = True
    inputs = {"u": None}
    outputs = {"y": None}

    def step(self, x: Any, t: float, u: float) -> tuple[float, Any]:
        return 0.5 * u if t < 0.35 else self.value, x


def ramps() -> Diagram:
    diagram = Diagram("ramps", step=0.1)
    diagram.add("ramp", Ramp())
    return diagram


def noisy() -> Diagram:
    diagram = Diagram("noisy", step=0.1)
    diagram.add("noise", Noise(seed=1, unit="1/s"))
    diagram.add("link", Delay(0.5))
    diagram.add("i", Fmu(build(plants.integrator())))
    diagram.connect("noise.y", "link.u")
    diagram.connect("link.y", "i.u")
    return diagram


def refused(simulation: Simulation, message: str) -> None:
    """Nothing can be had of it but a DiagramError."""
    with pytest.raises(DiagramError, match=message):
        simulation.advance(20.0)
    with pytest.raises(DiagramError, match=message):
        simulation.checkpoint()
    with pytest.raises(DiagramError, match=message):
        simulation["noise.y"]


@in_both_engines
def test_after_an_observers_end(engine: str) -> None:
    """It stands at the observer's tick and shows its signals, but goes no further."""
    whole = noisy().run(20.0, engine=engine)
    observers = [Observer(lambda t, x: t >= 10.0, ["i.x"])]
    with noisy().simulation(engine=engine, observers=observers) as simulation:
        simulation.advance(20.0)
        assert (simulation.tick, simulation.time, simulation.ended) == (100, 10.0, True)
        for port in ("noise.y", "link.y", "i.x"):
            assert simulation[port] == whole[port][100]
        with pytest.raises(DiagramError, match=r"observer has ended .* 10 s"):
            simulation.checkpoint()
        with pytest.raises(DiagramError, match=r"observer has ended .* 10 s"):
            simulation.advance(20.0)
        run = simulation.result()
    assert run.failure is None
    assert run.values.tobytes() == whole.values[:101].tobytes()


@in_both_engines
@pytest.mark.parametrize("error", [RuntimeError("x"), KeyboardInterrupt()], ids=named)
def test_after_a_failure_or_an_interruption(error: BaseException, engine: str) -> None:
    """Also if the cause is gone: the FMUs stand somewhere else than the blocks."""
    reasons = [error]

    def watch(t: float, x: float) -> None:
        if t >= 10.0 and reasons:
            raise reasons.pop()

    is_failure = isinstance(error, Exception)
    with noisy().simulation(engine=engine, observers=[Observer(watch, ["i.x"])]) as simulation:
        with pytest.raises(SimulationError if is_failure else KeyboardInterrupt) as caught:
            simulation.advance(20.0)
        refused(simulation, "failed" if is_failure else "interrupted")
    if isinstance(caught.value, SimulationError):
        assert caught.value.run.time.tolist() == [k / 10 for k in range(101)]


@in_both_engines
def test_after_close(engine: str) -> None:
    with noisy().simulation(engine=engine) as simulation:
        simulation.advance(1.0)
    refused(simulation, "closed")
    run = simulation.result()  # the rows, the last one too, are still there
    assert run.values.tobytes() == noisy().run(1.0, engine=engine).values.tobytes()


def test_a_file_is_complete_after_the_with(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    with ramps().simulation(record=Recording(to=path)) as simulation:
        simulation.advance(1.0)
    assert [file.name for file in tmp_path.iterdir()] == ["run.parquet"]
    for run in (simulation.result(), Run.load(path)):
        assert run["ramp.y"].tolist() == [k / 10 for k in range(11)]
        assert run.failure is None


def test_a_file_is_completed_when_the_with_ends_by_an_exception(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    with (
        pytest.raises(LookupError, match="mine"),
        ramps().simulation(record=Recording(to=path)) as simulation,
    ):
        simulation.advance(1.0)
        raise LookupError("mine")
    assert [file.name for file in tmp_path.iterdir()] == ["run.parquet"]
    run = Run.load(path)
    assert run.time[:10].tolist() == [k / 10 for k in range(10)]
    assert "LookupError" in (run.failure or "")


@pytest.mark.parametrize("every", [1, 7, 10, 100])
def test_observers_see_each_tick_once_whatever_is_recorded(every: int) -> None:
    seen: list[float] = []
    run = ramps().run(
        1.0,
        record=Recording(every=every),
        observers=[Observer(lambda t, y: seen.append(t), ["ramp.y"])],
        pace=Pace(factor=1000.0),
    )
    assert seen == [k / 10 for k in range(11)]
    assert run.time.tolist() == [k / 10 for k in range(0, 11, every)]
    assert run.pacing is not None
    assert run.pacing.ticks == 11


def test_a_pause_between_two_calls_is_no_lateness() -> None:
    with ramps().simulation(pace=Pace(factor=10.0, tolerance=0.3)) as simulation:
        simulation.advance(1.0)
        sleep(0.5)
        before = perf_counter()
        simulation.advance(2.0)
        assert perf_counter() - before >= 0.085  # nor is it made up for: ticks 10 … 19 of 0.01 s
        pacing = simulation.result().pacing
    assert pacing is not None
    assert (pacing.ticks, pacing.missed) == (21, 0)
    assert pacing.worst < 0.3


def test_a_paced_run_lasts_as_long_as_it_should(tmp_path: Path) -> None:
    before = perf_counter()
    run = ramps().run(15.0, pace=Pace(factor=50.0, tolerance=1.0))
    assert 0.3 <= perf_counter() - before < 1.3
    run.save(tmp_path / "run.parquet")
    for pacing in (run.pacing, Run.load(tmp_path / "run.parquet").pacing):
        assert pacing is not None
        assert (pacing.factor, pacing.ticks, pacing.missed) == (50.0, 151, 0)
        assert str(pacing).startswith("50 × real time: no deadline of 151 missed")


def broken(value: float) -> Diagram:
    """`after` reads what `bad` gives, and comes before it."""
    diagram = Diagram("broken", step=0.1)
    diagram.add("after", Gain(2.0))
    diagram.add("one", Constant(1.0))
    diagram.add("bad", Breaks(value))
    diagram.connect("one.y", "bad.u")
    diagram.connect("bad.y", "after.u")
    return diagram


@in_both_engines
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_the_block_that_made_it_is_named(value: float, engine: str) -> None:
    for record, message in (
        (None, rf"^bad\.y is {value} at t = 0\.4 s"),
        (Recording(every=10), rf"^bad\.y is {value} at the latest at t = 1 s"),
        (["after.y"], rf"{value} at t = 0\.4 s"),
        (["one.y"], rf"^bad\.y is {value} at the latest at t = "),
        ([], rf"^bad\.y is {value} at the latest at t = "),
    ):
        with pytest.raises(SimulationError, match=message):
            broken(value).run(2.0, record=record, engine=engine)


@in_both_engines
def test_the_block_that_made_it_is_named_when_an_fmu_refuses_it(engine: str) -> None:
    diagram = broken(math.nan)
    diagram.add("unit", Gain(1.0, input_unit="1", unit="1/s"))
    diagram.add("i", Fmu(build(plants.integrator())))
    diagram.connect("after.y", "unit.u")
    diagram.connect("unit.y", "i.u")
    with pytest.raises(SimulationError, match=r"bad\.y is nan"):
        diagram.run(2.0, engine=engine)


@in_both_engines
def test_an_fmu_that_gives_nan_is_named(engine: str) -> None:
    with Plant("root") as plant:
        x = plant.state("x", unit="1", output=True)
        plant.der(x, 1.0)
        plant.output("y", ca.sqrt(0.45 - x), unit="1")
    diagram = Diagram("root", step=0.1)
    diagram.add("f", Fmu(build(plant)))
    for record in (None, ["f.x"], []):
        with pytest.raises(SimulationError, match=r"block 'f': .*y is not finite at t = 0\.5"):
            diagram.run(2.0, record=record, engine=engine)


@dataclass(frozen=True)
class Announces(Block):
    """A source whose next event comes too soon."""

    after: float
    timed = True
    feedthrough = False
    outputs = {"y": "1/s"}

    def output(self, x: Any, t: float) -> float:
        return 1.0

    def next_event(self, x: Any, t: float) -> float:
        return t + self.after


@in_both_engines
@pytest.mark.parametrize("after", [1e-7, 0.0, -1.0, math.nan])
@pytest.mark.parametrize("algorithm", [TwoPhase(), Jacobi(), *ACROSS], ids=named)
def test_events_without_end_are_refused(after: float, algorithm: Any, engine: str) -> None:
    diagram = Diagram("events", step=0.1)
    diagram.add("source", Announces(after))
    diagram.add("i", Fmu(build(plants.integrator())))
    diagram.connect("source.y", "i.u")
    with pytest.raises(SimulationError, match="block 'source' .*next_event"):
        diagram.run(0.2, algorithm=algorithm, engine=engine)


@pytest.mark.parametrize("algorithm", [TwoPhase(), Jacobi(), *ACROSS], ids=named)
def test_a_jump_a_rounding_after_a_tick(algorithm: Any) -> None:
    """0.1 + 0.2 lies 4e-17 after the tick at 0.3: no FMU can make such a step, or half of it."""
    diagram = Diagram("rounding", step=0.1)
    diagram.add("source", Step(at=0.1 + 0.2, unit="1/s"))
    diagram.add("i", Fmu(build(plants.integrator())))
    diagram.connect("source.y", "i.u")
    run = diagram.run(1.0, algorithm=algorithm)
    assert run["i.x"] == pytest.approx([max(0.0, k / 10 - 0.3) for k in range(11)], abs=1e-12)


def test_steps_are_counted_over_all_changes_of_a_scenario() -> None:
    """Step doubling makes three steps of a tick at least."""
    scenario = Scenario([SetDelay("link", 0.7, at=10.0)])
    run = noisy().run(20.0, algorithm=StepDoubling(), scenario=scenario)
    assert run.info["steps"] >= 3 * 200
