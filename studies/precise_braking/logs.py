"""Synthetic logs of train operation: what an operator would have recorded, with a known truth."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...controllers.odometry import Odometry
from ...cosim import Run
from ..identification.logs import Log
from .ato import PlainATO
from .loop import PERIOD, braking_loop
from .stations import STATIONS
from .truth import PLATFORM, V12, Truth

if TYPE_CHECKING:
    import pandas as pd

ROUNDS = 8  # in both directions: 16 logs, as the precise braking paper has
NOISE = 0.03  # m/s, of the measured speed
SEED = 20230603
START = -250.0  # m: some seconds of cruising, then the braking
STOP = 50.0  # s
TRAIN_LENGTH = 118.0  # m
# Half-widths of the uniform distributions from run to run, as shares of the value; our choice
SPREAD = {
    "electric_coefficient": 0.039,
    "mass_ratio": 0.039,
    "air_gain": 0.065,
    "electric_delay": 0.033,
    "electric_lag": 0.033,
    "air_delay": 0.033,
    "air_lag": 0.033,
}


@dataclass(frozen=True, kw_only=True, eq=False)
class SyntheticLog:
    """A log and the truth that it was made with."""

    log: Log
    truth: Truth
    run: Run = field(repr=False)


def truths(
    *, seed: int = SEED, nominal: Truth = V12, rounds: int = ROUNDS, independent: bool = False
) -> list[Truth]:
    """Return the trains of `rounds` rounds, there and back, in the order in which they run.

    The numbers are uniform within SPREAD. They are drawn as a Latin hypercube: each sixteenth of
    each range once, so that few logs have the mean of many; `independent` draws them freely.
    Round k ends at the k-th station of the paper's table 3; back, its gradients are negated.
    """
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    count = 2 * rounds
    if independent:
        unit = generator.random((count, len(SPREAD)))
    else:
        unit = qmc.LatinHypercube(len(SPREAD), rng=generator).random(count)
    found = []
    for i, row in enumerate(unit):
        station, sign = STATIONS[(i // 2) % len(STATIONS)], -1.0 if i % 2 else 1.0
        drawn = {
            name: getattr(nominal, name) * (1.0 + half * (2.0 * float(u) - 1.0))
            for (name, half), u in zip(SPREAD.items(), row, strict=True)
        }
        gradients = {"approach": sign * station.approach, "platform": sign * station.platform}
        found.append(replace(nominal, **drawn, **gradients))
    return found


def synthetic_log(truth: Truth, *, name: str, seed: int, noise: float = NOISE) -> SyntheticLog:
    """Return the log of one stop: time, command, measured speed, air brake, gradient.

    The gradient is the mean under the train's length where it truly is.
    """
    odometry = Odometry(position_noise=0.0, speed_noise=noise, seed=seed, period=PERIOD)
    controller = PlainATO(
        cruise=truth.speed, hold=truth.cruising, resistance=truth.resistance(7.0, truth.approach)
    )
    loop = braking_loop(truth, controller, odometry, start=START)
    names = ("controller.command", "odometry.speed", "train.air_brake_on", "train.position",
             "train.speed", "train.changeover_time")  # fmt: skip
    run = loop.run(STOP, record=list(names), progress=False)
    every = round(PERIOD / (run.time[1] - run.time[0]))
    position = run["train.position"][::every]
    on_platform = np.clip((position + PLATFORM) / TRAIN_LENGTH, 0.0, 1.0)
    log = Log(
        name=name,
        time=run.time[::every],
        command=run["controller.command"][::every],
        speed=run["odometry.speed"][::every],
        air_brake=run["train.air_brake_on"][::every] > 0.5,
        gradient=truth.approach + (truth.platform - truth.approach) * on_platform,
    )
    return SyntheticLog(log=log, truth=truth, run=run)


@lru_cache(maxsize=8)
def synthetic_logs(
    *, seed: int = SEED, rounds: int = ROUNDS, noise: float = NOISE, independent: bool = False
) -> tuple[SyntheticLog, ...]:
    """Return the logs of `rounds` rounds there and back; the same seed gives the same logs."""
    return tuple(
        synthetic_log(
            truth, name=f"round{1 + i // 2}-{'back' if i % 2 else 'out'}", seed=1000 * seed + i,
            noise=noise,
        )
        for i, truth in enumerate(truths(seed=seed, rounds=rounds, independent=independent))
    )  # fmt: skip


def table(logs: Iterable[Log]) -> "pd.DataFrame":
    """Return logs as one table, as `railcosim identify` reads it; `run` names them."""
    import pandas as pd

    return pd.concat(
        [
            pd.DataFrame(
                {
                    "run": log.name,
                    "time [s]": log.time,
                    "command [m/s2]": log.command,
                    "speed [m/s]": log.speed,
                    **({} if log.air_brake is None else {"air_brake": log.air_brake.astype(int)}),
                    **({} if log.gradient is None else {"gradient [‰]": log.gradient}),
                }
            )
            for log in logs
        ],
        ignore_index=True,
    )


def write_logs(folder: Path, logs: Sequence[SyntheticLog]) -> list[Path]:
    """Write each log as a CSV file and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for made in logs:
        path = folder / f"{made.log.name}.csv"
        table([made.log]).drop(columns="run").to_csv(path, index=False, float_format="%.6g")
        paths.append(path)
    return paths
