"""Claims about the train's model."""

from ..ledger import Entry, less, number, verdict
from ..results import Results
from .train_cases import INNER_STEPS, inner_name

ALIKE = 0.01  # of the peak: converged over the inner steps
FIRST_FOUR = 4


def judge(r: Results) -> list[Entry]:
    """Return the claims about the model."""
    return [continuous(r), in_front(r), newmark(r), converging(r), tests(r), curves(r)]


def _peaks(r: Results, form: str) -> list[float | None]:
    return [r.get("violent_start", f"{form}_{inner_name(h)}", "peak_tension") for h in INNER_STEPS]


def _spread(peaks: list[float | None]) -> float | None:
    """Return how far the peaks are apart, relative to the last one."""
    known = [peak for peak in peaks if peak is not None]
    return None if len(known) < len(peaks) else (max(known) - min(known)) / known[-1]


def continuous(r: Results) -> Entry:
    """The law of the gears against raw switching."""
    forms = {"incremental": "the increments", "dahl": "the Dahl form", "switching": "raw switching"}
    spreads = {form: _spread(_peaks(r, form)) for form in forms}
    measured = "; ".join(
        f"{text}: " + ", ".join(number(peak, "", 0) for peak in _peaks(r, form)) + " kN"
        for form, text in forms.items()
    )
    return Entry(
        "The look-up table model overcomes the discontinuity between loading and unloading",
        "abstract, sections 2 and 5",
        f"violent start, greatest force at inner steps of 5, 2, 1 and 0.5 ms: {measured}",
        verdict(
            {
                f"{forms[form]} stand for equations 8 to 10": less(spreads[form], ALIKE)
                for form in ("incremental", "dahl")
            }
        ),
        "equations 8 to 10 are lost: F = clip(F + k Δd, lo, hi) is our reading, on one curve, "
        "where the paper picks one of several by the impact's speed; it is overcome if the "
        "greatest force stays within 1 % over the inner steps, which raw switching does not",
    )


def in_front(r: Results) -> Entry:
    """Where the greatest force is at the start."""
    gentle = r.get("open_loop_start", "open_loop", "peak_tension_at")
    tracked = r.get("start_up", "fuzzy_folded", "peak_tension_at")
    violent = r.get("violent_start", "incremental_1000us", "peak_tension_at")

    def there(place: float | None) -> bool | None:
        return None if place is None else place <= FIRST_FOUR

    return Entry(
        "At start-up the greatest coupler force is at the couplers 1 to 4",
        "section 4",
        f"coupler {number(tracked, '', 0)} under control, {number(gentle, '', 0)} at 40 kN/s "
        f"on +6 ‰, {number(violent, '', 0)} at 400 kN/s on the level",
        verdict(
            {
                "the force is tracked": there(tracked),
                "it rises at 40 kN/s": there(gentle),
                "it rises at 400 kN/s": there(violent),
            }
        ),
        "coupler i is behind vehicle i; behind the second locomotive it is number 2",
    )


def newmark(r: Results) -> Entry:
    """The paper's method against the FMU's."""
    ours = r.get("violent_start", "incremental_1000us", "peak_tension")
    theirs = r.get("newmark", "newmark", "peak_tension")
    apart = None if ours is None or theirs is None else abs(ours - theirs) / theirs
    return Entry(
        "Newmark-β with equilibrium iterations is precise for this train",
        "section 4",
        f"violent start, greatest force: Newmark-β {number(theirs, 'kN', 1)}, the FMU "
        f"(semi-implicit Euler, 1 ms) {number(ours, 'kN', 1)}",
        verdict(less(apart, 0.005)),
        "within 0.5 % of each other: two programs that share no code",
    )


def converging(r: Results) -> Entry:
    """Whether the vehicles' speeds agree."""
    spread = r.get("start_up", "fuzzy_folded", "speed_spread")
    speed = r.get("start_up", "fuzzy_folded", "end_speed")
    return Entry(
        "The speeds of all vehicles stay consistent",
        "section 2",
        f"start-up, last 20 s: first and last vehicle differ by {number(spread, 'm/s', 3)} at "
        f"most, at {number(speed, 'm/s')} in the end",
        verdict(less(spread, 0.1)),
        "by less than 0.1 m/s once the train is stretched; before, it is pulled taut vehicle by "
        "vehicle and they cannot be the same",
    )


def tests(r: Results) -> Entry:
    """The comparison with test data."""
    return Entry(
        "The computed longitudinal forces agree with tests, and the targets are fitted to them",
        "section 4",
        "no data are published",
        verdict(None),
        "the targets of this study are synthetic (ours), and nothing here stands for a test; the "
        "inputs of the international benchmark of train dynamics simulators are not public here "
        "either",
    )


def curves(r: Results) -> Entry:
    """The speed of the impact."""
    return Entry(
        "A curve chosen by the impact's speed makes the coupler force exact",
        "section 2, Fig. 3",
        "the curves and the numbers of the drop tests are not published",
        verdict(None),
        "our gears have one curve, whatever the speed",
    )
