"""What is measured on a run: tracking, coupler forces, energy."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...base.railway import JOULES_PER_KWH
from ...cosim import Run
from ..metrics import Metrics
from .recorded import LAST

Floats = NDArray[np.float64]
KILONEWTON = 1e3
ENDING = 20.0  # s
SWING = 0.5  # s


def extremes(run: Run) -> Metrics:
    """Return the greatest tension and compression of the run with their couplers, in kN.

    From the train's own outputs of all couplers, at the communication points.
    """
    tension, compression = run["train.coupler_maximum"], -run["train.coupler_minimum"]
    high, low = int(np.argmax(tension)), int(np.argmax(compression))
    return {
        "peak_tension": float(tension[high]) / KILONEWTON,
        "peak_tension_at": float(run["train.coupler_maximum_at"][high]),
        "peak_compression": float(compression[low]) / KILONEWTON,
        "peak_compression_at": float(run["train.coupler_minimum_at"][low]),
    }


def energy(run: Run) -> Metrics:
    """Return traction (kWh at the wheel) and the residual of the energy account.

    The residual is the largest one, over all work that came in: traction, and what weight and
    motion gave up.
    """
    traction = run["train.energy.traction"]
    held = run["train.energy.potential"] + run["train.energy.kinetic"]
    work = float(np.max(traction + np.maximum(held[0] - held, 0.0)))
    residual = float(np.max(np.abs(run["train.energy.residual"])))
    return {
        "energy": float(traction[-1]) / JOULES_PER_KWH,
        "energy_residual": residual / work if work > 0.0 else None,
    }


def force_tracking(run: Run, *, measured: str, since: float = 0.0) -> Metrics:
    """Return the errors of a force and the largest swing of coupler 1's (kN), and the rest."""
    here = run.time >= since
    error = (run["target.y"] - run[f"train.{measured}"])[here] / KILONEWTON
    found: Metrics = {
        "rms_force_error": float(np.sqrt(np.mean(error * error))),
        "max_force_error": float(np.max(np.abs(error))),
    }
    found["largest_swing"] = swing(run.time, run["train.coupler[1].force"][here]) / KILONEWTON
    return found | rolled(run) | gains(run) | extremes(run) | energy(run)


def swing(time: Floats, force: Floats) -> float:
    """Return the greatest change of a force, up or down, within any half second."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    window = round(SWING / float(time[1] - time[0]))
    return float(np.max(maximum_filter1d(force, window) - minimum_filter1d(force, window)))


def swinging(run: Run, *, measured: str, since: float) -> Metrics:
    """Return `force_tracking`, and the RMS rate (kN/s) of coupler 1's force from `since` (s) on."""
    here = run.time >= since
    rate = np.diff(run["train.coupler[1].force"][here]) / np.diff(run.time[here])
    return force_tracking(run, measured=measured) | {
        "rms_force_rate": float(np.sqrt(np.mean(rate * rate))) / KILONEWTON
    }


def speed_tracking(run: Run) -> Metrics:
    """Return the errors of the speed (m/s), and the rest."""
    error = run["target.y"] - run["train.speed"]
    found: Metrics = {
        "rms_error": float(np.sqrt(np.mean(error * error))),
        "max_error": float(np.max(np.abs(error))),
    }
    return found | rolled(run) | gains(run) | extremes(run) | energy(run)


def rolled(run: Run) -> Metrics:
    """Return how far (m) the front went back, and its speed (m/s) at the end.

    Also the greatest difference (m/s) between first and last vehicle in the last 20 s.
    """
    position = run["train.position"]
    back = float(np.max(np.maximum.accumulate(position) - position))
    found: Metrics = {"rolled_back": back, "end_speed": float(run["train.speed"][-1])}
    if LAST in run.columns:
        ending = run.time >= run.time[-1] - ENDING
        apart = np.abs(run["train.speed"] - run[LAST])[ending]
        found["speed_spread"] = float(np.max(apart))
    return found


def gains(run: Run) -> Metrics:
    """Return how often (% of the samples) any gain was below zero, of a controller with gains."""
    if "controller.kp" not in run.columns:
        return {}
    below = [run[f"controller.{name}"] < 0.0 for name in ("kp", "ki", "kd")]
    return {"negative_gains": 100.0 * float(np.mean(np.any(below, axis=0)))}


def force_steps(run: Run, *, measured: str, steps: Sequence[tuple[float, float]]) -> Metrics:
    """Return `force_tracking`, the first step's rise time (s) and the greatest overshoot (%).

    `steps` are (begin, end) in s; the errors count from the first one on.
    """
    force, time = run[f"train.{measured}"], run.time
    target = run["target.y"]
    found = force_tracking(run, measured=measured, since=steps[0][0] - 1.0)
    overshoots = [_overshoot(time, force, target, *step) for step in steps]
    return found | {
        "rise_time": _rise(time, force, target, *steps[0]),
        "overshoot": max(overshoots),
    }


def _rise(time: Floats, force: Floats, target: Floats, begin: float, end: float) -> float | None:
    """Return how long (s) the force takes from 10 to 90 % of a step; None if it does not."""
    before, height = _height(time, target, begin)
    inside = (time >= begin) & (time < end)
    share = (force[inside] - before) / height
    if not np.any(share >= 0.9):
        return None
    first, last = (int(np.argmax(share >= level)) for level in (0.1, 0.9))
    return float(time[inside][last] - time[inside][first])


def _height(time: Floats, target: Floats, begin: float) -> tuple[float, float]:
    before = float(np.interp(begin - 0.1, time, target))
    return before, float(np.interp(begin + 0.1, time, target)) - before


def _overshoot(time: Floats, force: Floats, target: Floats, begin: float, end: float) -> float:
    before, height = _height(time, target, begin)
    inside = (time >= begin) & (time < end)
    return max(0.0, 100.0 * (float(np.max((force[inside] - before) / height)) - 1.0))


def joints_of(run: Run) -> list[int]:
    """Return the couplers whose forces a run has kept."""
    return [i for i in range(1, 1000) if f"train.coupler[{i}].force" in run.columns]


def whole_train(run: Run) -> Metrics:
    """Return the extremes over all inner steps, and the RMS over time and couplers, in kN.

    The run has the forces of all couplers, and their extremes.
    """
    joints = joints_of(run)
    squares = [float(np.mean(run[f"train.coupler[{i}].force"] ** 2)) for i in joints]
    highest = np.array([run[f"train.coupler[{i}].highest"][-1] for i in joints])
    lowest = np.array([run[f"train.coupler[{i}].lowest"][-1] for i in joints])
    return {
        "peak_tension": float(highest.max()) / KILONEWTON,
        "peak_tension_at": float(joints[int(highest.argmax())]),
        "peak_compression": float(-lowest.min()) / KILONEWTON,
        "peak_compression_at": float(joints[int(lowest.argmin())]),
        "rms_coupler_force": float(np.sqrt(np.mean(squares))) / KILONEWTON,
    }


def whole_train_and_energy(run: Run) -> Metrics:
    """Return `whole_train`, the energy account, and what the train did."""
    return whole_train(run) | energy(run) | rolled(run)
