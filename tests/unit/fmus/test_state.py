"""Saving, restoring and serializing the FMU's state: the continuation has the same bits."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models.solver import DormandPrince, Rodas
from tests import hybrid_plants
from tests.instances import FMU2Named
from tests.unit.fmus.state_continuation import continued

ROOT = Path(__file__).parents[3]
PLANTS = {
    "braking": hybrid_plants.braking,
    "braking, adaptive": lambda: hybrid_plants.braking(solver=DormandPrince()),
    "braking, stiff": lambda: hybrid_plants.braking(solver=Rodas()),
    "draft gear": hybrid_plants.draft_gear,
    "clock": hybrid_plants.clock,
    "counters": lambda: hybrid_plants.counters(frequency=7.0),
}
INPUTS = {"drive": (-5e4, 3e5), "rate": (-0.1, 0.1)}


def schedule(slave: FMU2Named, generator: Any, count: int) -> list:
    """Return random steps with random inputs."""
    names = [v.name for v in slave.description.modelVariables if v.causality == "input"]
    return [
        (
            float(generator.uniform(0.005, 0.6)),
            {n: float(generator.uniform(*INPUTS[n])) for n in names},
        )
        for _ in range(count)
    ]


def names_of(slave: FMU2Named) -> list[str]:
    return [v.name for v in slave.description.modelVariables if v.causality in ("output", "local")]


@pytest.mark.parametrize("name", PLANTS)
def test_continuations_here_and_in_another_process(tmp_path: Path, name: str) -> None:
    """At 50 random times of a run with random inputs and steps."""
    path = build(PLANTS[name]())
    slave = FMU2Named(path, tmp_path)
    generator = np.random.default_rng(11)
    slave.initialize()
    names, time, cases, expected = names_of(slave), 0.0, [], []
    for _ in range(50):
        for step, values in schedule(slave, generator, int(generator.integers(1, 4))):
            continued(slave, time, [(step, values)], names)
            time += step
        state = slave.getFMUstate()
        ahead = schedule(slave, generator, 4)
        data = slave.serializeFMUstate(state)
        first = continued(slave, time, ahead, names)
        slave.setFMUstate(state)
        assert continued(slave, time, ahead, names) == first
        slave.setFMUstate(state)
        slave.freeFMUstate(state)
        cases.append({"state": bytes(data).hex(), "time": time, "inputs": ahead})
        expected.append(first)
    slave.freeInstance()
    done = subprocess.run(
        [sys.executable, "-m", "tests.unit.fmus.state_continuation"],
        input=json.dumps({"fmu": str(path), "names": names, "cases": cases}),
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == expected


def test_a_state_between_setting_and_stepping(tmp_path: Path) -> None:
    slave = FMU2Named(build(hybrid_plants.braking()), tmp_path)
    slave.initialize()
    slave.doStep(0.0, 1.0)
    slave.set("drive", 2e5)
    state = slave.getFMUstate()
    expected = continued(slave, 1.0, [(0.5, {})], names_of(slave))
    slave.set("drive", -1e5)
    slave.setFMUstate(state)
    assert slave.get("drive") == 2e5
    assert continued(slave, 1.0, [(0.5, {})], names_of(slave)) == expected
    slave.freeFMUstate(state)
    slave.freeInstance()


def test_a_state_at_an_event(tmp_path: Path) -> None:
    """x passes 0.5 exactly where a step ends: the event belongs to one side, in both runs."""
    slave = FMU2Named(build(hybrid_plants.twins()), tmp_path)
    slave.initialize()
    slave.doStep(0.0, 0.5)
    state = slave.getFMUstate()
    expected = continued(slave, 0.5, [(0.1, {})], names_of(slave))
    slave.setFMUstate(state)
    assert continued(slave, 0.5, [(0.1, {})], names_of(slave)) == expected
    assert slave.get("order") == 21
    slave.freeFMUstate(state)
    slave.freeInstance()


def test_a_state_brings_an_instance_back_from_an_error(tmp_path: Path) -> None:
    slave = FMU2Named(build(hybrid_plants.ball()), tmp_path)
    slave.initialize()
    slave.doStep(0.0, 3.0)
    state = slave.getFMUstate()
    expected = continued(slave, 3.0, [(0.5, {})], names_of(slave))
    slave.fails(lambda: slave.doStep(3.5, 1.0), "chatters")
    slave.fails(lambda: slave.doStep(3.5, 0.1), "not allowed after an error")
    failed = slave.getFMUstate()
    slave.setFMUstate(state)
    assert continued(slave, 3.0, [(0.5, {})], names_of(slave)) == expected
    slave.setFMUstate(failed)  # an error is part of the state as well
    slave.fails(lambda: slave.doStep(3.5, 0.1), "not allowed after an error")
    for kept in (state, failed):
        slave.freeFMUstate(kept)
    slave.freeInstance()


def test_a_state_of_another_model_is_refused(tmp_path: Path) -> None:
    one = FMU2Named(build(hybrid_plants.ball()), tmp_path / "1")
    two = FMU2Named(build(hybrid_plants.twins()), tmp_path / "2")
    state = one.getFMUstate()
    data = one.serializeFMUstate(state)
    two.fails(lambda: two.deSerializeFMUstate(data), "the size must be")
    two.fails(lambda: two.setFMUstate(state), "not of this model")
    one.fails(lambda: one.deSerializeFMUstate(bytes(len(data))), "not of this model")
    one.freeFMUstate(state)
    for slave in (one, two):
        slave.freeInstance()
