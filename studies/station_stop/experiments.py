"""300 stops of each controller: on the predicted stop error, and on the raw error (negative)."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...controllers.stop_prediction import StopPrediction
from ...cosim import Block, Constant, Diagram, Fmu, Gain, Run, Sum
from ...cosim.campaign import Drawn
from ...fmus import build
from ...models import stopping_train
from ..case import Case
from ..comfort import comfort, ride_to_standstill
from ..ensemble import Ensemble, spread
from ..metrics import Metrics
from .controllers import LINE_UP, PERIOD, RAW, RAW_PERIOD

if TYPE_CHECKING:
    import pandas as pd

RUNS, SEED = 300, 4
STOP = 20.0  # s
PLANNED = 0.8  # m/s², braking that the prediction counts on
AUTHORITY = 0.4  # m/s², what the table adds or takes at its ends
RAW_AUTHORITY = 0.5  # m/s², traction or brake at the table's ends in the raw-error case
WITHIN = 10.0  # cm, the paper's range of the error
SWING = 3.6  # cm, 1 % of the range of u: a smaller turn of it is no reversal

UNITS = {"train.speed": "m/s", "train.position": "m", "train.lag": "s",
         "train.effectiveness": "1", "train.drag": "m/s2"}  # fmt: skip


def _loop(name: str, error: Block, controller: Block, fmu: Path, *, step: float) -> Diagram:
    """Return a diagram with everything but what makes a demand of the table's level."""
    loop = Diagram(name, step=step)
    loop.add("error", error)
    loop.add("controller", controller)
    loop.add("train", Fmu(fmu, emergency=0.0))
    if "error" in controller.inputs:
        loop.connect(f"error.{next(iter(error.outputs))}", "controller.error")
    if "speed" in controller.inputs:
        loop.connect("train.speed", "controller.speed")
    return loop


def main_case(controller: Block, fmu: Path) -> Diagram:
    """Return the main case: demand −0.8 + 0.4·U/6 m/s², on the predicted stop error."""
    prediction = StopPrediction(braking=PLANNED, period=PERIOD)
    loop = _loop("stop", prediction, controller, fmu, step=PERIOD)
    loop.add("planned", Constant(-PLANNED, unit="m/s2"))
    loop.add("authority", Gain(AUTHORITY / 6.0, input_unit="1", unit="m/s2"))
    loop.add("demand", Sum("++"))
    for source, target in (
        ("train.position", "error.position"),
        ("train.speed", "error.speed"),
        ("controller.level", "authority.u"),
        ("planned.y", "demand.u1"),
        ("authority.y", "demand.u2"),
        ("demand.y", "train.demand"),
    ):
        loop.connect(source, target)
    return loop.with_values({"train.effort": -PLANNED})


def raw_case(controller: Block, fmu: Path) -> Diagram:
    """Return the raw-error case: demand 0.5·U/6 m/s², on mark − position."""
    error = Gain(-100.0, input_unit="m", unit="cm")
    loop = _loop("raw", error, controller, fmu, step=RAW_PERIOD)
    loop.add("authority", Gain(RAW_AUTHORITY / 6.0, input_unit="1", unit="m/s2"))
    loop.connect("train.position", "error.u")
    loop.connect("controller.level", "authority.u")
    loop.connect("authority.y", "train.demand")
    return loop


def draw_main(generator: np.random.Generator) -> Drawn:
    """Return speed and place where braking begins, lag, and brake force ±10 % (ours)."""
    speed = generator.uniform(4.0, 8.0)
    return {
        "train.speed": speed,
        "train.position": -speed * speed / (2.0 * PLANNED) + generator.uniform(-0.5, 0.5),
        "train.lag": generator.uniform(0.2, 0.5),
        "train.effectiveness": generator.uniform(0.9, 1.1),
    }


def draw_raw(generator: np.random.Generator) -> Drawn:
    """Return place and speed of a train that creeps towards the mark, lag and drag (ours)."""
    return {
        "train.position": -generator.uniform(0.08, 0.6),
        "train.speed": generator.uniform(0.1, 0.6),
        "train.lag": generator.uniform(0.1, 0.3),
        "train.drag": generator.uniform(0.0, 0.03),
    }


def measure(run: Run) -> Metrics:
    """Return a stop's error, its time, its comfort, and the travel of the control.

    `stop_jolt` is the acceleration that ends with the standstill.
    """
    ride = ride_to_standstill(run["train.standstill"])
    rows = slice(None) if ride is None else ride
    control, acceleration = run["controller.u"][rows], run["train.acceleration"][rows]
    return {
        "stop_error": None if ride is None else 100.0 * float(run["train.position"][-1]),
        "running_time": None if ride is None else float(run.time[ride][-1]),
        "control_travel": float(np.sum(np.abs(np.diff(control)))),
        "stop_jolt": None if ride is None else float(abs(acceleration[-2])),
    } | comfort(run.time[rows], acceleration, control, swing=SWING)


def summarise(samples: "pd.DataFrame") -> Metrics:
    """Return the spread of the stop error, and the means of the rest over all stops."""
    errors = samples["stop_error"].to_numpy(dtype=float)
    means = (
        "running_time", "control_reversals", "control_travel", "max_acceleration",
        "rms_acceleration", "max_jerk", "rms_jerk", "stop_jolt",
    )  # fmt: skip
    return {
        "runs": float(len(samples)),
        **spread(samples, "stop_error"),
        "within_10_cm": 100.0 * float(np.mean(np.abs(errors) <= WITHIN)),
        **{name: float(np.mean(samples[name].to_numpy())) for name in means},
    }


def cases() -> list[Case]:
    """Return every ensemble of the study; builds the train's FMU."""
    fmu = build(stopping_train())
    found: list[Case] = []
    for name, controller in LINE_UP.items():
        found.append(_stops("stop", name, main_case(controller, fmu), draw_main))
    for name, controller in RAW.items():
        found.append(_stops("raw_error", name, raw_case(controller, fmu), draw_raw))
    return found


def _stops(
    experiment: str, name: str, diagram: Diagram, draw: Callable[[np.random.Generator], Drawn]
) -> Ensemble:
    drawn = tuple(draw(np.random.default_rng(0)))
    return Ensemble(
        experiment,
        name,
        diagram,
        STOP,
        measure,
        own=(*drawn, "train.emergency", "train.effort"),
        draws=draw,
        summarise=summarise,
        runs=RUNS,
        seed=SEED,
        units=UNITS,
    )
