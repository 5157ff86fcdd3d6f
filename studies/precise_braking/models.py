"""Experiments 1 and 2 as cases: the models against logs, and how to identify them."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ...cosim import Run
from ..case import Case
from ..computed import Computed, Rows
from ..identification.uncertainty import Uncertainty
from .identify import MODELS, Fidelity, computing_time, fidelity, methods, target
from .logs import SEED, synthetic_logs

if TYPE_CHECKING:
    from ..identification.report import Report

SEARCH_SEED = 0
SYMBOLS = ("T1", "T2", "P1", "T3", "T4", "K")


@cache
def identified() -> Fidelity:
    """Return experiment 1 on the study's own logs."""
    return fidelity(synthetic_logs(seed=SEED), seed=SEED)


def cases() -> list[Case]:
    """Return the experiments."""
    seeds = {"logs": SEED}
    return [
        Computed.of("fidelity", _fidelity, seeds),
        Computed.of("identification", _methods, {**seeds, "search": SEARCH_SEED}),
        Computed.of("identifiability", _identifiable, seeds),
    ]


def _fidelity() -> Rows:
    """Return speed errors and times of each model; the trace is the first log's."""
    found = identified()
    times = computing_time(found.report)
    alone = {"precise": times.precise, "coarse": times.coarse}
    loops = {"precise": times.precise_loop, "coarse": times.coarse_loop}
    return {
        name: (
            {
                "rms_speed_error": found.rmse[name],
                "rms_speed_error_fast": found.fast[name],
                "rms_speed_error_slow": found.slow[name],
                "worst_log": float(np.max(found.by_log[name].to_numpy())),
                "model_time": alone.get(name),
                "loop_time": loops.get(name),
            },
            _first_log(found.report, name),
        )
        for name in MODELS
        if name in found.rmse
    }


def _first_log(report: "Report", name: str) -> Run:
    """Return the first log's speed beside the model's, from some seconds before the braking."""
    fits = (report.precise, report.published, report.coarse)
    fit = fits[MODELS.index(name)]
    assert fit is not None
    braking = fit.model.brakings[0]
    return Run(
        f"fidelity-{name}",
        np.asarray(braking.time, dtype=float),
        np.column_stack([braking.speed, fit.model.trajectory(fit.free, 0)]),
        ("log.speed", "model.speed"),
        {"log.speed": "m/s", "model.speed": "m/s"},
    )


def _methods() -> Rows:
    """Return a row for each method, and one for the mean of the logs' trains."""
    logs = synthetic_logs(seed=SEED)
    table = methods(logs, search_seeds=(SEARCH_SEED,)).reset_index().to_dict("records")
    rows: dict[str, tuple[dict[str, float | None], None]] = {
        str(found["method"]): (
            {
                "rms_speed_error": float(found["rmse"]),
                "coefficient_error": float(found["coefficient_error"]),
                "delay_error": float(found["delay_error"]),
                "evaluations": float(found["evaluations"]),
                "fit_time": float(found["seconds"]),
                **{f"identified_{s.lower()}": float(found[s]) for s in SYMBOLS},
            },
            None,
        )
        for found in table
    }
    wanted = target(logs)
    rows["truth"] = (
        {
            **dict.fromkeys(next(iter(rows.values()))[0]),
            "identified_t1": wanted.electric_delay,
            "identified_t2": wanted.electric_lag,
            "identified_p1": wanted.coefficient,
            "identified_t3": wanted.air_delay,
            "identified_t4": wanted.air_lag,
            "identified_k": wanted.gain,
        },
        None,
    )
    return rows


def _identifiable() -> Rows:
    """Return how far the logs determine the six parameters, and those with K1 and K2 for K."""
    report = identified().report
    found = {"k": report.uncertainty, "k1_and_k2": report.separate}
    return {
        name: (
            {
                "largest_singular_value": float(known.singular_values[0]),
                "least_singular_value": float(known.singular_values[-1]),
                "lost_directions": float(len(known.lost())),
                "correlation_t4_k": _correlation(known, "T4", "K"),
                "correlation_t1_t2": _correlation(known, "T1", "T2"),
            },
            None,
        )
        for name, known in found.items()
        if known is not None
    }


def _correlation(known: Uncertainty, one: str, other: str) -> float | None:
    if one not in known.symbols or other not in known.symbols:
        return None
    return float(known.correlation[known.symbols.index(one), known.symbols.index(other)])
