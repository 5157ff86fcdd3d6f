"""The pattern of Fig. 1: one regulation step, then the stopping curve, under ATP."""

from pathlib import Path

import numpy as np

from ...cosim import Run
from ..case import Case
from ..comfort import comfort, ride_to_standstill
from ..metrics import Metrics
from .controllers import LINE_UP, PERIOD
from .line import MARK, line

STOP = 90.0  # s
SWING = 0.2  # notches


def measure(run: Run) -> Metrics:
    """Return where and when the train stopped, how near it came to the ATP, and its comfort.

    Comfort is that of the ride up to the standstill.
    """
    ride = ride_to_standstill(run["train.standstill"])
    rows = slice(None) if ride is None else ride
    place = float(run["train.position"][-1])
    return {
        "stop_error": None if ride is None else 100.0 * (place - MARK),
        "running_time": None if ride is None else float(run.time[ride][-1]),
        "least_margin": float(np.min(run["atp.margin"][rows])),
        "warnings": rises(run["atp.warning"]),
        "interventions": rises(run["atp.service"]) + rises(run["atp.emergency"]),
    } | comfort(
        run.time[rows], run["train.acceleration"][rows], run["controller.u"][rows], swing=SWING
    )


def rises(flag: np.ndarray) -> float:
    """Return how often a flag comes up, at the start included."""
    up = flag > 0.5
    return float(np.count_nonzero(up[1:] & ~up[:-1]) + int(up[0]))


def cases(suffix: str, fmu: Path) -> list[Case]:
    """Return the pattern under every controller, on one plant."""
    return [
        Case(
            f"pattern{suffix}",
            name,
            line("pattern", controller, fmu, step=PERIOD),
            STOP,
            measure,
            own=("train.speed",),
        )
        for name, controller in LINE_UP.items()
    ]
