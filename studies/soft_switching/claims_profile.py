"""Claims on tracking the line profile (Fig. 8 and 9)."""

import numpy as np

from ..ledger import Entry, every, less, number, verdict
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
    return Entry(
        "In the first 3 s of traction fuzzy control and the composite agree",
        "section 2.2, Fig. 9a",
        f"largest difference of speed to 3 s: {number(apart, 'm/s', 3)}",
        verdict(less(apart, 0.05)),
        "speeds within 0.05 m/s (the profile is ours)",
    )


def later_traction(r: Results) -> Entry:
    """Errors of fuzzy and composite after the first seconds of traction."""
    error = {c: _rms(r, c, 3.0, 30.0) for c in ("fuzzy", "composite")}
    return Entry(
        "After 3 s of traction fuzzy control's error is larger than the composite's",
        "section 2.2, Fig. 9a",
        "RMS error 3–30 s: " + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in error.items()),
        verdict(less(error["composite"], error["fuzzy"], margin=0.05)),
        "RMS error from 3 s to the end of traction at 30 s, larger by 5 % at least",
    )


def cruise(r: Results) -> Entry:
    """Overshoot into the cruise."""
    others = {"compared with the neuron": "neuron", **TUNINGS}
    peak = {c: _overshoot(r, c, 30.0, 70.0) for c in ("composite", *others.values())}
    return Entry(
        "Cruising, the composite overshoots less than PID and the single neuron",
        "section 2.2, Fig. 9b",
        "overshoot above the cruise, 30–70 s: "
        + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in peak.items()),
        verdict({what: less(peak["composite"], peak[name]) for what, name in others.items()}),
        "highest speed above the reference from the end of traction to the end of the cruise",
    )


def cruise_static_error(r: Results) -> Entry:
    """Static error in the cruise."""
    error = {c: _mean_error(r, c, 60.0, 70.0) for c in ("fuzzy", "composite")}
    return Entry(
        "Cruising, fuzzy control keeps an error and the composite does not",
        "section 2.2, Fig. 9b",
        "mean |error| 60–70 s: "
        + ", ".join(f"{c} {number(v, 'm/s', 3)}" for c, v in error.items()),
        verdict(every(less(0.05, error["fuzzy"]), less(error["composite"], 0.05))),
        "above and below 0.05 m/s at the end of the cruise",
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
    return None if found is None else float(np.max(found[1] - found[0]))
