"""Claims on the pattern of Fig. 1 and on its supervision by the ATP."""

import numpy as np

from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .controllers import LINE_UP
from .line import REGULATED

PLATFORM = 30.0  # cm, what platform doors bear


def stops(r: Results) -> Entry:
    """Where the train stops."""
    errors = {name: r.get("pattern", name, "stop_error") for name in LINE_UP}

    def within(name: str) -> bool | None:
        error = errors[name]
        return None if error is None else abs(error) < PLATFORM

    ours, conventional = errors["adaptive"], errors["fuzzy"]
    nearer = None
    if ours is not None and conventional is not None:
        nearer = abs(ours) < abs(conventional)
    return Entry(
        "With adaptive fuzzy control the train stops at its place",
        "section 1, Fig. 1; conclusion",
        "stop error: " + row(r, "pattern", "stop_error", LINE_UP, "cm"),
        verdict(
            {
                "30 cm are enough": within("adaptive"),
                "it must stop nearer than with conventional fuzzy control": nearer,
            }
        ),
        "10 to 7 m/s, then a stopping curve of 0.5 m/s² and a holding brake below 0.1 m/s (ours); "
        "the brake is the drive's, without scatter",
    )


def one_step(r: Results) -> Entry:
    """One regulation step against several: nothing in the paper to compare with."""
    time = r.get("pattern", "adaptive", "running_time")
    return Entry(
        "One regulation step before the stop serves transport better than several",
        "section 1",
        f"running time of the pattern: {number(time, 's')}",
        verdict(None),
        "the paper gives no pattern with several steps to compare with",
    )


def supervised(r: Results) -> Entry:
    """The ATP in the ordinary run, and against a controller that runs away."""
    quiet = [r.get("pattern", name, "interventions") for name in LINE_UP]
    calm = None if None in quiet else all(count == 0.0 for count in quiet)
    protected, bare = (r.get("runaway", name, "violations") for name in ("atp", "no_atp"))
    runs = r.get("runaway", "atp", "runs")
    return Entry(
        "The ATP's emergency brake keeps a train below the speed limit whatever the ATO does",
        "section 1",
        f"a controller that runs away, {number(runs, 'runs', 0)}: with ATP "
        f"{number(protected, '', 0)} pass the limit curve (least margin "
        f"{number(r.get('runaway', 'atp', 'least_margin'), 'm/s', 3)}), without "
        f"{number(bare, '', 0)} (up to "
        f"{number(_negative(r.get('runaway', 'no_atp', 'least_margin')), 'm/s')} above); in the "
        f"ordinary pattern it intervenes {number(_total(quiet), 'times', 0)}",
        verdict(every(None if protected is None else protected == 0.0, less(0.0, bare), calm)),
        "the limit curve and its braking model are ours; looked at in every step of 0.1 s, with "
        "mass ±15 %, adhesion 0.09 to 0.2, brake delay 0.2 to 0.8 s and lag 0.3 to 0.5 s",
    )


def literally_supervised(r: Results) -> Entry:
    """The paper's own criterion: an emergency when the speed exceeds the target."""
    over = {name: _overspeed(r, name) for name in LINE_UP}
    return Entry(
        "The ATP can brake in an emergency as soon as the speed exceeds the target speed",
        "section 1",
        "largest excess over the target on the stopping curve: "
        + ", ".join(f"{name} {number(value, 'm/s', 3)}" for name, value in over.items()),
        verdict(every(*(None if value is None else value <= 0.0 for value in over.values()))),
        "read literally this would end each of these runs, as all exceed the falling target "
        "somewhat; hence a limit curve of ours above the target",
    )


def _overspeed(r: Results, name: str) -> float | None:
    """Return the largest speed above the target while that falls along the stopping curve."""
    run = r.runs.get(("pattern", name))
    if run is None:
        return None
    target = run["pattern.target"]
    falling = (target < REGULATED) & (target > 0.0)
    return float(np.max((run["train.speed"] - target)[falling], initial=-np.inf))


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


def _total(counts: list[float | None]) -> float | None:
    return None if None in counts else sum(c for c in counts if c is not None)
