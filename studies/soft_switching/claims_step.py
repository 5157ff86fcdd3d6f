"""Claims on the unit step (Fig. 4 and 5) and on the equations as printed."""

import numpy as np

from ...cosim import Run
from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .controllers import LITERAL_PERIODS, literal_name


def fast(r: Results) -> Entry:
    """Rise times of fuzzy and composite."""
    fuzzy, composite = (r.time("step", c, "rise_time") for c in ("fuzzy", "composite"))
    near = None
    if fuzzy is not None and composite is not None:
        near = composite < float("inf") and abs(fuzzy - composite) < 0.1 * composite
    return Entry(
        "Fuzzy control is about as fast as the composite on a step",
        "section 2.2, Fig. 4",
        "rise time: " + row(r, "step", "rise_time", ("fuzzy", "composite"), "s"),
        verdict(near),
        "rise times from 10 to 90 % within 10 % of each other",
    )


def static_error(r: Results) -> Entry:
    """Steady-state error of fuzzy."""
    error = r.get("step", "fuzzy", "steady_state_error")
    return Entry(
        "Fuzzy control keeps a static error",
        "section 2.2, Fig. 4",
        f"steady-state error: fuzzy {number(error, '%', 3)}",
        verdict(None if error is None else abs(error) > 0.1),
        "more than 0.1 % of the step, mean over the last 5 s of 60",
    )


def removes_error(r: Results) -> Entry:
    """Steady-state error of the composite."""
    error = r.get("step", "composite", "steady_state_error")
    return Entry(
        "The composite removes the static error",
        "section 2.2, Fig. 4",
        f"steady-state error: composite {number(error, '%', 3)}",
        verdict(None if error is None else abs(error) < 0.1),
        "less than 0.1 % of the step, mean over the last 5 s of 60",
    )


def beats_others(r: Results) -> Entry:
    """Settling, overshoot and IAE of the composite against neuron and PID."""

    def better(ours: str, other: str) -> bool | None:
        found = [
            less(r.time("step", ours, "settling_time"), r.time("step", other, "settling_time")),
            less(r.get("step", ours, "overshoot"), r.get("step", other, "overshoot")),
            less(r.get("step", ours, "iae"), r.get("step", other, "iae")),
        ]
        return every(*found)

    others = {"the single neuron": "neuron", "PID by Ziegler-Nichols": "pid_zn",
              "PID by SIMC": "pid_simc"}  # fmt: skip
    names = ("composite", *others.values())
    kicked = tuple(f"{name}_kick" for name in names)
    conditions = {
        f"compared with {what}, {when}": better(f"composite{suffix}", f"{name}{suffix}")
        for suffix, when in (("", "e(−1) = e(0)"), ("_kick", "e(−1) = 0"))
        for what, name in others.items()
    }
    return Entry(
        "The composite beats the single neuron and PID on settling, overshoot and IAE",
        "section 2.2, Fig. 4",
        "; ".join(
            f"{text}: {row(r, 'step', metric, (*names, *kicked), unit)}"
            for metric, text, unit in (
                ("settling_time", "settling time", "s"),
                ("overshoot", "overshoot", "%"),
                ("iae", "IAE", "m"),
            )
        ),
        verdict(conditions),
        "better in all three; the paper gives neither PID gains, so two tunings are tried, nor the "
        "error before the first sample: e(−1) = e(0), or 0 (_kick), which kicks the derivatives",
    )


def smooth(r: Results) -> Entry:
    """What a change of Cf adds to u."""
    run = _composite_step(r)
    if run is None or len(run.time) < 2:
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
        verdict(every(less(share, 2.0), less(share, hard))),
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
        start, final = float(cf[_jump(run)]), float(np.max(cf[run.time >= run.time[-1] - 5.0]))
        total = float(np.max(np.abs(cf + cnp - 1.0)))
    return Entry(
        "Fuzzy control dominates for large errors, the single neuron near the set point",
        "sections 1.1 and 1.4, Fig. 5",
        f"Cf at the step {number(start, '')}, largest over the last 5 s {number(final, '')}, "
        f"|Cf + Cnp − 1| ≤ {number(total, '', 1)}",
        verdict(every(less(0.5, start), less(final, 0.5), less(total, 1e-12))),
        "Cf above one half at the start of the step and below it over the last 5 s; near the set "
        "point (|E| ≤ 0.2, |EC| ≤ 0.5) table 3 gives exactly 0: there the composite is the neuron",
    )


def as_printed(r: Results) -> Entry:
    """Whether the literal variants settle."""
    settling = {
        text: r.time("step", literal_name(text), "settling_time") for text in LITERAL_PERIODS
    }
    names = [literal_name(text) for text in LITERAL_PERIODS]
    return Entry(
        "The method works as printed (equations 1 to 8 without scaling, an unstated period)",
        "sections 1.2 to 1.5",
        "settling time of the unit step: " + row(r, "step", "settling_time", names, "s"),
        verdict(
            {f"sampled every {text}": less(found, float("inf")) for text, found in settling.items()}
        ),
        "settles into 2 % within 60 s; the weights' common factor drives them to fixed shares, "
        "with which equation 1 is unstable at short periods, while fuzzy control needs short ones",
    )


def _composite_step(r: Results) -> Run | None:
    """Return the composite's step run, if it has the signals that only the composite has."""
    run = r.runs.get(("step", "composite"))
    signals = {f"controller.{name}" for name in ("cf", "cnp", "u_fuzzy", "u_neuron")}
    return run if run is not None and signals <= set(run.columns) else None


def _jump(run: Run) -> int:
    """Return the row at which the reference takes its last value."""
    apart = np.nonzero(run["reference.y"] != run["reference.y"][-1])[0]
    return int(apart[-1]) + 1 if len(apart) else 0
