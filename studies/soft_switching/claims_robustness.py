"""Claims on the pulse disturbance (Fig. 6) and the perturbed plants (Fig. 7)."""

from ..ledger import Entry, every, less, number, row, verdict
from ..results import Results
from .controllers import TUNINGS

PERTURBED = ("gain_plus_20", "frequency_plus_20_numerator_held", "frequency_plus_20_gain_held")


def fuzzy_disturbed(r: Results) -> Entry:
    """Fuzzy control under the pulse."""
    names = ("fuzzy", "pid_zn", "pid_simc", "neuron", "composite")

    def inside(experiment: str) -> bool | None:
        dip, rebound = (r.get(experiment, "fuzzy", metric) for metric in ("dip", "rebound"))
        return every(less(dip, 2.0), less(rebound, 2.0))

    return Entry(
        "The pulse hardly disturbs fuzzy control",
        "section 2.2, Fig. 6",
        "dip below the target: "
        + "; ".join(f"{e}: {row(r, e, 'dip', names, '%')}" for e in ("pulse", "pulse_late")),
        verdict(
            {"the pulse comes at 20 s": inside("pulse"), "it comes at 60 s": inside("pulse_late")}
        ),
        "the speed does not leave the 2 % band, the static error included",
    )


def pulse(r: Results) -> Entry:
    """The composite under the pulse against neuron and PID."""

    def better(experiment: str, other: str) -> bool | None:
        def recovery(name: str) -> float | None:
            if r.get(experiment, name, "dip") is None:
                return None
            time = r.get(experiment, name, "recovery_time")
            return float("inf") if time is None else time

        dip = less(r.get(experiment, "composite", "dip"), r.get(experiment, other, "dip"))
        mine, theirs = recovery("composite"), recovery(other)
        return every(dip, None if mine is None or theirs is None else mine <= theirs)

    names = ("composite", "neuron", "pid_zn", "pid_simc")
    return Entry(
        "Under the pulse the composite deviates less and recovers faster than PID and neuron",
        "section 2.2, Fig. 6",
        "; ".join(
            f"{e} {m}: {row(r, e, m, names, u)}"
            for e in ("pulse", "pulse_late")
            for m, u in (("dip", "%"), ("recovery_time", "s"))
        ),
        verdict(
            {
                f"{what} and the pulse comes at {at}": better(experiment, other)
                for experiment, at in (("pulse", "20 s"), ("pulse_late", "60 s"))
                for other, what in (
                    ("neuron", "compared with the neuron"),
                    ("pid_zn", "compared with PID (Ziegler-Nichols)"),
                    ("pid_simc", "compared with PID (SIMC)"),
                )
            }
        ),
        "smaller dip and no longer recovery; at 20 s, as in the paper, the neuron still rings "
        "from the step, at 60 s it has settled",
    )


def gain(r: Results) -> Entry:
    """PID at gain +20 %."""
    names = tuple(TUNINGS.values())
    return Entry(
        "With the gain 20 % larger PID responds faster",
        "section 2.2, Fig. 7a",
        "rise time nominal: " + row(r, "step", "rise_time", names, "s")
        + "; gain +20 %: " + row(r, "gain_plus_20", "rise_time", names, "s"),
        verdict(
            {
                condition: less(
                    r.get("gain_plus_20", name, "rise_time"), r.get("step", name, "rise_time")
                )
                for condition, name in TUNINGS.items()
            }
        ),
        "shorter rise time than on the nominal plant",
    )  # fmt: skip


def frequency(r: Results) -> Entry:
    """PID and neuron at natural frequency +20 %, read both ways."""
    names = (*TUNINGS.values(), "neuron")
    readings = {
        "the numerator is held at 0.07128": "frequency_plus_20_numerator_held",
        "the gain K is held": "frequency_plus_20_gain_held",
    }
    return Entry(
        "With the natural frequency 20 % larger PID and the single neuron respond slower",
        "section 2.2, Fig. 7b",
        "; ".join(
            f"rise time, {what}: {row(r, e, 'rise_time', names, 's')}"
            for what, e in (("nominal", "step"), *readings.items())
        ),
        verdict(
            {
                condition: every(
                    *(
                        less(r.get("step", n, "rise_time"), r.get(experiment, n, "rise_time"))
                        for n in names
                    )
                )
                for condition, experiment in readings.items()
            }
        ),
        "longer rise time than nominal for both PID tunings and the neuron",
    )


def perturbed_overshoot(r: Results) -> Entry:
    """Overshoot of the composite on the perturbed plants."""
    nominal = r.get("step", "composite", "overshoot")

    def grown(experiment: str) -> bool | None:
        found = r.get(experiment, "composite", "overshoot")
        return None if found is None or nominal is None else 2.0 < found < 15.0 and found > nominal

    return Entry(
        "On the perturbed plants the composite overshoots slightly",
        "section 2.2, Fig. 7",
        f"overshoot: nominal {number(nominal, '%')}, "
        + ", ".join(f"{e} {number(r.get(e, 'composite', 'overshoot'), '%')}" for e in PERTURBED),
        verdict({f"in {experiment}": grown(experiment) for experiment in PERTURBED}),
        "more overshoot than nominal, above the 2 % band and below 15 %",
    )
