"""Handlings of a short train on its FMU: by plan, and with the speed held by PID."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Diagram, Fmu, Profile, Run
from railcosim.base.errors import ParameterError
from railcosim.controllers.train_handling import Handling, HandlingDriver, RigidTrain
from railcosim.models.consist import coal_train
from railcosim.models.line import Line, Section, Stop
from railcosim.models.line.ttobench import write_ttobench
from railcosim.studies.heavy_haul.handling_cases import (
    Ride,
    by_plan,
    coupler_forces,
    judged,
    paper_pid,
    record,
    ride_handling,
    run_ride,
    speed_tracking,
)
from railcosim.studies.heavy_haul.loop import train_fmu
from railcosim.studies.heavy_haul.reduced_train import reduced_train

WAVES = Section(
    name="waves",
    length=2000.0,
    gradients=(
        (0.0, 0.0), (300.0, 6.0), (550.0, -6.0), (800.0, 6.0), (1100.0, -6.0), (1400.0, 0.0),
    ),
    speed_limits=((0.0, 80.0 / 3.6),),
)  # fmt: skip
RIDE = Ride(
    consist=coal_train(locomotives=1, wagons=12), section=WAVES, start_speed=12.0, cruise=14.0,
    ramp=60.0,
)  # fmt: skip
DOCS = Path(__file__).parents[2] / "docs" / "train-handling.md"
MORE = ("train.group[1].applied", "train.group[2].applied")
RIGID = RigidTrain(train=reduced_train(RIDE.consist), section=WAVES)


@pytest.fixture(scope="module")
def plan() -> Handling:
    return ride_handling(RIDE)


@pytest.fixture(scope="module")
def planned(plan: Handling) -> Run:
    return run_ride(RIDE, by_plan(RIDE, HandlingDriver.along(plan)))


def test_pulled_evenly_the_fmu_has_the_rigid_trains_forces() -> None:
    """Up 6 ‰ at nearly constant speed; what still rings in the train has no mean over 80 s."""
    diagram = Diagram("even", step=0.1)
    diagram.add("pull", Profile(((0.0, 0.0), (30.0, 120e3)), unit="N"))
    diagram.add("release", Constant(0.0, unit="kPa"))
    places = [position for position, _ in WAVES.gradients]
    diagram.add("train", Fmu(
        train_fmu(RIDE.consist, gradients=len(places)), initial_speed=12.0,
        gradient_position=places, gradient=[6.0] * len(places),
    ))  # fmt: skip
    diagram.connect("pull.y", "train.group[1].force")
    diagram.connect("release.y", "train.group[1].reduction")
    run = diagram.run(150.0, record=record(RIDE), progress=False)
    slope = Section(
        name="even", length=2000.0, gradients=((0.0, 6.0),), speed_limits=((0.0, 20.0),)
    )
    expected = RigidTrain(train=RIGID.train, section=slope).coupler_forces(
        run["train.position"], run["train.speed"], run["train.group[1].applied"]
    )
    found = coupler_forces(RIDE, run).T
    last = slice(700, None)  # 80 s
    assert found[:, last].mean(axis=1) == pytest.approx(expected[:, last].mean(axis=1), rel=1e-4)


def test_the_plan_arrives_in_time(plan: Handling, planned: Run) -> None:
    found = judged(RIDE, planned)
    assert found.running_time == pytest.approx(RIDE.time, rel=0.005)
    assert found.end_speed == pytest.approx(RIDE.cruise, abs=0.1)
    assert found.traction_energy * 3.6e6 == pytest.approx(plan.figures().traction, rel=0.02)


def test_the_reduced_model_tells_the_fmus_forces(planned: Run) -> None:
    force = coupler_forces(RIDE, planned).T
    expected = RIGID.coupler_forces(
        planned["train.position"], planned["train.speed"], planned["train.group[1].applied"]
    )
    error = np.sqrt(np.mean((force - expected) ** 2))
    assert error < 0.2 * np.sqrt(np.mean(force**2))


def test_it_is_gentler_than_a_held_speed_in_the_same_time(planned: Run) -> None:
    ours = judged(RIDE, planned)
    theirs = judged(RIDE, run_ride(RIDE, speed_tracking(RIDE, paper_pid())))
    assert ours.running_time == pytest.approx(theirs.running_time, rel=0.005)
    assert ours.peak_tension < 0.7 * theirs.peak_tension
    assert ours.peak_compression < theirs.peak_compression
    assert ours.rms_coupler_force < theirs.rms_coupler_force
    assert ours.traction_energy < theirs.traction_energy


def test_a_train_that_does_not_arrive_has_no_time() -> None:
    standing = HandlingDriver(
        position=(0.0, 2000.0), speed=(1.0, 1.0), force=(-2e5, -2e5), reduction=(0.0, 0.0), gain=0.0
    )
    found = judged(RIDE, run_ride(RIDE, by_plan(RIDE, standing)))
    assert np.isnan(found.running_time) and np.isnan(found.end_speed)


MIXED = """
schema: railcosim-consist
schema_version: 1
name: engines in front and at the back
draft_gears: {MT-2: {}}
couplers: {coupler: {gear: MT-2}}
vehicles:
  Engine:
    mass: 120
    length: 20
    resistance: {constant: 1.4, linear: 0.0038, quadratic: 0.0003, starting: 5}
    traction: {points: [[0, 300], [72, 200]], power: 3000}
    electric_brake: {points: [[0, 0], [18, 200]], power: 2500}
  Loaded: {like: Engine, mass: 100, length: 12, traction: null, electric_brake: null, brake: {}}
  Empty: {like: Loaded, mass: 20, brake: {cylinder_pressure: 168}}
train:
  - {vehicle: Engine, times: 2}
  - {vehicle: Loaded, times: 3}
  - {vehicle: Empty, times: 2}
  - {vehicle: Engine}
  - {vehicle: Loaded}
end_of_train: {radio_delay: 1.5}
"""


def test_the_documentations_train_of_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line file, two groups of which the one behind is late by radio, and the device."""
    line = Line(
        name="Own", length=WAVES.length, gradients=WAVES.gradients,
        speed_limits=WAVES.speed_limits,
        stops=(Stop(name="Oak Street", position=0.0), Stop(name="Harbour", position=WAVES.length)),
    )  # fmt: skip
    monkeypatch.chdir(tmp_path)
    write_ttobench(line, "my_line.json")
    Path("my_train.yaml").write_text(MIXED)
    blocks = re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    code = next(block for block in blocks if "read_line" in block)
    found: dict[str, Any] = {}
    exec(code.replace("record=[", "record=[*more, "), found | {"more": MORE}, found)
    plan, run = found["plan"], found["run"]
    arrived = int(np.searchsorted(run["train.position"], WAVES.length))
    assert run.time[arrived] == pytest.approx(plan.running_time, rel=0.005)
    assert run["train.speed"][arrived] == pytest.approx(12.0, abs=0.2)
    front, rear = (run[f"train.group[{k}].applied"] for k in (1, 2))
    assert rear[11:] == pytest.approx(front[1:-10] / 2.0, abs=1.0)  # 1 s later, one of three
    assert np.abs(front).max() > 20e3 and np.abs(rear[:11]).max() == 0.0


def test_trains_that_the_diagrams_do_not_command() -> None:
    consist = coal_train(locomotives=2, wagons=12, distributed=True)
    with pytest.raises(ParameterError, match="needs a train with one group of locomotives"):
        Ride(consist=consist, section=WAVES)
