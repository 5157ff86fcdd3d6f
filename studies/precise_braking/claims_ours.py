"""What we add to the paper, judged alike."""

import numpy as np

from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .stopping import STEPS

SAME = 1e-4  # cm: 1e-6 m
TRAVEL = 3.0  # m/s², command travel in a stop
SKETCHED = {100: 25.1, 105: 21.2, 110: 18.6, 120: 15.0, 135: 11.8}  # kWh, a prototype's


def one_answer(r: Results) -> Entry:
    """One stop at several base steps."""
    errors = [r.get("base_step", name, "stop_error") for name in STEPS]
    known = [e for e in errors if e is not None]
    apart = max(known) - min(known) if len(known) == len(STEPS) else None
    return Entry(
        "Ours: the stop does not depend on the master's base step",
        "not in the paper",
        f"base steps of 0.2, 0.1, 0.02 and 0.01 s, delays on none of these grids: apart by "
        f"{'–' if apart is None else f'{apart:.1e}'} cm",
        verdict(less(apart, SAME)),
        "within 1e-6 m, the control period being 0.2 s throughout",
    )


def predictive(r: Results) -> Entry:
    """The predictive stop against SMARC at full spread."""
    names = ("smarc_dob_m2", "predictive_v6", "predictive_v3")

    def better(name: str) -> bool | None:
        return every(
            less(*(r.get("spread_full", n, "sd_stop_error") for n in (name, "smarc_dob_m2"))),
            less(*(r.get("spread_full", n, "p99_stop_error") for n in (name, "smarc_dob_m2"))),
            less(r.get("spread_full", name, "command_travel"), TRAVEL),
        )

    return Entry(
        "Ours: estimation and prediction stop closer than SMARC, with a quieter command",
        "not in the paper",
        f"standard deviation {row(r, 'spread_full', 'sd_stop_error', names, 'cm')}; 99 %: "
        f"{row(r, 'spread_full', 'p99_stop_error', names, 'cm')}; command travel: "
        f"{row(r, 'spread_full', 'command_travel', names, 'm/s²')}; largest jerk: "
        + row(r, "spread_full", "max_jerk", names, "m/s³"),
        verdict({"at V6": better("predictive_v6"), "at V3": better("predictive_v3")}),
        "first stops, on the same draws; travel at most 3 m/s² a stop; V3 is another train, that "
        "brakes electrically down to 3 km/h",
    )


def learning(r: Results) -> Entry:
    """What learning from stop to stop adds."""
    names = ("predictive_v6", "predictive_v3")
    drifts = ("benign", "harsh")
    return Entry(
        "Ours: learning from stop to stop comes closer still",
        "not in the paper",
        f"standard deviation, first stop {row(r, 'spread_full', 'sd_stop_error', names, 'cm')}; "
        + "; ".join(
            f"learned, {drift}: {row(r, f'learned_{drift}', 'sd_stop_error', names, 'cm')}, within "
            f"8 cm {row(r, f'learned_{drift}', 'within_8_cm', names, '%')}"
            for drift in drifts
        ),
        verdict(
            {
                f"{name}, {drift} drift": less(
                    r.get(f"learned_{drift}", name, "sd_stop_error"),
                    r.get("spread_full", name, "sd_stop_error"),
                )
                for name in names
                for drift in drifts
            }
        ),
        "from the 21st stop of a train at a station on; how a train drifts is our choice",
    )


def limits(r: Results) -> Entry:
    """What is left to gain, and by what."""
    names = tuple(r.metrics.get("limits", {}))
    all_known, but_air = (
        r.get("limits", name, "sd_stop_error") for name in ("knows_all", "knows_all_but_air")
    )
    first = r.get("spread_full", "predictive_v6", "sd_stop_error")
    return Entry(
        "Ours: what is left is ignorance of the air brake, not control, delays or noise",
        "not in the paper",
        f"standard deviation at V6: {row(r, 'limits', 'sd_stop_error', names, 'cm')}; "
        f"predictive_v6 {number(first, 'cm')}",
        verdict(
            every(
                less(all_known, first, margin=0.8),
                less(None if first is None else 0.8 * first, but_air),
            )
        ),
        "a controller that is told everything is left with less than a fifth of the deviation, one "
        "that is told all but the air brake with more than four fifths",
    )


def energy(r: Results) -> Entry:
    """Energy over running time, and the fast curve's."""
    rows = r.metrics.get("energy", {})
    time = [row["running_time"] or 0.0 for row in rows.values()]
    least = [row["planned_energy"] or 0.0 for row in rows.values()]
    slopes = np.diff(least) / np.diff(time)
    shape = None
    if len(slopes) > 1:
        shape = bool(np.all(slopes < 0.0) and np.all(np.diff(slopes) > 0.0))
    told = ", ".join(
        f"{t:.0f} s {e:.2f} ({SKETCHED.get(round(t), '–')})"
        for t, e in zip(time, least, strict=True)
    )
    return Entry(
        "Ours: the least energy falls with the running time, ever more slowly",
        "not in the paper",
        f"kWh at the wheel over 1544 m (a prototype's in brackets): {told}",
        verdict(shape),
        "strictly decreasing and convex in the running time",
    )


def arrival(r: Results) -> Entry:
    """Whether the FMU under ATO arrives as planned."""
    rows = {
        f"{e} {n}": row
        for e, found in r.metrics.items()
        if e.startswith("run_")
        for n, row in found.items()
    }

    def worst(metric: str) -> float | None:
        return max((abs(row[metric] or 0.0) for row in rows.values()), default=None)

    alarms = sum((row["warning"] or 0.0) + (row["emergency"] or 0.0) for row in rows.values())
    return Entry(
        "Ours: the train driven by ATO arrives as planned, and ATP has no cause to intervene",
        "not in the paper",
        f"{len(rows)} runs: at most {number(worst('late'), 's')} off the plan's time, "
        f"{number(worst('stop_error'), 'cm')} off the mark, {alarms:.0f} with a warning",
        verdict(
            every(
                less(worst("late"), 1.0),
                less(worst("stop_error"), 30.0),
                None if not rows else alarms == 0.0,
            )
        ),
        "within 1 s and 30 cm; the nominal train, without noise",
    )
