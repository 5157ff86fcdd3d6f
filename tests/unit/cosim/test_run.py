"""Semantics of a run: rows, rates, order, failures."""

import io
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from railcosim import (
    Block,
    Constant,
    Diagram,
    Fmu,
    Gain,
    Hold,
    Ramp,
    Run,
    SimulationError,
    Step,
    Sum,
)
from railcosim.base.errors import AlgebraicLoopError, DiagramError, FmuError, ParameterError
from railcosim.fmus import build
from tests import plants


@dataclass(frozen=True, slots=True)
class Counter(Block):
    """Counts its own sample hits; no feedthrough."""

    period: float | None = None
    outputs = {"y": "1"}
    feedthrough = False

    def start(self) -> int:
        return 0

    def output(self, x: int) -> int:
        return x

    def update(self, x: int) -> int:
        return x + 1


@dataclass(frozen=True, slots=True)
class Breaks(Block):
    """Passes its input on until it breaks in one way or another."""

    how: str
    inputs = {"u": None}
    outputs = {"y": None}

    def step(self, x: Any, u: float) -> Any:
        if u > 0.45:
            if self.how == "raises":
                raise ValueError("the wire is cut")
            return {"nan": float("nan"), "text": "high", "none": None}[self.how], x
        return u, x


def test_n_steps_give_n_plus_one_rows_with_values_at_their_own_time(train_fmu: Path) -> None:
    """With a train that does not start at rest: at rest two errors could cancel."""
    diagram = Diagram("rows", step=0.1)
    diagram.add("u", Constant(0.0))
    diagram.add("train", Fmu(train_fmu, speed=10.0, acceleration=-1.0))
    diagram.connect("u.y", "train.u")
    run = diagram.run(1.0)
    assert run.time.tolist() == [k / 10 for k in range(11)]
    assert run["train.speed"][0] == 10.0
    assert run["train.acceleration"][0] == -1.0
    assert run["train.speed"][1] == pytest.approx(9.9, abs=0.01)


def test_several_rates() -> None:
    diagram = Diagram("rates", step=0.1)
    diagram.add("fast", Counter())
    diagram.add("slow", Counter(period=0.3))
    diagram.add("hold", Hold(0.2))
    diagram.connect("fast.y", "hold.u")
    run = diagram.run(1.0)
    assert run["fast.y"].tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]
    assert run["slow.y"].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3]
    assert run["hold.y"].tolist() == [0, 0, 2, 2, 4, 4, 6, 6, 8, 8, 10]


def test_an_fmu_with_a_period_of_its_own_shows_its_outputs_at_its_hits() -> None:
    fmu = build(plants.integrator())
    diagram = Diagram("slow fmu", step=0.1)
    diagram.add("one", Constant(1.0, unit="1/s"))
    diagram.add("fast", Fmu(fmu))
    diagram.add("slow", Fmu(fmu, period=0.3))
    diagram.connect("one.y", "fast.u")
    diagram.connect("one.y", "slow.u")
    run = diagram.run(0.9)
    assert run["fast.x"] == pytest.approx(run.time, abs=1e-14)
    expected = [0, 0, 0, 0.3, 0.3, 0.3, 0.6, 0.6, 0.6, 0.9]
    assert run["slow.x"] == pytest.approx(expected, abs=1e-14)


def test_the_controllers_output_acts_on_the_plant_without_a_hidden_step() -> None:
    """x' = −x(t) sampled and held: x(h) = 1 − h after one step, not 1."""
    diagram = Diagram("decay", step=0.1)
    diagram.add("minus", Gain(-1.0, input_unit="1", unit="1/s"))
    diagram.add("plant", Fmu(build(plants.integrator()), x=1.0))
    diagram.connect("plant.x", "minus.u")
    diagram.connect("minus.y", "plant.u")
    run = diagram.run(1.0)
    assert run["plant.x"] == pytest.approx([0.9**k for k in range(11)], abs=1e-14)
    assert run["minus.y"].tolist() == (-run["plant.x"]).tolist()


def test_order_of_adding_does_not_matter() -> None:
    def result(names: list[str]) -> Run:
        blocks = {"r": Ramp(slope=1.0), "g": Gain(2.0), "s": Sum("++"), "h": Gain(0.5)}
        diagram = Diagram("order", step=0.1)
        for name in names:
            diagram.add(name, blocks[name])
        for ends in ("r.y g.u", "g.y s.u1", "h.y s.u2", "s.y out.u", "r.y h.u"):
            source, target = ends.split()
            if not target.startswith("out"):
                diagram.connect(source, target)
        return diagram.run(0.5)

    assert result(list("rgsh"))["s.y"].tolist() == result(list("shgr"))["s.y"].tolist()
    assert result(list("shgr"))["s.y"] == pytest.approx([2.5 * k / 10 for k in range(6)])


def test_two_runs_are_bit_identical_and_the_diagram_unchanged(train_fmu: Path) -> None:
    diagram = Diagram("twice", step=0.05)
    diagram.add("u", Step(at=0.3, to=2.0))
    diagram.add("train", Fmu(train_fmu))
    diagram.connect("u.y", "train.u")
    assert diagram.run(5.0).values.tobytes() == diagram.run(5.0).values.tobytes()


def test_recording_is_chosen(train_fmu: Path) -> None:
    diagram = Diagram("record", step=0.05)
    diagram.add("u", Step())
    diagram.add("train", Fmu(train_fmu))
    diagram.connect("u.y", "train.u")
    run = diagram.run(1.0, record=["train.speed"])
    assert run.columns == ("train.speed",)
    assert run["train.speed"].tolist() == diagram.run(1.0)["train.speed"].tolist()
    assert diagram.run(1.0, record=[]).values.shape == (21, 0)


# Initialization


def test_a_chain_of_fmus_with_feedthrough_settles_at_the_start() -> None:
    """In Initialization Mode outputs follow inputs at once: y = 2u, three times, is 8 at t = 0."""
    diagram = Diagram("chain", step=0.1)
    diagram.add("one", Constant(1.0))
    fmu = build(plants.passing("passing"))
    source = "one.y"
    for name in ("a", "b", "c"):
        diagram.add(name, Fmu(fmu))
    for name in ("a", "b", "c"):
        diagram.connect(source, f"{name}.u")
        source = f"{name}.y"
    assert diagram.run(0.1)["c.y"][0] == 8.0


def test_a_loop_of_fmus_with_feedthrough_is_refused_at_the_start() -> None:
    diagram = Diagram("loop", step=0.1)
    fmu = build(plants.passing("passing"))
    diagram.add("a", Fmu(fmu))
    diagram.add("one", Constant(1.0))
    diagram.add("s", Sum("++"))
    diagram.connect("one.y", "s.u1")
    diagram.connect("a.y", "s.u2")
    diagram.connect("s.y", "a.u")
    with pytest.raises(AlgebraicLoopError, match="do not settle"):
        diagram.run(0.1)


# Failures


def broken(how: str) -> Diagram:
    diagram = Diagram("broken", step=0.1)
    diagram.add("ramp", Ramp(slope=1.0))
    diagram.add("wire", Breaks(how))
    diagram.add("after", Gain(1.0))
    diagram.connect("ramp.y", "wire.u")
    diagram.connect("wire.y", "after.u")
    return diagram


@pytest.mark.parametrize(
    ("how", "message", "rows"),
    [
        ("raises", r"block 'wire' failed at t = 0\.5 s: ValueError: the wire is cut", 5),
        ("nan", r"wire\.y is nan at t = 0\.5 s", 6),
        ("text", r"block 'wire' at t = 0\.5 s: output 'y' is 'high', which is no number", 5),
        ("none", r"block 'wire' at t = 0\.5 s: output 'y' is None, which is no number", 5),
    ],
)
def test_a_failing_block_is_named_and_the_rows_before_are_kept(
    how: str, message: str, rows: int
) -> None:
    with pytest.raises(SimulationError, match=message) as caught:
        broken(how).run(1.0)
    run = caught.value.run
    assert len(run.time) == rows
    assert run["ramp.y"].tolist() == pytest.approx([k / 10 for k in range(rows)])
    assert run.failure == str(caught.value)


@dataclass(frozen=True, slots=True)
class Start(Block):
    """A block whose start() fails."""

    outputs = {"y": "1"}
    feedthrough = False

    def start(self) -> Any:
        raise ZeroDivisionError("no")

    def output(self, x: Any) -> float:
        return 0.0


def test_protocol_mistakes_are_named() -> None:
    diagram = Diagram("wrong", step=0.1)
    diagram.add("a", Start())
    with pytest.raises(DiagramError, match=r"block 'a': start\(\) failed: ZeroDivisionError"):
        diagram.run(1.0)
    for period in (0.0, -0.1, "0.1"):
        with pytest.raises(ParameterError, match="period must be a positive"):
            Diagram("x", step=0.1).add("c", Counter(period=period))  # type: ignore[arg-type]  # pyright: ignore

    class Empty(Block):
        inputs = {"u": "1"}
        outputs = {"y": "1"}

    class Listed(Block):
        inputs = ["u"]  # type: ignore[assignment]  # pyright: ignore

    with pytest.raises(DiagramError, match=r"Empty must define step\(\)"):
        diagram.add("e", Empty())
    with pytest.raises(DiagramError, match="inputs must map port names"):
        diagram.add("l", Listed())
    for stop in ("1.0", None, float("inf")):
        with pytest.raises(DiagramError, match="stop must be a time in s"):
            diagram.run(stop)  # type: ignore[arg-type]  # pyright: ignore


def test_the_wrong_number_of_outputs_is_explained() -> None:
    class Alone(Block):
        inputs = {"u": "1"}
        outputs = {"y": "1"}

        def step(self, x: Any, u: float) -> Any:
            return u

    diagram = Diagram("alone", step=0.1)
    diagram.add("one", Constant(1.0))
    diagram.add("alone", Alone())
    diagram.connect("one.y", "alone.u")
    with pytest.raises(SimulationError, match=r"block 'alone'.*returns \(outputs, next state\)"):
        diagram.run(1.0)


def test_an_output_that_is_not_finite_at_the_start_is_named() -> None:
    diagram = Diagram("nan", step=0.1)
    diagram.add("plant", Fmu(build(plants.undefined())))
    with pytest.raises(FmuError, match=r"block 'plant'.*y is not finite at t = 0"):
        diagram.run(1.0)


@pytest.mark.parametrize("value", [None, "a", (1.0, 2.0), 10**400])
def test_a_bad_value_into_an_fmu_at_the_start_is_named(value: Any) -> None:
    @dataclass(frozen=True)
    class Bad(Block):
        outputs = {"y": "1/s"}
        feedthrough = False

        def output(self, x: Any) -> Any:
            return value

    diagram = Diagram("bad", step=0.1)
    diagram.add("bad", Bad())
    diagram.add("plant", Fmu(build(plants.integrator())))
    diagram.connect("bad.y", "plant.u")
    with pytest.raises(SimulationError, match=r"block 'bad' at t = 0 s: output 'y' is .*no number"):
        diagram.run(1.0)


def test_a_slow_fmu_may_step_past_the_stop_it_was_told() -> None:
    """The stop time given to it is that of its own last hit."""
    diagram = Diagram("slow", step=0.1)
    diagram.add("plant", Fmu(build(plants.integrator()), period=0.5, u=1.0))
    assert diagram.run(1.2)["plant.x"][-1] == pytest.approx(1.0)


def test_threads_run_one_fmu_at_once(tmp_path: Path) -> None:
    path = tmp_path / "fresh.fmu"
    path.write_bytes(build(plants.integrator()).read_bytes())

    def once(number: int) -> bytes:
        diagram = Diagram(f"thread{number}", step=0.1)
        diagram.add("plant", Fmu(path, u=1.0))
        return diagram.run(5.0, progress=False).values.tobytes()

    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(once, range(32)))) == 1


def test_the_blocks_own_traceback_is_below(train_fmu: Path) -> None:
    with pytest.raises(SimulationError) as caught:
        broken("raises").run(1.0)
    assert isinstance(caught.value.__cause__, ValueError)


def test_a_block_that_fails_at_the_last_row() -> None:
    with pytest.raises(SimulationError, match=r"t = 0\.5 s") as caught:
        broken("raises").run(0.5)
    assert len(caught.value.run.time) == 5


def test_a_block_that_fails_at_the_first_row() -> None:
    diagram = Diagram("first", step=0.1)
    diagram.add("one", Constant(1.0))
    diagram.add("wire", Breaks("raises"))
    diagram.connect("one.y", "wire.u")
    with pytest.raises(SimulationError, match=r"block 'wire' failed at t = 0 s") as caught:
        diagram.run(1.0)
    assert len(caught.value.run.time) == 0


def test_an_fmu_that_fails_gives_function_time_status_and_log() -> None:
    diagram = Diagram("blow", step=0.1)
    diagram.add("plant", Fmu(build(plants.blow_up())))
    with pytest.raises(SimulationError) as caught:
        diagram.run(2.0)
    text = str(caught.value)
    assert "block 'plant': fmi2DoStep at t = 1" in text
    assert "returned fmi2Error: [fmi2Error] x is not finite" in text
    run = caught.value.run
    assert 10 <= len(run.time) <= 13
    assert run["plant.x"][:9] == pytest.approx(1.0 / (1.0 - run.time[:9]), rel=1e-6)


# Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class Slow(Block):
    """Takes 5 ms a step."""

    outputs = {"y": "1"}
    feedthrough = False

    def output(self, x: Any) -> float:
        import time

        time.sleep(0.005)
        return 0.0


@pytest.mark.parametrize(
    ("terminal", "steps", "shown"), [(True, 500, True), (True, 20, False), (False, 500, False)]
)
def test_a_bar_on_a_terminal_after_two_seconds(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, steps: int, shown: bool
) -> None:
    stream = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    diagram = Diagram("slow", step=0.1)
    diagram.add("slow", Slow())
    diagram.run(steps / 10)
    assert ("slow" in stream.getvalue()) == shown
