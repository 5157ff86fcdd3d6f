"""Of an FMU's outputs a tick gets those that are needed; the others come when all are looked at."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Gain, SimulationError
from railcosim.base import ops
from railcosim.fmus import build
from railcosim.models import Plant

OUTPUTS = ["train.double", "train.position", "train.root", "train.speed"]
ENGINES = ["python", "compiled"]


def plant() -> Plant:
    """A train whose `root`, the square root of 1 m − position, ends at position 1."""
    with Plant("needed_outputs", stop=3.0, step=0.01) as made:
        push = made.input("push", unit="m/s2")
        x, v = made.state("x", unit="m"), made.state("v", unit="m/s")
        made.der(x, v)
        made.der(v, push)
        made.output("double", 2.0 * x, unit="m")
        made.output("position", 1.0 * x, unit="m")
        made.output("root", ops.sqrt(1.0 - x), unit="1")
        made.output("speed", 1.0 * v, unit="m/s")
    return made


@pytest.fixture(scope="module")
def fmu() -> Path:
    return build(plant())


def loop(fmu: Path, delay: float = 0.02) -> Diagram:
    made = Diagram("loop", step=0.01)
    made.add("goal", Constant(0.3, unit="m/s2"))
    made.add("link", Delay(delay, interpolation="hold"))
    made.add("train", Fmu(fmu))
    made.add("meter", Gain(2.0))
    made.connect("goal.y", "link.u")
    made.connect("link.y", "train.push")
    made.connect("train.position", "meter.u")
    return made


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("delay", [0.02, 0.0137])
def test_what_is_not_got_is_the_same_when_looked_at(fmu: Path, delay: float, engine: Any) -> None:
    made = loop(fmu, delay)
    whole = made.run(1.5, record=OUTPUTS, engine=engine)
    part = made.run(1.5, record=["meter.y"], engine=engine)
    assert part["meter.y"].tobytes() == (2.0 * whole["train.position"]).tobytes()
    with made.simulation(record=["meter.y"], engine=engine) as simulation:
        for time in (0.37, 0.38, 1.5):
            simulation.advance(time)
            row = round(time / 0.01)
            assert [simulation[name] for name in OUTPUTS] == [whole[n][row] for n in OUTPUTS]


@pytest.mark.parametrize("engine", ENGINES)
def test_one_that_is_not_finite_ends_the_run(fmu: Path, engine: Any) -> None:
    """Needed or not: the FMU looks at all that it has computed."""
    failures = []
    for record in (["train.root"], ["train.position"]):
        with pytest.raises(SimulationError, match=r"'train': .* root is not finite") as seen:
            loop(fmu).run(3.0, record=record, engine=engine)
        rows = seen.value.run.values
        assert np.isfinite(rows).all() and 255 < len(rows) < 265  # 0.15 t² passes 1 at t = 2.58 s
        failures.append((str(seen.value), len(rows)))
    assert failures[0] == failures[1]


def test_calls_get_from_the_first_to_the_last(fmu: Path) -> None:
    instance = Fmu(fmu).instance("train")
    try:
        instance.enter_initialization(0.0, None)
        instance.exit_initialization()
        instance.inputs([0.5])
        instance.fetch()
        ports = list(Fmu(fmu).outputs)
        for places in ((), (0,), (1, 2), (1, 3), (0, 1, 2, 3)):
            array = instance.output_slots[0][0]
            array[:] = [-1.0] * len(ports)
            for function, arguments, name in instance.gets_of(places):
                assert name == "fmi2GetReal" and function(*arguments) == 0
            got = {i for i, value in enumerate(array) if value != -1.0}
            assert got == (set(range(min(places), max(places) + 1)) if places else set())
            instance.fetch()
    finally:
        instance.close()
