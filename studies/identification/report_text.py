"""A report in words and columns, for a terminal."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from .parameters import COARSE_PUBLISHED
from .precise_model import PreciseModel

if TYPE_CHECKING:
    from .fit import Fit
    from .report import Estimate, Report
    from .uncertainty import Uncertainty

PAPER = (25.8, 117.3)  # cm/s; the precise braking paper, table 2
COLUMNS = f"  {'':36}{'value':>10}  {'unit':5}{'std. error':>12}{'run to run':>12}"


def report_text(report: "Report") -> str:
    """Return the report as text."""
    model = report.best.model
    lines = [
        f"{_count(len(model.brakings), 'braking')} to a stop in {_count(report.logs, 'log')}, "
        f"{len(model.measured)} samples; {report.seconds:.1f} s"
    ]
    if report.precise is not None:
        lines += ["", *_precise(report, report.precise)]
    if report.coarse is not None:
        lines += ["", *_fit("Coarse model", report.coarse), COLUMNS]
        lines += [_estimate(e) for e in report.coarse_estimates]
    lines += ["", *_errors(report)]
    if report.uncertainty is not None:
        lines += ["", *_determined(report, report.uncertainty)]
    lines += ["", "For the study's loop (and train.… for Fmu(…)):"]
    words = [f"--set {name}={value:.5g}" for name, value in report.settings.items()]
    lines += ["  " + "  ".join(words[i : i + 2]) for i in range(0, len(words), 2)]
    return "\n".join(lines)


def _fit(title: str, fit: "Fit") -> Iterator[str]:
    seed = "" if fit.seed is None else f", seed {fit.seed}"
    kind = "evaluations" if fit.seed is not None else "evaluations with sensitivities"
    yield (
        f"{title}, by {fit.method.replace('_', ' ')}: {fit.evaluations} {kind}, "
        f"{fit.seconds:.1f} s{seed}"
    )


def _precise(report: "Report", fit: "Fit") -> Iterator[str]:
    yield from _fit("Precise model", fit)
    model = fit.model
    assert isinstance(model, PreciseModel)
    source = "the logs' flag" if model.flagged else "T3 after the measured speed has passed V_sw"
    yield f"  The air brake comes on by {source}."
    yield COLUMNS
    yield from (_estimate(e) for e in report.estimates)
    if report.delays is not None:
        value, error = report.delays
        yield f"  {'T1 + T2':36}{value:10.3f}  {'s':5}{_number(error):>12}"
    assert report.uncertainty is not None
    yield f"  Standard errors from {report.uncertainty.basis}. P1 and K: those over the mass ratio."
    if fit.runs is not None:
        yield f"  Noise of the measured speed: {100.0 * fit.runs.noise:.1f} cm/s."
        if not fit.runs.settled:
            yield "  The mixed effects have not settled: take the figures with care."
    bounds = [e.parameter.symbol for e in report.estimates if e.at_bound]
    if bounds:
        yield f"  At the bound of its range, so not found: {', '.join(bounds)}. Fix it (--fix)."


def _estimate(estimate: "Estimate") -> str:
    p = estimate.parameter
    head = f"  {p.symbol:5}{p.meaning:31}{estimate.value:10.4g}  {p.unit:5}"
    if estimate.standard_error is None:
        return f"{head}{'fixed':>12}"
    return f"{head}{_number(estimate.standard_error):>12}{_number(estimate.spread):>12}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return "unknown" if np.isnan(value) else f"{value:.2g}"


def _errors(report: "Report") -> Iterator[str]:
    yield "Speed error, root mean square over all samples (eq. 12)"
    delay, lag = COARSE_PUBLISHED["delay"], COARSE_PUBLISHED["lag"]
    rows = [
        ("precise model", report.precise),
        ("coarse model, fitted", report.coarse),
        (f"coarse model as used, {delay:g} and {lag:g} s", report.published),
    ]
    for title, fit in rows:
        if fit is not None:
            worst = int(np.argmax(fit.rmse_by_log))
            each = f"{fit.rmse_by_log.min():.1f} to {fit.rmse_by_log.max():.1f}"
            name = fit.model.brakings[worst].name
            several = f"   {each}, the most in {name}" if len(fit.rmse_by_log) > 1 else ""
            yield f"  {title:36}{fit.rmse:10.1f}  cm/s{several}"
    yield f"  The paper, on its logs: precise {PAPER[0]:g}, existing {PAPER[1]:g} cm/s."


def _determined(report: "Report", known: "Uncertainty") -> Iterator[str]:
    yield "How far the logs determine the parameters"
    shown = report.separate or known
    yield "  Change of the speed (cm/s) along each direction of relative change of the parameters:"
    for i, value in enumerate(shown.singular_values):
        note = "   changes nothing" if value <= 1e-9 * shown.singular_values[0] else ""
        yield f"  {value:12.4g}   {shown.direction(i)}{note}"
    yield "  Not identifiable:"
    lost = shown.lost()
    if report.separate is not None and lost:
        least = shown.singular_values[-1] / shown.singular_values[0]
        yield (
            f"    K1 and K2 separately: their singular value is {least:.0e} of the largest; only "
            "K = K1/K2 acts"
        )
    for one, other, value in known.correlated():
        yield f"    {one} and {other} hardly apart from each other: correlation {value:+.3f}"
    if not lost and not known.correlated():
        yield "    nothing of these"
