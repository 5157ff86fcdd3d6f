"""Fitting a braking model to logs by one of the methods."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...base.errors import ParameterError, listing, suggest
from .braking_model import CENTIMETRES, BrakingModel
from .differential_evolution import differential_evolution
from .fruit_fly import fruit_fly
from .improved_fruit_fly import improved_fruit_fly
from .least_squares import least_squares
from .mixed_effects import FEWEST, MixedEffects, mixed_effects

SEARCHES = {
    "fruit_fly": fruit_fly,
    "improved_fruit_fly": improved_fruit_fly,
    "differential_evolution": differential_evolution,
}
METHODS = ("mixed_effects", "least_squares", *SEARCHES)
EVALUATIONS = 600  # of a search without derivatives


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A model's parameters as a method found them.

    `free` are those identified, in the model's order. `rmse` and `rmse_by_log` in cm/s are over
    the samples of all brakings and of each (precise braking paper, eq. 12), with the same
    parameters in all. `evaluations` counts how often all logs were run; `seconds` the time taken.
    `history` holds (evaluations, best rmse) on the way. `runs` tells how runs differ.
    """

    model: BrakingModel
    method: str
    free: np.ndarray
    rmse: float
    rmse_by_log: np.ndarray
    evaluations: int
    seconds: float
    seed: int | None = None
    history: tuple[tuple[int, float], ...] = ()
    runs: MixedEffects | None = None

    @property
    def values(self) -> dict[str, float]:
        """The parameters identified, by name."""
        return {p.name: float(v) for p, v in zip(self.model.free, self.free, strict=True)}


def default_method(model: BrakingModel) -> str:
    """Return the method for a model and so many brakings.

    Mixed effects where runs can be told apart, and least squares for the coarse model, whose
    errors are not the runs'.
    """
    enough = model.name == "precise" and len(model.brakings) >= FEWEST
    return "mixed_effects" if enough else "least_squares"


def fit(
    model: BrakingModel,
    *,
    method: str | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
) -> Fit:
    """Fit a model to its brakings; `evaluations` and `seed` are the searches'.

    Raise ParameterError for an unknown method, and where nothing is left to be identified.
    """
    method = default_method(model) if method is None else method
    if method not in METHODS:
        raise ParameterError(
            f"no method '{method}'; methods: {listing(METHODS)}{suggest(method, METHODS)}"
        )
    if not model.free:
        raise ParameterError(f"all parameters of the {model.name} model are fixed; free one")
    if evaluations < 1:
        raise ParameterError(f"evaluations must be a whole number from 1, not {evaluations!r}")
    began = perf_counter()
    low, high = model.bounds
    runs, point, count, history = None, model.start, 0, ()
    if method in SEARCHES:
        found = SEARCHES[method](model.rmse, low, high, evaluations=evaluations, seed=seed)
        point, count, history = found.point, found.evaluations, found.history
    elif method == "least_squares":
        found = least_squares(model.errors_and_jacobian, low, high, start=model.start)
        point, count = found.point, found.evaluations
        history = tuple((n, CENTIMETRES * value) for n, value in found.history)
    else:
        if len(model.brakings) < FEWEST:
            raise ParameterError(
                f"mixed_effects needs {FEWEST} brakings or more, there are {len(model.brakings)}; "
                "use --method least_squares"
            )
        runs = mixed_effects(
            model.errors_and_jacobian, low, high, start=model.start,
            run_of_sample=model.log_of_sample,
        )  # fmt: skip
        point, count = runs.mean, runs.evaluations
    seconds = perf_counter() - began
    return Fit(
        model=model, method=method, free=point, rmse=model.rmse(point),
        rmse_by_log=model.rmse_by_log(point), evaluations=count, seconds=seconds,
        seed=seed if method in SEARCHES else None, history=history, runs=runs,
    )  # fmt: skip
