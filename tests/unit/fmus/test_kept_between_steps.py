"""What an FMU keeps from one step to the next changes no bit: restored states do without."""

import random
from pathlib import Path

import pytest

from railcosim.cosim.fmu.instance import FmuInstance
from railcosim.fmus import build
from railcosim.models import DormandPrince, Plant, Rodas, RungeKutta4, metro_train
from railcosim.models.solver import Solver

OUTPUTS = ("position", "speed", "electric", "air", "phase", "standstill", "air_brake_on")


@pytest.fixture(scope="module", params=[None, DormandPrince(), Rodas(), RungeKutta4()])
def fmu(request: pytest.FixtureRequest) -> Path:
    solver: Solver | None = request.param
    return build(metro_train(gradients=3), solver=solver)


def commands(seed: int) -> list[float]:
    """A stop and a departure: held for some steps each, zeros of both signs among them."""
    rng, found = random.Random(seed), list[float]()
    while len(found) < 400:
        command = rng.choice([0.0, -0.0, -0.9, -0.5, 0.6, rng.uniform(-1.0, 0.0)])
        found += [command] * rng.choice([1, 2, 20, 60])
    return found[:400]


def run(fmu: Path, seed: int, *, forgets: bool, sets_always: bool) -> list[tuple[float, ...]]:
    one = FmuInstance("train", fmu, ["electric_command", "air_command"], OUTPUTS)
    try:
        one.set("speed", 4.0)
        one.enter_initialization(0.0, None)
        one.exit_initialization()
        rows, last = [], None
        for k, command in enumerate(commands(seed)):
            if sets_always or command is not last:
                one.inputs([command, command])
                one.put()
            last = command
            if forgets:
                handle = one.save()
                one.restore(handle)
                one.release(handle)
            assert one.try_step(k * 0.05, 0.05) == 0
            one.fetch()
            rows.append(one.outputs())
        return rows
    finally:
        one.close()


@pytest.mark.parametrize("seed", range(3))
def test_steps_are_the_same_with_nothing_kept(fmu: Path, seed: int) -> None:
    expected = run(fmu, seed, forgets=True, sets_always=True)
    assert {row[4] for row in expected} > {0.0, 2.0}  # phases
    assert run(fmu, seed, forgets=False, sets_always=True) == expected
    assert run(fmu, seed, forgets=False, sets_always=False) == expected


def test_a_parameter_that_changes_between_steps_counts() -> None:
    """What was known of a crossing is out of date when a parameter in it has changed."""
    with Plant("level", stop=1.0, step=0.1, solver=RungeKutta4(inner_step=0.1)) as plant:
        limit = plant.parameter("limit", 10.0, unit="m", tunable=True)
        x = plant.state("x", start=1.0, unit="m", output=True)
        plant.der(x, plant.input("rate", unit="m/s"))
        mode = plant.mode("mode", start=0, minimum=0, maximum=1, output=True)
        plant.event("above", x - limit, direction="rising", when=mode == 0, changes={mode: 1})
    one = FmuInstance("level", build(plant), ["rate"], ["x", "mode"])
    try:
        one.enter_initialization(0.0, None)
        one.exit_initialization()
        for k in range(3):
            one.advance(k * 0.1, 0.1)
        assert one.outputs() == (1.0, 0.0)
        one.set("limit", 0.5)
        one.advance(0.3, 0.1)
        assert one.outputs() == (1.0, 1.0)
    finally:
        one.close()
