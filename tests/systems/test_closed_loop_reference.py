"""The co-simulated loops against the same loops written a second time (reference_loop.py)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Run
from railcosim.studies.case import with_overrides
from railcosim.studies.soft_switching.controllers import (
    LINE_UP,
    LITERAL_PERIODS,
    VARIANTS,
    literal_name,
)
from railcosim.studies.soft_switching.experiments import EXPERIMENTS
from tests.systems import reference_loop as ref

CONTROLLERS = LINE_UP | VARIANTS
EXPERIMENT = {e.name: e for e in EXPERIMENTS}
PROFILE = [(0, 0), (10, 8), (30, 16), (70, 16), (100, 14.5), (110, 14.5), (115, 16), (140, 16),
           (148, 10), (170, 10), (182.5, 0), (195, 0)]  # fmt: skip

REFERENCES: dict[str, Callable[[], Any]] = {
    "pid_zn": lambda: ref.Pid(6.65, 2.83, 0.707, 0.0707),
    "pid_simc": lambda: ref.Pid(4.743, 8.94, 1.972, 0.294),
    "pid_simc_kick": lambda: ref.Pid(4.743, 8.94, 1.972, 0.294, kick=True),
    "fuzzy": ref.Fuzzy,
    "neuron": ref.Neuron,
    "neuron_fixed": lambda: ref.Neuron(tuned=False),
    "composite": ref.Composite,
}


def ours(experiment: str, controller: str, fmu: Path) -> Run:
    case = EXPERIMENT[experiment].case(controller, CONTROLLERS[controller], fmu)
    (case,) = with_overrides([case], {})
    return case.diagram.run(case.stop)


def largest_error(run: Run, t: np.ndarray, y: np.ndarray, u: np.ndarray) -> float:
    """Return the largest difference of speed and control at the reference's samples."""
    every = round((t[1] - t[0]) / 0.01)
    speed, control = run["train.speed"][::every], run["controller.u"][::every]
    assert run.time[::every] == pytest.approx(t, abs=1e-9)
    return float(max(np.max(np.abs(speed - y)), np.max(np.abs(control - u))))


@pytest.mark.parametrize("name", REFERENCES)
def test_unit_step(train_fmu: Path, name: str) -> None:
    assert largest_error(ours("step", name, train_fmu), *ref.closed_loop(REFERENCES[name]())) < 1e-9


@pytest.mark.parametrize("name", [name for name in REFERENCES if name in LINE_UP])
def test_pulse(train_fmu: Path, name: str) -> None:
    expected = ref.closed_loop(
        REFERENCES[name](), stop=80.0, disturbance=lambda t: -0.2 if 19.99 < t < 34.99 else 0.0
    )
    assert largest_error(ours("pulse", name, train_fmu), *expected) < 1e-9


@pytest.mark.parametrize(
    ("experiment", "plant"),
    [
        ("gain_plus_20", {"gain": 2.64}),
        ("frequency_plus_20_numerator_held", {"wn": 0.216, "gain": 0.07128 / 0.216**2}),
        ("frequency_plus_20_gain_held", {"wn": 0.216}),
        ("delay_300ms", {"delay_samples": 6}),
    ],
)
@pytest.mark.parametrize("name", ["pid_zn", "composite"])
def test_perturbed_and_delayed(train_fmu: Path, experiment: str, plant: dict, name: str) -> None:
    expected = ref.closed_loop(REFERENCES[name](), **plant)
    assert largest_error(ours(experiment, name, train_fmu), *expected) < 1e-9


@pytest.mark.parametrize("name", ["pid_zn", "pid_simc", "fuzzy", "neuron", "composite"])
def test_line_profile(train_fmu: Path, name: str) -> None:
    t, v = np.array(PROFILE, float).T
    expected = ref.closed_loop(
        REFERENCES[name](), stop=195.0, reference=lambda s: float(np.interp(s, t, v))
    )
    assert largest_error(ours("profile", name, train_fmu), *expected) < 1e-9


# The literal variants do not settle: they amplify any difference, and a switch (an active set, a
# limit) that falls differently by a rounding error sends them apart. Where that begins, the
# reference tells by itself: started 1e-12 m/s away it stays within 1e-9 up to there.

LITERAL = {literal_name(text): period for text, period in LITERAL_PERIODS.items()}
SINGLE: dict[str, Callable[[], Any]] = {
    "fuzzy_literal": lambda: ref.Fuzzy(True),
    "neuron_literal": lambda: ref.Neuron(True),
}


@pytest.mark.parametrize("name", [*LITERAL, *SINGLE])
def test_literal_until_rounding_errors_send_it_apart(train_fmu: Path, name: str) -> None:
    period = LITERAL.get(name, 0.05)
    make = SINGLE.get(name, lambda: ref.Composite(True, period))
    t, y, u = ref.closed_loop(make(), ts=period)
    _, y_near, u_near = ref.closed_loop(make(), ts=period, speed=1e-12)
    apart = np.nonzero(np.maximum(np.abs(y_near - y), np.abs(u_near - u)) > 1e-9)[0]
    trusted = int(apart[0]) if len(apart) else len(t)
    run = ours("step", name, train_fmu)
    every = round(period / 0.01)
    speed, control = run["train.speed"][::every], run["controller.u"][::every]
    assert trusted * period > 4.0
    assert np.max(np.abs(speed - y)[:trusted]) < 1e-9
    assert np.max(np.abs(control - u)[:trusted]) < 1e-9


def test_the_literal_weights_run_to_fixed_shares() -> None:
    """One common factor drives all three: the shares go to the learning rates' (sheet)."""
    neuron = ref.Neuron(True)
    y = 0.0
    for _ in range(20):
        neuron(1.0 - y)
        y += 0.01
    shares = neuron.weights / np.sum(np.abs(neuron.weights))
    assert shares == pytest.approx([0.199, 0.483, 0.318], abs=2e-3)
