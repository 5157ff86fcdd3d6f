"""Random diagrams: a Runner against fresh runs, and divided ticks against `Coupling.split`."""

import random
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Gain, Noise, RailcosimError, SimulationError
from railcosim.cosim import TwoPhase
from railcosim.cosim.schedule import schedule
from railcosim.fmus import build
from tests import coupled_plants
from tests.bare_schedules import assert_same
from tests.foreign import ALL, STATE, foreign_fmu
from tests.systems.test_engines import ENGINES, Maker, run_of

TICKS = 45


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {
        "linear": build(coupled_plants.linear()),
        "direct": build(coupled_plants.linear_direct()),
        "filter": foreign_fmu("filter", folder / "filter", declares=ALL, order=1),
        "plain": foreign_fmu("filter", folder / "plain"),
        "kinds": foreign_fmu("kinds", folder / "kinds", declares=STATE),
        "kinds_plain": foreign_fmu("kinds", folder / "kinds_plain"),
    }


def values(diagram: Diagram, rng: random.Random) -> dict[str, Any]:
    """Return some other values for a diagram's parameters."""
    found: dict[str, Any] = {}
    step = float(diagram.step)
    for name, block in diagram.blocks.items():
        if rng.random() < 0.5:
            continue
        match block:
            case Delay():
                steps = rng.choice([0.0, 1.0, 2.0, 5.0, rng.uniform(0.0, 9.0)])
                found[f"{name}.time"] = steps * step
                if rng.random() < 0.2:
                    found[f"{name}.interpolation"] = rng.choice(["linear", "hold"])
            case Constant():
                found[f"{name}.value"] = rng.uniform(-1.0, 1.0)
            case Gain():
                found[f"{name}.k"] = rng.uniform(-1.0, 1.0)
            case Noise():
                found[f"{name}.seed"] = rng.randrange(100)
            case Fmu() if "tau" in block.parameters():
                found[f"{name}.tau"] = rng.uniform(0.5, 3.0)
            case Fmu() if "x1" in block.values:
                found[f"{name}.x1"] = rng.uniform(-1.0, 1.0)
    return found


def outcome(call: Any) -> list[Any]:
    """Return what a run gave, or its error."""
    try:
        run = call()
    except SimulationError as error:
        run = error.run
    except RailcosimError as error:
        return [type(error), str(error)]
    return [run.columns, run.failure, dict(run.info), run.time, run.values]


def compare(seed: int, fmus: dict[str, Path], engine: str) -> None:
    maker = Maker(seed, fmus)
    diagram = maker.diagram()
    options = maker.options(diagram)
    scenario, rng = options.pop("scenario"), random.Random(seed)
    stop = options["start"] + TICKS * maker.step
    with diagram.runner(stop, engine=engine, **options) as runner:
        for _ in range(5):
            given, changes = values(diagram, rng), rng.choice([None, scenario])
            kept = outcome(partial(runner.run, given, scenario=changes))
            made = diagram.with_values(given)
            fresh = partial(made.run, stop, engine=engine, scenario=changes, **options)
            assert_same(kept, outcome(fresh))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("seed", range(15))
def test_a_runner_gives_what_runs_give(seed: int, engine: str, fmus: dict[str, Path]) -> None:
    compare(seed, fmus, engine)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("block", range(10))
def test_many_runners(block: int, fmus: dict[str, Path]) -> None:
    for seed in range(40 * block, 40 + 40 * block):
        try:
            compare(seed, fmus, ENGINES[seed % 2])
        except AssertionError as error:
            raise AssertionError(f"seed {seed}") from error


class Dividing(Maker):
    """Random diagrams in which held delays drive FMUs at edges between the ticks."""

    def algorithm(self, made: Diagram) -> Any:
        return TwoPhase()

    def delay(self) -> Delay:
        time = self.rng.choice([0.4, 0.4, 1.3, 2.7, self.rng.uniform(0.0, 6.0)]) * float(self.step)
        initial = self.rng.choice([0.0, self.number(), lambda t: 0.5 * t])
        return Delay(time, initial=initial, interpolation=self.rng.choice(["linear", "hold"]))

    def block(self) -> Any:
        chance = self.rng.random()
        return self.fmu() if chance < 0.25 else self.delay() if chance < 0.5 else super().block()


@pytest.mark.parametrize(
    "seed", [*range(20), *(pytest.param(n, marks=pytest.mark.slow) for n in range(20, 60))]
)
def test_divided_ticks_are_those_of_the_coupling(
    seed: int, fmus: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both engines write out what `Coupling.split` does in general."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        written = [run_of(Dividing(seed, fmus), engine, TICKS) for engine in ENGINES]
        monkeypatch.setattr(schedule, "divided", lambda *_: None)
        general = run_of(Dividing(seed, fmus), "python", TICKS)
    for found in written:
        if isinstance(found[0], str) and isinstance(general[0], str):
            assert found[0].rpartition("failed")[2] == general[0].rpartition("failed")[2]
        else:
            assert_same(found, general)
