"""Claims on tracking the line profile (Fig. 8 and 9)."""

import numpy as np

from ..ledger import Entry, less, number, verdict
from ..results import Results
from .controllers import TUNINGS


def tracking(r: Results) -> Entry:
    """RMS errors over the profile."""
    others = {
        "single neuron": "neuron",
        "PID (Ziegler-Nichols)": "pid_zn",
        "PID (SIMC)": "pid_simc",
        "fuzzy": "fuzzy",
    }
    ours = r.get("profile", "composite", "rms_error")
    return Entry(
        "The composite tracks the line profile better than every single controller",
        "section 2.2, Fig. 8",
        "RMS error: "
        + ", ".join(
            f"{n} {number(r.get('profile', n, 'rms_error'), 'm/s', 4)}"
            for n in ("composite", *others.values())
        ),
        verdict(
            {
                f"compared with {what}": less(ours, r.get("profile", name, "rms_error"))
                for what, name in others.items()
            }
        ),
        "smaller RMS error over the whole profile (the profile is ours, the paper's is lost)",
    )


def first_seconds(r: Results) -> Entry:
    """Fuzzy and composite at the start of traction."""
    apart = _largest(r, "fuzzy", "composite", 0.0, 3.0)
    later = {c: _rms(r, c, 3.0, 30.0) for c in ("fuzzy", "composite")}
    return Entry(
        "In the first 3 s of traction fuzzy and composite agree; later fuzzy's error is larger",
        "section 2.2, Fig. 9a",
        f"largest difference of speed to 3 s: {number(apart, 'm/s', 3)}; RMS error 3–30 s: "
        + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in later.items()),
        verdict(
            {
                "the first 3 s are meant": less(apart, 0.05),
                "3 to 30 s are meant": less(later["composite"], later["fuzzy"]),
            }
        ),
        "agree: within 0.05 m/s; larger error: by RMS from 3 s to the end of traction at 30 s",
    )


def cruise(r: Results) -> Entry:
    """Overshoot and static error in the cruise."""
    error = {c: _mean_error(r, c, 60.0, 70.0) for c in ("fuzzy", "composite")}
    peak = {c: _overshoot(r, c, 30.0, 70.0) for c in ("composite", "neuron", *TUNINGS.values())}
    return Entry(
        "Cruising, the composite overshoots less than PID and neuron, and fuzzy keeps an error",
        "section 2.2, Fig. 9b",
        "overshoot above 16 m/s, 30–70 s: "
        + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in peak.items())
        + "; mean |error| 60–70 s: "
        + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in error.items()),
        verdict(
            {
                **{
                    f"the overshoot of {name} is compared": less(peak["composite"], peak[name])
                    for name in ("neuron", *TUNINGS.values())
                },
                "the static error is meant": less(error["composite"], error["fuzzy"]),
            }
        ),
        "overshoot after traction ends at 30 s; static error at the end of the cruise",
    )


def _window(
    r: Results, controller: str, a: float, b: float
) -> tuple[np.ndarray, np.ndarray] | None:
    run = r.runs.get(("profile", controller))
    if run is None or not {"reference.y", "train.speed"} <= set(run.columns):
        return None
    inside = (run.time >= a) & (run.time <= b)
    if not inside.any():
        return None
    return run["reference.y"][inside], run["train.speed"][inside]


def _largest(r: Results, one: str, other: str, a: float, b: float) -> float | None:
    pair = _window(r, one, a, b), _window(r, other, a, b)
    if pair[0] is None or pair[1] is None or len(pair[0][1]) != len(pair[1][1]):
        return None
    return float(np.max(np.abs(pair[0][1] - pair[1][1])))


def _rms(r: Results, controller: str, a: float, b: float) -> float | None:
    found = _window(r, controller, a, b)
    return None if found is None else float(np.sqrt(np.mean((found[0] - found[1]) ** 2)))


def _mean_error(r: Results, controller: str, a: float, b: float) -> float | None:
    found = _window(r, controller, a, b)
    return None if found is None else float(np.mean(np.abs(found[0] - found[1])))


def _overshoot(r: Results, controller: str, a: float, b: float) -> float | None:
    found = _window(r, controller, a, b)
    return None if found is None else float(np.max(found[1] - 16.0))
