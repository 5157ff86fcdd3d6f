"""Experiment 4 and ours as campaigns: stops under spread, limits, real odometry, and learning."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...controllers.odometry import Odometry
from ...cosim import Run
from ...cosim.campaign import Drawn, Rows
from ..case import Case
from ..ensemble import Ensemble
from ..metrics import Metrics
from .controllers import maker
from .loop import START, braking_loop
from .stations import STATIONS, nominal
from .stops import (
    AIR,
    ELECTRIC,
    LONGEST,
    Make,
    cheap,
    learning_chain,
    metrics,
    one_stop,
    predictive,
    probing,
    revealed_stop,
)

if TYPE_CHECKING:
    import pandas as pd

STATION = {"station": list(range(len(STATIONS)))}
SEED = 20241  # never used for tuning
SCALES = {"full": 1.0, "half": 0.5, "quarter": 0.25}
STOPS, MANY = 100, 1000  # a station; many of the controller that the paper's claim is judged by
CHAINS, CHAIN = 2, 40  # a station, and the stops of each
SETTLED = 20  # stops, after which a chain counts as learned
BALISES = (120.0, 20.0, 5.0)  # m before the mark
WHEEL = 0.007  # sd of the wheel's scale
CENTIMETRE_BOUNDS = (8.0, 30.0, 50.0)
UNITS = {
    "station": "1", "stop": "1", "stopped": "1",
    **{f"true_{name}": unit for name, unit in (
        ("electric_delay", "s"), ("electric_lag", "s"), ("electric_coefficient", "1"),
        ("mass_ratio", "1"), ("air_delay", "s"), ("air_lag", "s"), ("air_gain", "m/s2"),
        ("changeover_speed", "m/s"), ("fade_rate", "m/s3"), ("davis", "1"),
        ("approach", "1"), ("platform", "1"), ("speed", "m/s"), ("position", "m"),
    )},
}  # fmt: skip


def summarise(samples: "pd.DataFrame") -> Metrics:
    """Return how stops scatter, what they cost, and how many there were."""
    errors = samples["stop_error"].to_numpy(dtype=float)
    size = np.abs(errors)
    travel = samples["command_travel"].to_numpy(dtype=float)
    within = {
        f"within_{bound:g}_cm": 100.0 * float(np.mean(size <= bound)) for bound in CENTIMETRE_BOUNDS
    }
    return {
        "stops": float(len(samples)),
        "mean_stop_error": float(np.mean(errors)),
        "sd_stop_error": float(np.std(errors, ddof=1)),
        "p95_stop_error": float(np.quantile(size, 0.95)),
        "p99_stop_error": float(np.quantile(size, 0.99)),
        "largest_stop_error": float(np.max(size)),
        **within,
        "command_travel": float(np.mean(travel)),
        "max_jerk": float(np.mean(samples["max_jerk"].to_numpy(dtype=float))),
    }


def summarise_learned(samples: "pd.DataFrame") -> Metrics:
    """Return the same of the stops after the first `SETTLED` of each chain."""
    return summarise(samples.loc[samples["stop"] >= SETTLED])


def stop_work(case: Ensemble, drawn: Drawn, generator: np.random.Generator, **options: Any) -> Rows:
    """Return one stop's row."""
    row = one_stop(drawn, generator, **options)
    return {name: value for name, value in row.items() if name != "station"}


def reveal_work(
    case: Ensemble, drawn: Drawn, generator: np.random.Generator, **options: Any
) -> Rows:
    """Return the row of one stop of an oracle that is told of the air brake at its onset."""
    return revealed_stop(drawn, generator, **options)


def chain_work(
    case: Ensemble, drawn: Drawn, generator: np.random.Generator, **options: Any
) -> Rows:
    """Return a chain's rows."""
    rows = learning_chain(drawn, generator, stops=CHAIN, **options)
    return [{name: v for name, v in row.items() if name != "station"} for row in rows]


def cases() -> list[Case]:
    """Return all campaigns of the study."""
    return [*_paper(), *_ours(), *_limits(), *_learned()]


def _paper() -> list[Case]:
    """Return the paper's line: the literal loop, then prediction, then the observer."""
    others = (
        "smarc_m0", "smc_m0", "pid_m0", "smarc_m1", "smarc_m2", "smc_m2", "smc_dob_m2",
        "pid_position_m2",
    )  # fmt: skip
    found: list[Case] = [_stops("spread_full", name, maker(name)) for name in others]
    found.append(_stops("spread_full", "smarc_dob_m2", maker("smarc_dob_m2"), runs=MANY))
    for size in ("half", "quarter"):
        make, share = maker("smarc_dob_m2"), SCALES[size]
        found.append(_stops(f"spread_{size}", "smarc_dob_m2", make, spread=share))
    return found


def _ours() -> list[Case]:
    """Return first stops by prediction, its variants, and with real odometry."""
    soft = partial(predictive, soft=True)
    wheel = partial(predictive, scale=WHEEL, balises=BALISES)
    return [
        _stops("spread_full", "predictive_v6", predictive),
        _stops("spread_full", "predictive_v3", predictive, train="v3"),
        _stops("spread_full", "predictive_probe_v6", probing),
        _stops("spread_full", "predictive_soft_v6", soft),
        _stops("spread_full", "cheap_v6", cheap),
        _stops("odometry", "predictive_v6", wheel, scale=WHEEL, balises=BALISES),
    ]


def _limits() -> list[Case]:
    """Return what the predictive stop reaches that is told more than a train can know."""
    work = partial(reveal_work, train="v6")
    return [
        _stops("limits", "knows_all", predictive, known=(*ELECTRIC, *AIR)),
        _stops("limits", "knows_all_but_air", predictive, known=ELECTRIC),
        _ensemble("limits", "knows_air_at_onset", runs=STOPS, work=work, train="v6"),
    ]


def _learned() -> list[Case]:
    """Return chains of stops that learn, by the whole estimate or by the cheap variant's trim."""
    ways = {"predictive": "learning", "cheap": "trim"}
    return [
        _ensemble(
            f"learned_{drift}", f"{name}_{train}", runs=CHAINS, train=train,
            work=partial(chain_work, train=train, drift=drift, way=ways[name]),
            summarise=summarise_learned,
        )
        for name, train in (("predictive", "v6"), ("predictive", "v3"), ("cheap", "v6"))
        for drift in ("benign", "harsh")
    ]  # fmt: skip


def _stops(
    experiment: str, name: str, make: Make, *, runs: int = STOPS, train: str = "v6", **options: Any
) -> Ensemble:
    work = partial(stop_work, make=make, train=train, **options)
    return _ensemble(experiment, name, runs=runs, work=work, train=train)


def _ensemble(
    experiment: str,
    name: str,
    *,
    runs: int,
    train: str,
    work: Callable[..., Rows],
    summarise: "Callable[[pd.DataFrame], Metrics]" = summarise,
) -> Ensemble:
    known = nominal(train, 0)
    diagram = braking_loop(known, predictive(known), Odometry(), start=START)
    own = tuple(f"{b}.{p}" for b, block in diagram.blocks.items() for p in block.parameters())
    return Ensemble(
        experiment, name, diagram, LONGEST, _measured, own=own, draws=STATION, runs=runs,
        seed=SEED, work=work, units=UNITS, summarise=summarise,
    )  # fmt: skip


def _measured(run: Run) -> Metrics:
    return dict(metrics(run))
