"""The two engines over whole diagrams: same bits, same types, same errors, and what a run says."""

import gc
import os
import random
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import (
    Bias,
    Block,
    Constant,
    Delay,
    Diagram,
    DropOut,
    Fmu,
    Freeze,
    Gain,
    Hold,
    Noise,
    Observer,
    Override,
    Profile,
    Pulse,
    RailcosimError,
    Ramp,
    Recording,
    Run,
    Saturation,
    Scenario,
    SetDelay,
    SetParameter,
    SimulationError,
    Step,
    Sum,
    VariableDelay,
)
from railcosim.base.errors import ParameterError, UnitError
from railcosim.controllers import PID
from railcosim.cosim.algorithms import (
    FixedPoint,
    GaussSeidel,
    Iterated,
    Jacobi,
    Newton,
    StepDoubling,
    TwoPhase,
)
from railcosim.fmus import build
from tests import coupled_plants
from tests.bare_schedules import assert_same
from tests.foreign import ALL, STATE, foreign_fmu
from tests.foreign.faults import Fault, Phase, faulty_fmu

ENGINES = ("python", "compiled")
U, Y = {"u": None}, {"y": None}


# Blocks that hand out all kinds of things


@dataclass(frozen=True, kw_only=True, slots=True)
class Listing(Block):
    """Two outputs and the state as lists."""

    inputs = {"a": None, "b": None}
    outputs = {"low": None, "high": None}

    def start(self) -> Any:
        return [0.0, 0]

    def step(self, x: Any, a: Any, b: Any) -> Any:
        total, count = x
        return [[min(a, b) + 0.25 * total, max(a, b)], [0.5 * total + 0.1 * a, count + 1]]


@dataclass(frozen=True, kw_only=True, slots=True)
class Count(Block):
    """An int: how often u was above its mean; no feedthrough."""

    period: float | None = None
    inputs, outputs, types = U, {"y": None, "more": None}, {"y": "int64", "more": "bool"}
    feedthrough = False

    def start(self) -> Any:
        return 0, 0.0

    def output(self, x: Any) -> Any:
        return x[0], x[1] > 0.1

    def update(self, x: Any, u: Any) -> Any:
        count, mean = x
        return (count + 1 if u > mean else count - 1), 0.9 * mean + 0.1 * u


@dataclass(frozen=True, kw_only=True, slots=True)
class Partly(Block):
    """Timed, with one input that feeds through and one that does not."""

    inputs, outputs = {"now": None, "later": None}, Y
    feedthrough, timed, direct = False, True, ("now",)

    def start(self) -> Any:
        return 0.3

    def output(self, x: Any, t: float, now: Any) -> Any:
        return x + 0.5 * now - 0.01 * t

    def update(self, x: Any, t: float, now: Any, later: Any) -> Any:
        return 0.5 * x + 0.2 * later - 0.1 * now


@dataclass(frozen=True, kw_only=True, slots=True)
class Numpy(Block):
    """numpy's numbers, and an array for the state."""

    inputs, outputs = U, Y

    def start(self) -> Any:
        return np.zeros(2)

    def step(self, x: Any, u: Any) -> Any:
        x = 0.5 * x + np.array([u, -u])
        return x[0] - 0.3 * x[1], x


@dataclass(frozen=True, kw_only=True, slots=True)
class Sink(Block):
    """No outputs."""

    inputs, outputs = U, {}

    def start(self) -> Any:
        return 0

    def step(self, x: Any, u: Any) -> Any:
        return None, x + 1


@dataclass(frozen=True, kw_only=True, slots=True)
class Fitting(Block):
    """y = u, whatever the units."""

    inputs, outputs = U, Y
    shares_unit = False

    def step(self, x: Any, u: Any) -> Any:
        return u, x


@dataclass(frozen=True, kw_only=True, slots=True)
class Lead(Block):
    """A delay (s) of one to five steps that follows u."""

    step_size: float
    inputs, outputs = U, {"y": "s"}
    shares_unit = False

    def step(self, x: Any, u: Any) -> Any:
        return self.step_size * (1.0 + min(4.0, abs(float(u)))), x


@dataclass(frozen=True, kw_only=True, slots=True)
class Faulty(Block):
    """y = u / 2, but what it is told at a tick, which it counts itself."""

    tick: int
    fault: str
    inputs, outputs = U, Y

    def start(self) -> int:
        return 0

    def step(self, x: int, u: Any) -> Any:
        return self.broken(u, x) if x == self.tick else (0.5 * u, x + 1)

    def broken(self, u: Any, x: int) -> Any:
        return FAULTS[self.fault](u, x)


def _raise(error: BaseException) -> Any:
    raise error


FAULTS: dict[str, Callable[[Any, int], Any]] = {
    "division": lambda u, x: (u / (x - x), x),
    "lookup": lambda u, x: _raise(LookupError(x)),
    "ours": lambda u, x: _raise(RailcosimError("in our words")),
    "text": lambda u, x: ("text", x + 1),
    "none": lambda u, x: (None, x + 1),
    "huge": lambda u, x: (10**400, x + 1),
    "complex": lambda u, x: (1j, x + 1),
    "nan": lambda u, x: (float("nan"), x + 1),
    "infinite": lambda u, x: (float("inf"), x + 1),
    "bare": lambda u, x: 0.5 * u,
    "nothing": lambda u, x: None,
    "three": lambda u, x: (u, x, x),
    "one": lambda u, x: (u,),
    "pair": lambda u, x: ((u, u), x + 1),
    "list": lambda u, x: [0.5 * u, x + 1],
    "generator": lambda u, x: (value for value in (0.5 * u, x + 1)),
    "bool": lambda u, x: (True, x + 1),
    "array": lambda u, x: (np.array([1.0, 2.0]), x + 1),
}


# FMUs: ours and foreign ones, with all types of variables


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("engines")
    return {
        "linear": build(coupled_plants.linear()),
        "direct": build(coupled_plants.linear_direct()),
        "filter": foreign_fmu("filter", folder / "filter", declares=ALL, order=1),
        "plain": foreign_fmu("filter", folder / "plain"),
        "kinds": foreign_fmu("kinds", folder / "kinds", declares=STATE),
        "kinds_plain": foreign_fmu("kinds", folder / "kinds_plain"),
        "faulty": faulty_fmu(folder / "faulty", declares=STATE),
        "faulty_plain": faulty_fmu(folder / "faulty_plain"),
    }


# Random diagrams


@dataclass
class Maker:
    """Random diagrams and ways to run them; the same seed gives the same."""

    seed: int
    fmus: dict[str, Path]
    rng: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)
        self.step = self.rng.choice([Fraction(1, 10), Fraction(1, 30), Fraction(1, 128)])

    def number(self) -> float:
        return round(self.rng.uniform(-1.0, 1.0), 6)

    def time(self, ticks: float = 40.0) -> float:
        """Return a time (s), on a tick or between two."""
        if self.rng.random() < 0.5:
            return float(self.step * self.rng.randrange(int(ticks)))
        return round(self.rng.uniform(0.0, ticks) * float(self.step), 6)

    def period(self) -> float | None:
        ticks = self.rng.choice([1, 1, 2, 3, 7])
        return None if ticks == 1 else float(self.step * ticks)

    def delay(self) -> Delay:
        time = self.rng.choice([0.0, 0.4, 1.0, 1.0, 3.0, 2.7, 16.0]) * float(self.step)
        initial = self.rng.choice([0.0, 1, self.number(), lambda t: 0.5 * t, lambda t: 2])
        return Delay(time, initial=initial, interpolation=self.rng.choice(["linear", "hold"]))

    def fmu(self) -> Fmu:
        kind = self.rng.choice(["linear", "direct", "filter", "plain", "kinds", "kinds_plain"])
        values: dict[str, Any] = {}
        if kind in ("linear", "direct"):
            a = [-1.0, self.number(), self.number(), -1.5]
            values = {"a": a, "b": [self.number() for _ in range(4)], "x1": self.number()}
            values["c"] = [self.number() for _ in range(4)]
        if self.rng.random() < 0.3:
            values["period"] = self.period()
        return Fmu(self.fmus[kind], **values)

    def block(self) -> Block:
        rng = self.rng
        low = rng.uniform(-0.5, 0.0)
        makers: list[Callable[[], Block]] = [
            lambda: Constant(rng.choice([self.number(), 1])),
            lambda: Step(at=self.time(), to=self.number()),
            lambda: Pulse(at=self.time(), width=0.01 + self.time(10), height=self.number()),
            lambda: Ramp(slope=self.number(), at=self.time()),
            lambda: Noise(seed=self.seed, period=self.period()),
            lambda: Profile(((0.0, self.number()), (self.time(), 1), (9.0, 0.0))),
            lambda: Gain(self.number()),
            lambda: Gain(rng.choice([-1, 2])),
            lambda: Sum(rng.choice(["+-", "++-", "-"])),
            lambda: Saturation((low, low + 0.9)),
            lambda: Hold(self.period() or float(self.step)),
            lambda: PID(kp=0.8, ti=2.0, td=0.1, period=self.period() or float(self.step)),
            lambda: VariableDelay(maximum=float(6 * self.step)),
            lambda: VariableDelay(maximum=float(9 * self.step), kind="transport"),
            Listing,
            lambda: Count(period=self.period()),
            Partly,
            Numpy,
            Sink,
        ]  # fmt: skip
        chance = rng.random()
        return (
            self.fmu() if chance < 0.2 else self.delay() if chance < 0.4 else rng.choice(makers)()
        )

    def diagram(self) -> Diagram:
        made = Diagram("random", step=self.step)
        made.add("start", Constant(self.number()))
        made.add("ramp", Ramp(slope=0.3))
        for i in range(self.rng.randrange(3, 14)):
            made.add(f"b{i}", self.block())
        if self.rng.random() < 0.3:
            fault = self.rng.choice(list(FAULTS))
            made.add("faulty", Faulty(tick=self.rng.randrange(1, 30), fault=fault))
        names = list(made.blocks)
        for place, (name, block) in enumerate(list(made.blocks.items())):
            for port in block.inputs:
                self.connect(made, names, place, f"{name}.{port}")
        return made

    def connect(self, made: Diagram, names: list[str], place: int, target: str) -> None:
        """Connect an input, most often so that no algebraic loop closes."""
        blocks = made.blocks
        block = blocks[names[place]]
        through = block.feedthrough or bool(block.direct) or isinstance(block, Delay)
        loose = self.rng.random() < 0.03
        sources = [
            f"{name}.{port}"
            for i, name in enumerate(names)
            for port in blocks[name].outputs
            if i < place or isinstance(blocks[name], Fmu) or not through or loose
        ]
        source = self.rng.choice(sources)
        try:
            if not target.endswith(".delay"):
                made.connect(source, target)
                return
            between: Block = Lead(step_size=float(self.step))
        except UnitError:
            between = Fitting()
        name = target.replace(".", "_")
        made.add(name, between)
        made.connect(source, f"{name}.u")
        made.connect(f"{name}.y", target)

    def algorithm(self, made: Diagram) -> Any:
        rng = self.rng
        plain = any(isinstance(b, Fmu) and "plain" in str(b.path) for b in made.blocks.values())
        order: Any = {"extrapolation": rng.choice([0, 1])}
        solver = rng.choice([Newton(), FixedPoint(relaxation=0.5)])
        kinds = [
            TwoPhase(),
            TwoPhase(**order, loops=solver),
            Jacobi(**order),
            GaussSeidel(**order, loops=solver),
            Iterated(solver=solver, **order),
            StepDoubling(inner=GaussSeidel(**order, loops=solver), tolerance=0.05),
        ]
        return rng.choice(kinds[: 4 if plain else None])

    def ports(self, made: Diagram, kind: str = "outputs") -> list[str]:
        return [f"{n}.{p}" for n, b in made.blocks.items() for p in getattr(b, kind)]

    def change(self, made: Diagram) -> Any:
        rng = self.rng
        port = rng.choice(self.ports(made) + self.ports(made, "inputs"))
        at = self.time()
        until = rng.choice([None, at + 5 * float(self.step)])
        time = rng.choice([0.0, 2.3]) * float(self.step)
        delays = [name for name, block in made.blocks.items() if isinstance(block, Delay)]
        gains = [name for name, block in made.blocks.items() if isinstance(block, Gain)]
        kinds: list[Callable[[], Any]] = [
            lambda: Override(port, self.number(), at=at, until=until),
            lambda: Freeze(port, at=at, until=until),
            lambda: DropOut(port, "last", at=at, until=until),
            lambda: Bias(port, self.number(), at=at, until=until),
        ]
        if delays:
            kinds += [lambda: SetDelay(rng.choice(delays), time, at=at)] * 2
        if gains:
            kinds += [lambda: SetParameter(f"{rng.choice(gains)}.k", self.number(), at=at)] * 2
        return rng.choice(kinds)()

    def scenario(self, made: Diagram) -> Scenario | None:
        changes = [self.change(made) for _ in range(self.rng.choice([0, 0, 1, 3]))]
        try:
            return Scenario(tuple(changes)) if changes else None
        except ParameterError:  # two set one parameter at one time
            return None

    def options(self, made: Diagram) -> dict[str, Any]:
        rng, ports = self.rng, self.ports(made)
        every = rng.choice([1, 1, 1, 3])
        kept = None if rng.random() < 0.6 else rng.sample(ports, rng.randrange(len(ports)))
        return {
            "algorithm": self.algorithm(made),
            "start": rng.choice([Fraction(0), Fraction(0), Fraction(3, 2), Fraction(-3, 10)]),
            "record": Recording(kept, every=every),
            "scenario": self.scenario(made),
        }

    def observers(self, made: Diagram) -> Callable[[list[Any]], Sequence[Observer]]:
        rng = self.rng
        ports = rng.sample(self.ports(made), min(2, len(self.ports(made))))
        number, every = rng.choice([0, 0, 1, 2]), rng.choice([1, 3])
        what, limit = rng.choice(["look", "look", "stop", "fail"]), rng.randrange(1, 15)

        def make(seen: list[Any]) -> Sequence[Observer]:
            def observe(t: float, *values: Any) -> bool | None:
                seen.append((t, *values))
                if what == "fail" and len(seen) > limit:
                    raise KeyError("observer")
                return True if what == "stop" and len(seen) > limit else None

            return tuple(Observer(observe, ports, every=every) for _ in range(number))

        return make


def run_of(maker: Maker, engine: str, ticks: int) -> list[Any]:
    """Return all that can be told of a run: rows, values at the end, failure, what was observed."""
    made = maker.diagram()
    options, observers = maker.options(made), maker.observers(made)
    pieces = sorted(maker.rng.sample(range(1, ticks), 2))
    seen: list[Any] = []
    found: list[Any] = []
    try:
        with made.simulation(engine=engine, observers=observers(seen), **options) as simulation:
            try:
                for piece in (*pieces, ticks):
                    simulation.advance(options["start"] + piece * maker.step)
                run = simulation.result()
            except SimulationError as error:
                run = error.run
                found += [str(error), *_chain(error)]
            info = dict(run.info)
            ran = info.pop("engine"), info.pop("engine_reason")
            assert ran == (engine, "")
            found += [simulation.tick, simulation.ended, simulation._values, info]
        columns = list(run.frame.columns)
        found += [run.time, columns, [run[name] for name in columns], run.failure]
    except RailcosimError as error:
        found += [str(error), *_chain(error)]
    return [*found, seen]


def _chain(error: BaseException) -> list[Any]:
    """Return the causes of an error, each with the line that raised it."""
    found: list[Any] = []
    cause = error.__cause__
    while cause is not None:
        frames = traceback.extract_tb(cause.__traceback__)
        lines = [(f.name, f.line) for f in frames if Path(f.filename) == Path(__file__)]
        found.append((type(cause), str(cause), lines[1:] if lines[:1] == ["run_of"] else lines))
        cause = cause.__cause__
    return found


def compare(seed: int, fmus: dict[str, Path], ticks: int = 45) -> list[Any]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # numpy's, of numbers that overflow
        python, compiled = (run_of(Maker(seed, fmus), engine, ticks) for engine in ENGINES)
    assert_same(python, compiled)
    return compiled


@pytest.mark.parametrize("seed", range(120))
def test_random_diagrams(seed: int, fmus: dict[str, Path]) -> None:
    compare(seed, fmus)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(100, 130))
def test_many_random_diagrams(block: int, fmus: dict[str, Path]) -> None:
    for seed in range(100 * block, 100 * (block + 1)):
        try:
            compare(seed, fmus)
        except AssertionError as error:
            raise AssertionError(f"seed {seed}") from error


# FMUs that fail


def failing(path: Path, **values: Any) -> Diagram:
    """An FMU beside a PID, a delay and another FMU, which fails at 0.5 s."""
    made = Diagram("failing", step=0.01)
    blocks: dict[str, Block] = {
        "goal": Constant(1.5),
        "half": Gain(0.5),
        "link": Delay(0.034),
        "plant": Fmu(path, **values),
        "other": Fmu(path),
    }
    for name, block in blocks.items():
        made.add(name, block)
    for wire in ("goal.y half.u", "half.y link.u", "link.y plant.u", "plant.y other.u"):
        made.connect(*wire.split())
    return made


@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("which", ["faulty", "faulty_plain"])
@pytest.mark.parametrize("phase", [Phase.STEP, Phase.GET])
@pytest.mark.parametrize(
    "fault",
    [Fault.HONEST, Fault.ERROR, Fault.FATAL, Fault.DISCARD_LONG, Fault.DISCARD_ALL,
     Fault.NO_NUMBER, Fault.WARN],
)  # fmt: skip
def test_an_fmu_fails(
    fmus: dict[str, Path], which: str, fault: Fault, phase: Phase, every: int
) -> None:
    made = failing(fmus[which], fault=int(fault), phase=int(phase))
    found = []
    for engine in ENGINES:
        try:
            run, words = made.run(1.0, engine=engine, record=Recording(every=every)), ""
        except SimulationError as error:
            run, words = error.run, str(error)
        assert run.engine == engine
        found.append([words, run.time, *(run[name] for name in run.frame.columns)])
    assert_same(*found)
    words, times, *_ = found[1]
    if (fault, phase) == (Fault.ERROR, Phase.STEP):
        assert "block 'plant': fmi2DoStep at t = 0.5 s returned fmi2Error" in words
        assert len(times) == (51 if every == 1 else 8)
    if fault in (Fault.HONEST, Fault.WARN):
        assert (words, len(times)) == ("", 101 if every == 1 else 15)


@pytest.mark.parametrize("fault", [Fault.HONEST, Fault.ERROR, Fault.DISCARD_LONG, Fault.EXIT])
def test_an_isolated_fmu(fmus: dict[str, Path], fault: Fault) -> None:
    made = failing(fmus["faulty"], fault=int(fault), phase=0, isolated=True)
    found = []
    for engine in ENGINES:
        try:
            run, words = made.run(1.0, engine=engine), ""
        except SimulationError as error:
            run, words = error.run, str(error)
        found.append([words, run.time, *(run[name] for name in run.frame.columns)])
    assert_same(*found)


# What a user sees


def test_a_block_fails_and_its_line_is_shown() -> None:
    made = Diagram("guilty", step=0.1)
    made.add("ramp", Ramp(slope=1.0))
    made.add("faulty", Faulty(tick=7, fault="lookup"))
    made.connect("ramp.y", "faulty.u")
    with pytest.raises(SimulationError, match="block 'faulty' failed at t = 0.7 s") as caught:
        made.run(2.0, engine="compiled")
    assert str(caught.value) == "block 'faulty' failed at t = 0.7 s: LookupError: 7"
    assert len(caught.value.run.time) == 7
    cause = caught.value.__cause__
    assert isinstance(cause, LookupError)
    frames = traceback.extract_tb(cause.__traceback__)
    assert [f.name for f in frames if f.filename == __file__] == [
        "step", "broken", "<lambda>", "_raise",
    ]  # fmt: skip
    assert frames[-1].line == "raise error"


def test_an_observer_ends_a_run_or_fails() -> None:
    made = Diagram("watched", step=0.1)
    made.add("ramp", Ramp(slope=1.0))
    ends = Observer(lambda t, y: y >= 0.5, ["ramp.y"])
    run = made.run(2.0, engine="compiled", observers=[ends])
    assert (run.engine, run.failure, run["ramp.y"].tolist()[-1]) == ("compiled", None, 0.5)
    assert len(run.time) == 6

    def fail(t: float, y: float) -> None:
        if y > 0.45:
            raise LookupError("seen enough")

    with pytest.raises(SimulationError, match="observer '.*fail' failed at t = 0.5 s") as caught:
        made.run(2.0, engine="compiled", observers=[Observer(fail, ["ramp.y"])])
    assert len(caught.value.run.time) == 6


def test_a_run_says_which_engine_ran(tmp_path: Path) -> None:
    made = Diagram("plain", step=0.1)
    made.add("ramp", Ramp(slope=1.0))
    for engine in ENGINES:
        run = made.run(1.0, engine=engine)
        assert (run.engine, run.info["engine_reason"]) == (engine, "")
        run.save(tmp_path / "run.parquet")
        assert Run.load(tmp_path / "run.parquet").engine == engine
    assert made.run(1.0).engine == "compiled"


@pytest.mark.parametrize("first", ENGINES)
def test_a_checkpoint_of_one_engine_goes_on_with_the_other(
    fmus: dict[str, Path], first: str
) -> None:
    made = failing(fmus["faulty"])
    whole = made.run(1.0, engine="python")
    second = ENGINES[1 - ENGINES.index(first)]
    with made.simulation(engine=first) as simulation:
        checkpoint = simulation.advance(0.43).checkpoint()
    rest = made.run(1.0, engine=second, resume=checkpoint)
    assert rest.engine == second
    for name in whole.frame.columns:
        assert rest[name].tobytes() == whole[name][43:].tobytes()


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
def test_ctrl_c_ends_a_run(fmus: dict[str, Path]) -> None:
    made = failing(fmus["faulty"])
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        made.run(1e7, engine="compiled", record=Recording([], every=10**6), progress=False)
    assert made.run(1.0, engine="compiled").engine == "compiled"


# Memory


def test_runs_leave_nothing(fmus: dict[str, Path]) -> None:
    """Of 200 runs, failures among them. A leaked object per tick would be 2000 blocks."""
    good = failing(fmus["faulty"])
    bad = failing(fmus["faulty"], fault=int(Fault.ERROR), phase=0, after=0.05)

    def once() -> None:
        good.run(0.1, engine="compiled", progress=False)
        with pytest.raises(SimulationError):
            bad.run(0.1, engine="compiled", progress=False)

    found = []
    once()
    for _ in range(3):
        gc.collect()
        before = sys.getallocatedblocks()
        for _ in range(200):
            once()
        gc.collect()
        found.append(sys.getallocatedblocks() - before)
        if found[-1] < 200:
            break
    assert min(found) < 200
