"""Identification as a whole: from logs to a report."""

from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import Literal

from .braking import Braking, brakings
from .braking_model import STEP
from .coarse_model import CoarseModel
from .fit import EVALUATIONS, SEARCHES, Fit, fit
from .logs import Log
from .parameters import CONSTANTS, canonical
from .precise_model import PreciseModel
from .report import Report, judged

Model = Literal["precise", "coarse", "both"]
SEARCH_STEP = 0.2  # s; a search's many runs take longer steps, which err by 0.2 cm/s


def identify(
    logs: Sequence[Log],
    *,
    model: Model = "both",
    method: str | None = None,
    fixed: Mapping[str, float] | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
) -> Report:
    """Identify the braking models from logs.

    `method` is one of `METHODS`; by default mixed effects from four brakings on, else least
    squares. `fixed` holds parameters (by symbol or name: "T3", "air_delay") at values, and sets
    what is taken as known (k_bra, mu, V_sw, davis_a, …). `evaluations` and `seed` are for the
    searches without derivatives. Raise FileError for logs without a braking to a stop and
    ParameterError for wrong options.
    """
    began = perf_counter()
    values = canonical(fixed or {})
    found = brakings(logs)
    precise = coarse = None
    if model in ("precise", "both"):
        precise = _fit(PreciseModel, found, values, method, evaluations, seed)
    if model in ("coarse", "both"):
        simple = "least_squares" if method == "mixed_effects" else method
        coarse = _fit(CoarseModel, found, values, simple, evaluations, seed)
    return judged(precise, coarse, logs=len(logs), fixed=values, seconds=perf_counter() - began)


def _fit(
    kind: type[PreciseModel] | type[CoarseModel],
    found: Sequence[Braking],
    values: Mapping[str, float],
    method: str | None,
    evaluations: int,
    seed: int,
) -> Fit:
    """Fit one model, with those of the fixed values that it knows."""
    names = {p.name for p in kind.candidates} | set(CONSTANTS)
    fixed = {name: value for name, value in values.items() if name in names}
    made = kind(found, fixed=fixed, step=SEARCH_STEP if method in SEARCHES else STEP)
    return fit(made, method=method, evaluations=evaluations, seed=seed)
