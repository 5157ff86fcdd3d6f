"""What identification found, for a terminal and as data."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .coarse_model import CoarseModel
from .fit import Fit
from .parameters import COARSE_PUBLISHED, Parameter
from .precise_model import PreciseModel, brake_shoe, separate_coefficients
from .report_text import report_text
from .uncertainty import Uncertainty, uncertainty

AT_BOUND = 1e-3  # of the range between the bounds


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One parameter: its value and what that is worth, in the parameter's unit.

    `standard_error` is None for a fixed one and NaN where the logs say nothing; `spread` is the
    standard deviation from run to run, where that was identified.
    """

    parameter: Parameter
    value: float
    standard_error: float | None = None
    spread: float | None = None
    at_bound: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """The fits of the precise and the coarse model, and how far the logs determine them.

    `delays` is T1 + T2 with its standard error (s), which logs tell better than either.
    `separate` is the uncertainty with K1 and K2 in the place of K. `published` is the coarse
    model with the paper's parameters.
    """

    precise: Fit | None
    coarse: Fit | None
    estimates: tuple[Estimate, ...]
    coarse_estimates: tuple[Estimate, ...]
    uncertainty: Uncertainty | None
    separate: Uncertainty | None
    delays: tuple[float, float] | None
    published: Fit | None
    logs: int
    fixed: Mapping[str, float]
    seconds: float

    @property
    def best(self) -> Fit:
        """The precise fit, or the coarse one where there is no other."""
        found = self.precise or self.coarse
        assert found is not None
        return found

    def __str__(self) -> str:
        return report_text(self)

    @property
    def train(self) -> dict[str, float]:
        """The parameters by the plant's names: `Fmu(build(metro_train()), **report.train)`."""
        if self.precise is None:
            assert self.coarse is not None
            return {n: v for n, v in _all(self.coarse).items() if n in ("lag", "mass_ratio")}
        values = _all(self.precise)
        numerator, denominator = brake_shoe(values["air_gain"])
        names = ("electric_coefficient", "electric_lag", "air_delay", "air_lag", "fade_rate",
                 "fade_reference", "changeover_speed", "mass_ratio")  # fmt: skip
        known = {name: values[name] for name in names}
        return {**known, "air_numerator": float(numerator), "air_denominator": float(denominator)}

    @property
    def settings(self) -> dict[str, float]:
        """All as "block.parameter" of the study's loop, for `--set` and `with_values`."""
        blocks = {f"train.{name}": value for name, value in self.train.items()}
        delays = _all(self.best)
        if self.precise is None:
            return {**blocks, "delay.time": delays["delay"]}
        return {
            **blocks,
            "electric_delay.time": delays["electric_delay"],
            "air_delay.time": delays["air_delay"],
        }

    def data(self) -> dict[str, Any]:
        """Return the report as JSON's types; what is not known is null."""
        return _plain(
            {
                "logs": self.logs,
                "brakings": [b.name for b in self.best.model.brakings],
                "samples": len(self.best.model.measured),
                "fixed": dict(self.fixed),
                "seconds": self.seconds,
                "precise": _fit_data(self.precise, self.estimates),
                "coarse": _fit_data(self.coarse, self.coarse_estimates),
                "coarse_published": self.published
                and {"parameters": COARSE_PUBLISHED, "rmse": self.published.rmse},
                "T1+T2": self.delays
                and {"value": self.delays[0], "standard_error": self.delays[1], "unit": "s"},
                "uncertainty": _uncertainty_data(self.uncertainty),
                "with_K1_and_K2": _uncertainty_data(self.separate),
                "settings": self.settings,
                "units": {"rmse": "cm/s", "singular_values": "cm/s", "seconds": "s"},
            }
        )


def judged(
    precise: Fit | None,
    coarse: Fit | None,
    *,
    logs: int,
    fixed: Mapping[str, float],
    seconds: float,
) -> Report:
    """Return the report on fits of the precise or the coarse model, or both."""
    known = separate = delays = None
    estimates: tuple[Estimate, ...] = ()
    if precise is not None:
        known = fit_uncertainty(precise)
        estimates = _estimates(precise, known)
        delays = _delays(precise, known)
        assert isinstance(precise.model, PreciseModel)
        if any(p.name == "air_gain" for p in precise.model.free):
            symbols, size, jacobian = separate_coefficients(precise.model, precise.free)
            errors = precise.model.errors(precise.free)
            separate = uncertainty(symbols, jacobian, errors, size=size)
    simple: tuple[Estimate, ...] = ()
    published = None
    if coarse is not None:
        simple = _estimates(coarse, fit_uncertainty(coarse))
        published = as_published(coarse)
    return Report(
        precise=precise, coarse=coarse, estimates=estimates, coarse_estimates=simple,
        uncertainty=known, separate=separate, delays=delays, published=published, logs=logs,
        fixed=fixed, seconds=seconds,
    )  # fmt: skip


def as_published(coarse: Fit) -> Fit:
    """Return the coarse model with the paper's parameters, on the brakings of a fit."""
    candidates = {p.name for p in coarse.model.candidates}
    known = {n: v for n, v in coarse.model.constants.items() if n not in candidates}
    model = CoarseModel(coarse.model.brakings, fixed=known)
    free = np.array([COARSE_PUBLISHED[p.name] for p in model.free])
    return Fit(
        model=model, method="published", free=free, rmse=model.rmse(free),
        rmse_by_log=model.rmse_by_log(free), evaluations=0, seconds=0.0,
    )  # fmt: skip


def fit_uncertainty(fit: Fit) -> Uncertainty:
    """Return the uncertainty of a fit; its covariance is the mixed effects' where it has one."""
    model = fit.model
    errors, jacobian = model.errors_and_jacobian(fit.free)
    found = uncertainty(
        tuple(p.symbol for p in model.free), jacobian, errors, size=model.size(fit.free),
        log_of_sample=model.log_of_sample,
    )  # fmt: skip
    if fit.runs is None:
        return found
    return Uncertainty(
        symbols=found.symbols, covariance=fit.runs.covariance, correlation=found.correlation,
        singular_values=found.singular_values, directions=found.directions,
        basis=f"mixed effects over {len(model.brakings)} brakings",
    )  # fmt: skip


def _all(fit: Fit) -> dict[str, float]:
    return {name: float(v[0]) for name, v in fit.model.values(fit.free).items()}


def _estimates(fit: Fit, known: Uncertainty) -> tuple[Estimate, ...]:
    low, high = fit.model.bounds
    near = AT_BOUND * (high - low)
    at_bound = (fit.free <= low + near) | (fit.free >= high - near)
    free = {
        p.name: Estimate(
            parameter=p, value=float(fit.free[i]), at_bound=bool(at_bound[i]),
            standard_error=float(known.standard_errors[i]),
            spread=None if fit.runs is None else float(fit.runs.spread[i]),
        )
        for i, p in enumerate(fit.model.free)
    }  # fmt: skip
    held = fit.model.held
    return tuple(
        free.get(p.name, Estimate(parameter=p, value=held.get(p.name, 0.0)))
        for p in fit.model.candidates
        if p.name in free or p.name in held
    )


def _delays(fit: Fit, known: Uncertainty) -> tuple[float, float] | None:
    """Return T1 + T2 and its standard error, if both were identified."""
    places = [i for i, p in enumerate(fit.model.free) if p.symbol in ("T1", "T2")]
    if len(places) < 2:
        return None
    part = known.covariance[np.ix_(places, places)]
    return float(fit.free[places].sum()), float(np.sqrt(part.sum()))


def _fit_data(fit: Fit | None, estimates: tuple[Estimate, ...]) -> dict[str, Any] | None:
    if fit is None:
        return None
    names = [b.name for b in fit.model.brakings]
    return {
        "method": fit.method,
        "seed": fit.seed,
        "evaluations": fit.evaluations,
        "seconds": fit.seconds,
        "rmse": fit.rmse,
        "rmse_by_braking": dict(zip(names, fit.rmse_by_log, strict=True)),
        "noise": None if fit.runs is None else 100.0 * fit.runs.noise,
        "parameters": {
            e.parameter.symbol: {
                "name": e.parameter.name,
                "value": e.value,
                "unit": e.parameter.unit,
                "standard_error": e.standard_error,
                "spread": e.spread,
                "at_bound": e.at_bound,
                "fixed": e.standard_error is None,
            }
            for e in estimates
        },
    }


def _uncertainty_data(known: Uncertainty | None) -> dict[str, Any] | None:
    if known is None:
        return None
    return {
        "symbols": known.symbols,
        "basis": known.basis,
        "covariance": known.covariance,
        "correlation": known.correlation,
        "singular_values": known.singular_values,
        "directions": known.directions.T,
        "lost": known.lost(),
        "correlated": known.correlated(),
    }


def _plain(value: Any) -> Any:
    """Return a value in JSON's types: NaN and infinity become None."""
    if isinstance(value, Mapping):
        return {name: _plain(v) for name, v in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
