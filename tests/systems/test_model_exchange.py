"""Model Exchange: FMPy integrates our FMUs with CVode, and finds what co-simulation finds."""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Model

from railcosim.fmus import build
from railcosim.models import second_order_train
from railcosim.models.solver import DormandPrince, RungeKutta4
from tests import hybrid_plants, plants

# Plant, stop time in s, allowed difference relative to the signal's size: CVode's own accuracy at
# a relative tolerance of 1e-10, which events amplify.
SMOOTH, HYBRID = 1e-7, 1e-6


def run(path: Path, kind: str, stop: float, signal: Any = None) -> Any:
    tolerance = 1e-10 if kind == "ModelExchange" else None
    return simulate_fmu(
        str(path), fmi_type=kind, stop_time=stop, output_interval=0.01, input=signal,
        record_events=False,
        relative_tolerance=tolerance,  # pyright: ignore[reportArgumentType]
    )  # fmt: skip


def compare(path: Path, stop: float, allowed: float, signal: Any = None) -> None:
    ours = run(path, "CoSimulation", stop, signal)
    theirs = run(path, "ModelExchange", stop, signal)
    _, at = np.unique(np.round(theirs["time"] / 0.01).astype(int), return_index=True)
    theirs = theirs[at]
    assert len(ours) == len(theirs)
    if signal is not None:  # a row at a jump shows one side of it, here and there
        times, counts = np.unique(signal["time"], return_counts=True)
        kept = ~np.isin(np.round(ours["time"], 9), times[counts > 1])
        ours, theirs = ours[kept], theirs[kept]
    for name in ours.dtype.names[1:]:
        size = max(np.max(np.abs(ours[name])), 1e-6)
        assert np.max(np.abs(ours[name] - theirs[name])) <= allowed * size, name


@pytest.mark.parametrize(
    ("plant", "stop"),
    [(plants.pendulum, 5.0), (plants.everything, 2.0), (second_order_train, 20.0)],
)
def test_smooth_plants_agree(plant, stop: float) -> None:
    compare(build(plant()), stop, SMOOTH)


@pytest.mark.parametrize(
    ("plant", "stop"),
    [
        (hybrid_plants.braking, 60.0),
        (hybrid_plants.ball, 3.0),
        (hybrid_plants.stick_slip, 10.0),
        (hybrid_plants.clock, 2.95),
        (hybrid_plants.fleet, 7.0),
    ],
)
def test_hybrid_plants_agree(plant, stop: float) -> None:
    accurate = DormandPrince(relative_tolerance=1e-11, absolute_tolerance=1e-12)
    compare(build(plant(), solver=accurate), stop, HYBRID)


def test_events_counted_by_model_exchange() -> None:
    path = build(hybrid_plants.counters())
    found = run(path, "ModelExchange", 20.0)
    assert (found["up"][-1], found["down"][-1], found["both"][-1]) == (4, 3, 7)  # 0, π, … 6π
    assert found["last"][-1] == pytest.approx(6.0 * np.pi, abs=1e-7)


def test_inputs_that_jump_agree() -> None:
    signal = np.array(
        [(0.0, 0.0), (5.0, 0.0), (5.0, 3e5), (8.0, 3e5), (8.0, -2e5), (60.0, -2e5)],
        dtype=[("time", float), ("drive", float)],
    )
    accurate = DormandPrince(relative_tolerance=1e-11, absolute_tolerance=1e-12)
    compare(build(hybrid_plants.braking(), solver=accurate), 60.0, HYBRID, signal)


def test_memories_agree_to_the_step() -> None:
    """Inner-step memory advances with the integrator's steps: the same path, other steps.

    The path ends on the envelopes, where the force does not depend on the steps at all; on the
    way to a turning point it lags by at most one step. Stated: 2 % of the largest force.
    """
    signal = np.array(
        [(0.0, 0.05), (1.0, 0.05), (1.0, -0.05), (2.0, -0.05), (2.0, 0.05), (3.0, 0.05)],
        dtype=[("time", float), ("rate", float)],
    )
    path = build(hybrid_plants.draft_gear(), solver=RungeKutta4(inner_step=0.001))
    compare(path, 3.0, 0.02, signal)
    ours, theirs = (
        run(path, k, 3.0, signal)["force"][-1] for k in ("CoSimulation", "ModelExchange")
    )
    assert ours == pytest.approx(theirs, rel=1e-7)


# The functions of model exchange, called directly


class FMU2Exchange(FMU2Model):
    def __init__(self, path: Path, folder: Path) -> None:
        description: Any = read_model_description(str(path))
        self.vr = {v.name: v.valueReference for v in description.modelVariables}
        extract(str(path), str(folder))
        super().__init__(
            guid=description.guid,
            modelIdentifier=description.modelExchange.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="model",
        )
        self.instantiate()
        self.setupExperiment(startTime=0.0)
        self.enterInitializationMode()
        self.exitInitializationMode()

    def settle(self) -> tuple:
        """Iterate events; return (… states changed, …, next time defined, next time)."""
        info = self.newDiscreteStates()
        self.enterContinuousTimeMode()
        return info

    def arrays(self, n: int) -> Any:
        return (ctypes.c_double * n)()


def test_time_events_are_announced(tmp_path: Path) -> None:
    model = FMU2Exchange(build(hybrid_plants.clock()), tmp_path)
    needed, terminate, _, changed, has_next, next_time = model.settle()
    assert (needed, terminate, changed, has_next, next_time) == (False, False, False, True, 0.3)
    model.setTime(0.3)
    x = model.arrays(1)
    x[0] = 0.3
    model.setContinuousStates(x, 1)
    model.enterEventMode()
    *_, changed, has_next, next_time = model.settle()
    assert (changed, has_next, next_time) == (True, True, 0.6)
    model.getContinuousStates(x, 1)
    assert x[0] == 0.0
    model.freeInstance()


def test_indicators_of_events_whose_guard_does_not_hold_rest(tmp_path: Path) -> None:
    model = FMU2Exchange(build(hybrid_plants.braking()), tmp_path)
    model.settle()
    z = model.arrays(2)
    model.getEventIndicators(z, 2)
    assert list(z) == pytest.approx(
        [20.0, 1.0]
    )  # the speed; the release is not watched while moving
    model.freeInstance()


def test_an_event_that_was_overlooked_is_asked_for(tmp_path: Path) -> None:
    model = FMU2Exchange(build(hybrid_plants.braking()), tmp_path)
    model.settle()
    x = model.arrays(2)
    x[1] = -0.5
    model.setTime(40.0)
    model.setContinuousStates(x, 2)
    assert model.completedIntegratorStep()[0]
    model.enterEventMode()
    model.settle()
    model.getContinuousStates(x, 2)
    assert x[1] == 0.0
    assert model.getInteger([model.vr["mode"]]) == [hybrid_plants.STANDING]
    assert not model.completedIntegratorStep()[0]
    model.freeInstance()


def test_nominal_values(tmp_path: Path) -> None:
    model = FMU2Exchange(build(hybrid_plants.braking()), tmp_path)
    x = model.arrays(2)
    model.getNominalsOfContinuousStates(x, 2)
    assert list(x) == [1.0, 10.0]
    model.freeInstance()


@pytest.mark.parametrize("interval", [0.05, 0.5, 5.0])
def test_an_event_from_rest_is_not_late(interval: float) -> None:
    """v = 0, moving by mode, pushed back: the crossing stands at zero where integration begins."""
    found = simulate_fmu(
        str(build(hybrid_plants.braking())), fmi_type="ModelExchange", stop_time=10.0,
        output_interval=interval, start_values={"speed": 0.0}, relative_tolerance=1e-8,
    )  # fmt: skip
    assert found["speed"][-1] == 0.0
    assert found["position"][-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("stop", [1.0, 2.0, 10.0])
@pytest.mark.parametrize("resets", [False, True])
def test_an_event_that_another_one_forestalls_does_not_fire(
    kind: str, stop: float, resets: bool
) -> None:
    """Two cross at one instant; the first closes the other's guard, or takes its crossing away."""
    path = build(hybrid_plants.rivals(resets=resets))
    found = run(path, kind, stop)
    assert found["first"][-1] == 1
    assert found["second"][-1] == (1 if resets and stop > 1.2 else 0)
