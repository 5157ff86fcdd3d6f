"""The study heavy-haul: mirrored response, its loops, and what it makes of few runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railcosim import Constant, Diagram, Fmu, Profile, Run
from railcosim.base.errors import ParameterError
from railcosim.controllers import FuzzyPID, SamplePID
from railcosim.fmus import build
from railcosim.models import heavy_haul_train
from railcosim.models.consist import coal_train
from railcosim.studies.case import Case, run_cases
from railcosim.studies.heavy_haul import STUDY
from railcosim.studies.heavy_haul.experiments import cases_without_handling
from railcosim.studies.heavy_haul.measures import swing
from railcosim.studies.heavy_haul.targets import (
    Target,
    braking_force,
    smooth,
    start_up_force,
    target,
)
from railcosim.studies.metrics import UNITS
from railcosim.studies.results import Results

WAGONS = 6


@pytest.fixture(scope="module")
def fmu() -> Path:
    return build(heavy_haul_train(coal_train(wagons=WAGONS)))


def tracked(fmu: Path, controller: SamplePID, sign: float) -> Run:
    """A run on the level without resistance at 15 m/s, where traction and brake are no limit."""
    zero = {
        f"vehicle[{i}].resistance_{name}": 0.0
        for i in range(1, WAGONS + 3)
        for name in ("constant", "linear", "quadratic", "starting")
    }
    points = [
        (t, sign * 120e3 * (smooth((t - 1.0) / 4.0) - 2.0 * smooth((t - 10.0) / 6.0)))
        for t in (0.1 * k for k in range(250))
    ]
    loop = Diagram("mirror", step=0.002)
    loop.add("target", Profile(tuple(points), unit="N"))
    loop.add("controller", controller)
    loop.add("released", Constant(0.0, unit="kPa"))
    loop.add("train", Fmu.with_values(fmu, {"initial_speed": 15.0, **zero}))
    loop.connect("target.y", "controller.reference")
    loop.connect("train.coupler[2].force", "controller.measurement")
    for port in ("upper", "lower"):
        loop.connect(f"train.group[1].{port}", f"controller.{port}")
    loop.connect("controller.force", "train.group[1].force")
    loop.connect("released.y", "train.group[1].reduction")
    return loop.run(25.0, record=["train.coupler[2].force", "controller.force"], progress=False)


def test_a_mirrored_target_gives_a_mirrored_response(fmu: Path) -> None:
    controllers = {
        "folded": FuzzyPID(), "folded_little": FuzzyPID(extreme=2.0),
        "literal_little": FuzzyPID(reading="literal", extreme=2.0),
    }  # fmt: skip
    apart = {}
    for name, controller in controllers.items():
        up, down = (tracked(fmu, controller, sign) for sign in (1.0, -1.0))
        forces = [run["train.coupler[2].force"] for run in (up, down)]
        apart[name] = float(np.max(np.abs(forces[0] + forces[1])))
        assert np.max(np.abs(forces[0])) > 100e3
    assert apart["folded"] < 1.0  # N: rounding of places after 400 m
    assert apart["folded_little"] < 1.0
    assert apart["literal_little"] > 1e3


def test_the_targets_are_as_documented() -> None:
    """Formulas retyped: 1060 kN S((t − 1)/40); −350/−150 kN, 10 s between, times S(t/15)."""
    times = (0.0, 1.0, 21.0, 41.0, 90.0)
    assert [start_up_force(t) for t in times] == pytest.approx([0.0, 0.0, 530e3, 1060e3, 1060e3])
    times = (0.0, 7.5, 18.0, 25.0, 40.0, 85.0, 110.0, 145.0, 170.0)
    expected = [0.0, -175e3, -350e3, -250e3, -150e3, -250e3, -350e3, -250e3, -150e3]
    assert [braking_force(t) for t in times] == pytest.approx(expected)
    assert target("start_up_force").output((), 21.0) == start_up_force(21.0)
    with pytest.raises(ParameterError, match="curve is one of start_up_force"):
        Target(curve="start")


def test_swing_is_the_greatest_change_within_half_a_second() -> None:
    time = np.arange(0.0, 10.0, 0.002)
    assert swing(time, 7.0 * np.sin(2.0 * np.pi * 4.0 * time)) == pytest.approx(14.0, rel=1e-4)
    assert swing(time, 3.0 * time) == pytest.approx(1.5, rel=0.01)


@pytest.fixture(scope="module")
def few() -> Results:
    """The study's cheap cases, and the first seconds of the start-up."""
    found: list[Case] = []
    for case in cases_without_handling():
        if case.name in ("start_up-pid", "start_up-fuzzy_folded", "braking-pid"):
            found.append(replace(case, stop=6.0))
        elif case.experiment in ("gear_loop", "open_loop_start"):
            found.append(case)
        elif case.name in ("brake_wave-front_only", "brake_wave-end_of_train"):
            found.append(replace(case, stop=20.0))
    return run_cases("heavy-haul", found, UNITS)


def test_the_end_of_train_device_lowers_the_compression(few: Results) -> None:
    front = few.get("brake_wave", "front_only", "peak_compression")
    both = few.get("brake_wave", "end_of_train", "peak_compression")
    assert front is not None and both is not None
    assert both < 0.6 * front


def test_the_gentle_start_pulls_as_the_masses_say(few: Results) -> None:
    """Coupler 2 bears the wagons' share of 1140 kN: 10,000 t of 10,400 t, less their resistance."""
    peak = few.get("open_loop_start", "open_loop", "peak_tension")
    assert peak == pytest.approx(1140.0 * 10000.0 / 10400.0, rel=0.01)
    assert few.get("open_loop_start", "open_loop", "peak_tension_at") == 2.0


def test_a_gears_loop_takes_work(few: Results) -> None:
    for form in ("incremental", "dahl", "switching"):
        work = few.get("gear_loop", form, "energy")
        assert work is not None and work > 0.0


def test_figures_and_ledger_of_few_runs(few: Results) -> None:
    """Whatever is missing, nothing fails: what could not be measured cannot be verified."""
    entries = STUDY.judge(few)
    assert len(entries) == 16
    verdicts = {entry.claim: entry.verdict for entry in entries}
    assert verdicts["Fast response"] == "cannot be verified"
    drawn = STUDY.figures(few)
    assert {"fig3_gear_loop", "fig4_inputs", "fig5_outputs", "fig7_start_up", "fig8_braking"} <= (
        drawn.keys()
    )


def test_every_metric_has_its_unit(few: Results) -> None:
    for row in few.metrics.values():
        for metrics in row.values():
            assert metrics.keys() <= UNITS.keys()
