"""Claims on the unit step (Fig. 4 and 5) and on the equations as printed."""

import numpy as np

from ...cosim import Run
from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .controllers import LITERAL_PERIODS, TUNINGS


def fast(r: Results) -> Entry:
    """Rise times of fuzzy and composite."""
    fuzzy, composite = (r.get("step", c, "rise_time") for c in ("fuzzy", "composite"))
    near = None if fuzzy is None or composite is None else abs(fuzzy / composite - 1.0) < 0.1
    return Entry(
        "Fuzzy control is about as fast as the composite on a step",
        "section 2.2, Fig. 4",
        "rise time: " + row(r, "step", "rise_time", ("fuzzy", "composite"), "s"),
        verdict({"": near}),
        "rise times from 10 to 90 % within 10 % of each other",
    )


def static_error(r: Results) -> Entry:
    """Steady-state error of fuzzy."""
    error = r.get("step", "fuzzy", "steady_state_error")
    return Entry(
        "Fuzzy control keeps a static error",
        "section 2.2, Fig. 4",
        f"steady-state error: fuzzy {number(error, '%', 3)}",
        verdict({"": None if error is None else abs(error) > 0.1}),
        "more than 0.1 % of the step, mean over the last 5 s of 60",
    )


def removes_error(r: Results) -> Entry:
    """Steady-state error of the composite."""
    error = r.get("step", "composite", "steady_state_error")
    return Entry(
        "The composite removes the static error",
        "section 2.2, Fig. 4",
        f"steady-state error: composite {number(error, '%', 3)}",
        verdict({"": None if error is None else abs(error) < 0.1}),
        "less than 0.1 % of the step, mean over the last 5 s of 60",
    )


def beats_others(r: Results) -> Entry:
    """Settling, overshoot and IAE of the composite against neuron and PID."""

    def better(other: str) -> bool | None:
        found = []
        for metric in ("settling_time", "overshoot", "iae"):
            ours, theirs = r.get("step", "composite", metric), r.get("step", other, metric)
            if metric == "settling_time" and ours is not None and theirs is None:
                theirs = float("inf")  # never settled
            found.append(less(ours, theirs))
        return every(*found)

    names = ("composite", "neuron", "pid_zn", "pid_simc", "pid_simc_kick")
    return Entry(
        "The composite beats the single neuron and PID on settling, overshoot and IAE",
        "section 2.2, Fig. 4",
        "; ".join(
            f"{metric}: {row(r, 'step', metric, names, unit)}"
            for metric, unit in (("settling_time", "s"), ("overshoot", "%"), ("iae", "m"))
        ),
        verdict(
            {
                "compared with the single neuron": better("neuron"),
                **{f"compared with PID, where {k}": better(v) for k, v in TUNINGS.items()},
                "compared with SIMC with a derivative kick": better("pid_simc_kick"),
            }
        ),
        "better in all three; the PID gains are not in the paper, so two tunings are tried",
    )


def smooth(r: Results) -> Entry:
    """What a change of Cf adds to u."""
    run = _composite_step(r)
    if run is None:
        share, hard = None, None
    else:
        cf = run["controller.cf"]
        apart = run["controller.u_fuzzy"] - run["controller.u_neuron"]
        share = float(np.max(np.abs(np.diff(cf) * apart[1:])))
        crossing = np.nonzero(np.diff(cf > 0.5))[0] + 1
        hard = float(np.max(np.abs(apart[crossing]), initial=0.0))
    return Entry(
        "Switching is smooth: no jump in u when Cf moves",
        "section 1.4, Fig. 5",
        f"largest part of a change of u that comes from a change of Cf: {number(share, '')} of "
        f"±10 per sample; switching hard at Cf = 0.5 would jump by up to {number(hard, '')}",
        verdict(
            {
                "a tenth of the control range is allowed": less(share, 2.0),
                "compared with hard switching": None
                if share is None or hard is None
                else share < hard,
            }
        ),
        "|ΔCf · (Uf − Unp)| between samples of the unit step stays below a tenth of the range "
        "of u and below what a threshold would give",
    )


def weights(r: Results) -> Entry:
    """Which controller dominates when."""
    run = _composite_step(r)
    if run is None:
        final, start, total = None, None, None
    else:
        cf, cnp = run["controller.cf"], run["controller.cnp"]
        start, final = float(cf[0]), float(np.max(cf[run.time >= run.time[-1] - 5.0]))
        total = float(np.max(np.abs(cf + cnp - 1.0)))
    return Entry(
        "Fuzzy control dominates for large errors, the single neuron near the set point",
        "sections 1.1 and 1.4, Fig. 5",
        f"Cf at the step {number(start, '')}, largest over the last 5 s {number(final, '')}, "
        f"|Cf + Cnp − 1| ≤ {number(total, '', 1)}",
        verdict(
            {
                "the error is large": None if start is None else start > 0.5,
                "the error is small": None if final is None else final < 0.5,
                "the weights add up to one": None if total is None else total < 1e-12,
            }
        ),
        "Cf above one half at the start of the step and below it over the last 5 s; near the set "
        "point (|E| ≤ 0.2, |EC| ≤ 0.5) table 3 gives exactly 0: there the composite is the neuron",
    )


def as_printed(r: Results) -> Entry:
    """Whether the literal variants settle."""
    names = {
        text: "composite_literal" if text == "50ms" else f"composite_literal_{text}"
        for text in LITERAL_PERIODS
    }
    settled: dict[str, bool | None] = {}
    for text, name in names.items():
        measured = r.get("step", name, "iae") is not None
        settled[f"sampled every {text}"] = (
            r.get("step", name, "settling_time") is not None if measured else None
        )
    return Entry(
        "The method works as printed (equations 1 to 8 without scaling, an unstated period)",
        "sections 1.2 to 1.5",
        "settling time of the unit step: "
        + ", ".join(
            f"{text} {number(r.get('step', name, 'settling_time'), 's')}"
            for text, name in names.items()
        ),
        verdict(settled),
        "settles into 2 % within 60 s; the weights' common factor drives them to fixed shares, "
        "with which equation 1 is unstable at short periods, while fuzzy control needs short ones",
    )


def _composite_step(r: Results) -> Run | None:
    """Return the composite's step run, if it has the signals that only the composite has."""
    run = r.runs.get(("step", "composite"))
    signals = {f"controller.{name}" for name in ("cf", "cnp", "u_fuzzy", "u_neuron")}
    return run if run is not None and signals <= set(run.columns) else None
