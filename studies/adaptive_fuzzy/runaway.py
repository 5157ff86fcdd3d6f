"""A controller that runs away, with and without ATP, over many trains."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...controllers import PID
from ...cosim import Run
from ...cosim.campaign import Drawn
from ...cosim.scenario import Override, Scenario
from ..case import Case
from ..ensemble import Ensemble
from ..metrics import Metrics
from .controllers import PID_ZN
from .line import line
from .pattern import rises

if TYPE_CHECKING:
    import pandas as pd

RUNS, SEED = 1000, 20
STEP = 0.1  # s, also the ATP's period
STOP = 60.0  # s
LATEST = 40.0  # s, when the fault comes at the latest
FULL_TRACTION = 10.0  # notches

CONTROLLER = PID(kp=PID_ZN.kp, ti=PID_ZN.ti, td=PID_ZN.td, period=STEP)
UNITS = {
    "train.mass": "kg",
    "train.adhesion": "1",
    "train.brake_lag": "s",
    "link.time": "s",
    "fault_time": "s",
}


def draw(generator: np.random.Generator) -> Drawn:
    """Return a train's mass ±15 %, adhesion, brake lag, the brake's delay, and the fault's time."""
    return {
        "train.mass": generator.uniform(0.85, 1.15) * 12800.0,
        "train.adhesion": generator.uniform(0.09, 0.2),
        "train.brake_lag": generator.uniform(0.3, 0.5),
        "link.time": generator.uniform(0.2, 0.8),
        "fault_time": STEP * math.floor(generator.uniform(0.0, LATEST) / STEP),
    }


def fault(drawn: Drawn) -> Scenario:
    """Return the fault: from its time on the controller demands full traction."""
    return Scenario([Override("controller.u", FULL_TRACTION, at=drawn["fault_time"])])


def measure(run: Run) -> Metrics:
    """Return the least margin to the limit curve at any step of the run, and what the ATP did."""
    emergency = np.nonzero(run["atp.emergency"] > 0.5)[0]
    return {
        "least_margin": float(np.min(run["atp.margin"])),
        "emergency_at": float(run.time[emergency[0]]) if len(emergency) else None,
        "emergencies": rises(run["atp.emergency"]),
        "end_speed": float(run["train.speed"][-1]),
        "end_position": float(run["train.position"][-1]),
    }


def summarise(samples: "pd.DataFrame") -> Metrics:
    """Return how many runs passed the limit curve, by how much, and how many were stopped."""
    margin = samples["least_margin"].to_numpy(dtype=float)
    return {
        "runs": float(len(samples)),
        "violations": float(np.count_nonzero(margin < 0.0)),
        "least_margin": float(np.min(margin)),
        "mean_least_margin": float(np.mean(margin)),
        "emergencies": float(np.count_nonzero(samples["emergencies"] > 0)),
        "standing": float(np.count_nonzero(samples["end_speed"] == 0.0)),
    }


def cases(fmu: Path) -> list[Case]:
    """Return the two ensembles."""
    return [
        Ensemble(
            "runaway",
            name,
            line("runaway", CONTROLLER, fmu, step=STEP, protected=protected),
            STOP,
            measure,
            record=(
                "train.speed", "train.position", "controller.u", "pattern.target",
                "atp.limit", "atp.margin", "atp.emergency", "atp.service",
            ),
            own=tuple(UNITS),
            draws=draw,
            summarise=summarise,
            scenario=fault,
            runs=RUNS,
            seed=SEED,
            units=UNITS,
        )
        for name, protected in (("atp", True), ("no_atp", False))
    ]  # fmt: skip
