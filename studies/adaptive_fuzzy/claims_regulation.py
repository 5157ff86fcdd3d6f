"""Claims on speed, accuracy and comfort of the regulation from 10 to 7 m/s (Fig. 4 and 5)."""

from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .controllers import FUZZY

# Our readings of how u comes from the rules.
READINGS = {
    "ku = 10 on top of the base notch": "regulation",
    "ku = 10, absolute": "regulation_absolute_10",
    "ku = 30, absolute": "regulation_absolute_30",
}
COMFORT = 1.5  # m/s²


def faster(r: Results) -> Entry:
    """Rise and settling of the adaptive controller against conventional fuzzy control."""

    def better(experiment: str) -> bool | None:
        pairs = [
            [r.time(experiment, name, metric) for name in ("adaptive", "fuzzy")]
            for metric in ("rise_time", "settling_time")
        ]
        return every(*(less(*pair) for pair in pairs))

    return Entry(
        "Adaptive fuzzy control is faster than conventional fuzzy control",
        "section 3, Fig. 4",
        "; ".join(
            f"{reading}: rise {row(r, e, 'rise_time', FUZZY, 's')}, "
            f"settling {row(r, e, 'settling_time', FUZZY, 's')}"
            for reading, e in READINGS.items()
        ),
        verdict({reading: better(e) for reading, e in READINGS.items()}),
        "shorter rise from 10 to 90 % and shorter settling into 2 % of the step from 10 to 7 m/s",
    )


def faster_than_pid(r: Results) -> Entry:
    """The adaptive controller against PID."""
    names = ("adaptive", "pid_zn")

    def better(metric: str) -> bool | None:
        return less(*(r.time("regulation", name, metric) for name in names))

    return Entry(
        "PID responds slowly; adaptive fuzzy control is faster",
        "introduction and section 3",
        f"rise: {row(r, 'regulation', 'rise_time', names, 's')}; "
        f"settling: {row(r, 'regulation', 'settling_time', names, 's')}; "
        f"overshoot: {row(r, 'regulation', 'overshoot', names, '%')}",
        verdict(
            {
                "time to rise counts": better("rise_time"),
                "time to settle counts": better("settling_time"),
            }
        ),
        "the paper gives no PID gains: Ziegler and Nichols' rules on the identified plant",
    )


def accurate(r: Results) -> Entry:
    """Steady-state error of the adaptive controller against conventional fuzzy control."""
    return Entry(
        "Adaptive fuzzy control is more accurate than conventional fuzzy control",
        "section 3, Fig. 4; conclusion",
        "; ".join(
            f"{reading}: {row(r, e, 'steady_state_error', FUZZY, '%')}"
            for reading, e in READINGS.items()
        ),
        verdict({reading: _smaller(r, e, "adaptive", "fuzzy") for reading, e in READINGS.items()}),
        "|error|, mean over the last 5 s of 40 in percent of the step, smaller by a tenth at "
        "least, where there is one above 0.001 %; at equal ku the smallest γ, that of e = 0, "
        "takes back what the larger ke gives; on top of the base notch neither has an error",
    )


def contraction(r: Results) -> Entry:
    """Steady-state error with the variable universe alone."""
    readings = {name: e for name, e in READINGS.items() if e != "regulation"}
    return Entry(
        "Contracting the universe of e removes the dead zone near e = 0 and improves the accuracy",
        "section 2.2",
        "; ".join(
            f"{reading}: {row(r, e, 'steady_state_error', ('universe', 'fuzzy'), '%')}"
            for reading, e in readings.items()
        ),
        verdict({reading: _smaller(r, e, "universe", "fuzzy") for reading, e in readings.items()}),
        "|error| smaller by a tenth at least with ke and kec adapted and γ = 1, where an error "
        "remains at all",
    )


def acceleration(r: Results) -> Entry:
    """Largest acceleration of the adaptive controller, and of the same with a wide handle."""
    limits = {reading: (e, "adaptive") for reading, e in READINGS.items()}
    limits["ku = 10 on top of the base notch, |u| ≤ 30"] = ("regulation_wide", "adaptive")
    return Entry(
        "The acceleration stays within 1.5 m/s²",
        "section 3, Fig. 5",
        "; ".join(
            f"{reading}: {number(r.get(e, c, 'max_acceleration'), 'm/s²')}"
            for reading, (e, c) in limits.items()
        )
        + "; PID: "
        + ", ".join(
            f"{number(r.get(e, 'pid_zn', 'max_acceleration'), 'm/s²')} with |u| ≤ {bound}"
            for e, bound in (("regulation", 10), ("regulation_wide", 30))
        ),
        verdict(
            {
                reading: less(r.get(e, c, "max_acceleration"), COMFORT)
                for reading, (e, c) in limits.items()
            }
        ),
        "largest |acceleration| from 10 to 7 m/s with |u| ≤ 10 (ours) where nothing else is said; "
        "a limit of the handle alone is no guarantee, as PID with a wider one shows",
    )


def comfortable(r: Results) -> Entry:
    """Comfort of the adaptive controller."""
    names = ("adaptive", "fuzzy", "pid_zn")
    metrics = {"max_acceleration": "m/s²", "rms_jerk": "m/s³"}

    def better(other: str) -> bool | None:
        pairs = [[r.get("regulation", n, m) for n in ("adaptive", other)] for m in metrics]
        return every(*(less(*pair) for pair in pairs))

    return Entry(
        "Passengers ride more comfortably",
        "conclusion",
        "; ".join(
            f"{metric.replace('_', ' ')}: {row(r, 'regulation', metric, names, unit)}"
            for metric, unit in metrics.items()
        ),
        verdict(
            {
                "compared with conventional fuzzy control": better("fuzzy"),
                "compared with PID": better("pid_zn"),
            }
        ),
        "smaller largest acceleration and smaller RMS jerk from 10 to 7 m/s",
    )


def _smaller(r: Results, experiment: str, one: str, other: str) -> bool | None:
    """Return whether one steady-state error is smaller than another that is there at all."""
    errors = [r.get(experiment, name, "steady_state_error") for name in (one, other)]
    if errors[0] is None or errors[1] is None:
        return None
    return abs(errors[1]) > 1e-3 and bool(less(abs(errors[0]), abs(errors[1]), margin=0.1))
