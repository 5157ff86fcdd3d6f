"""How stops scatter: distributions, what limits them, and how learning helps."""

from typing import TYPE_CHECKING

import numpy as np

from ..plots import label, legend, panels
from ..results import Results
from .spreads import SETTLED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVES = {
    ("spread_full", "smarc_m0"): ("SMARC, delays as they are", "#999999", "-"),
    ("spread_full", "smarc_m2"): ("SMARC, prediction", "#E69F00", "-"),
    ("spread_full", "smarc_dob_m2"): ("SMARC, prediction and observer", "#D55E00", "-"),
    ("spread_full", "predictive_v6"): ("predictive stop, first stop, V6", "#0072B2", "-"),
    ("spread_full", "predictive_v3"): ("predictive stop, first stop, V3", "#56B4E9", "-"),
    ("spread_full", "predictive_soft_v6"): ("predictive stop, soft ending, V6", "#000066", "-."),
    ("learned_harsh", "predictive_v6"): ("predictive stop, learned (harsh), V6", "#009E73", "-"),
    ("limits", "knows_all_but_air"): ("limit: knows all but the air brake, V6", "#CC79A7", "--"),
    ("limits", "knows_air_at_onset"): ("limit: air brake told at its onset", "#A05A00", "--"),
    ("limits", "knows_all"): ("limit: knows everything, V6", "#000000", "--"),
}
CHAINS = {
    ("learned_benign", "predictive_v6"): ("V6, benign", "#0072B2"),
    ("learned_harsh", "predictive_v6"): ("V6, harsh", "#D55E00"),
    ("learned_benign", "predictive_v3"): ("V3, benign", "#56B4E9"),
    ("learned_harsh", "predictive_v3"): ("V3, harsh", "#E69F00"),
}


def spread_figures(results: Results) -> "dict[str, Figure | None]":
    """Return the figures by file name, None where the campaigns were not run."""
    return {
        "accuracy": _accuracy(results),
        "travel": _travel(results),
        "learning": _learning(results),
    }


def _accuracy(results: Results) -> "Figure | None":
    """The share of stops beyond each error, with the limits beside them."""
    found = {key: results.samples[key] for key in CURVES if key in results.samples}
    if not found:
        return None
    figure, (axis,) = panels("Stopping accuracy at full spread, and what limits it", height=7.6)
    for key, samples in found.items():
        text, colour, dashes = CURVES[key]
        error = np.abs(samples["stop_error"].to_numpy(dtype=float))
        if "stop" in samples:
            error = error[samples["stop"].to_numpy() >= SETTLED]
        error = np.sort(error)
        beyond = 100.0 * (1.0 - np.arange(1, len(error) + 1) / (len(error) + 1))
        axis.plot(error, beyond, dashes, color=colour, label=f"{text} ({len(error)} stops)")
    for bound in (8.0, 30.0, 50.0):
        axis.axvline(bound, color="#000000", linewidth=0.6, linestyle=":")
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlim(0.3, 1000.0)
    axis.set_ylim(0.01, 110.0)
    label(axis, "|stop error| / cm (dotted: 8, 30, 50 cm)", "stops beyond it / %")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    return figure


def _travel(results: Results) -> "Figure | None":
    """What accuracy costs: command travel and jerk."""
    rows = {
        f"{name}{'' if experiment == 'spread_full' else ', learned'}": row
        for experiment in ("spread_full", "learned_harsh")
        for name, row in results.metrics.get(experiment, {}).items()
    }
    if not rows:
        return None
    figure, axes = panels("Accuracy and its cost at full spread", 3, height=3.0)
    names = list(rows)
    places = np.arange(len(names))
    for axis, metric, text in zip(
        axes,
        ("sd_stop_error", "command_travel", "max_jerk"),
        ("sd of the error / cm", "command travel / (m/s²)", "largest jerk / (m/s³)"),
        strict=True,
    ):
        values = [rows[name][metric] or 0.0 for name in names]
        bars = axis.bar(places, values, color="#0072B2")
        axis.bar_label(bars, [f"{v:.3g}" if v >= 10.0 else f"{v:.2f}" for v in values], fontsize=8)
        axis.set_ylabel(text)
    axes[0].set_yscale("log")
    axes[2].set_xticks(places, names, fontsize=8, rotation=40, ha="right")
    return figure


def _learning(results: Results) -> "Figure | None":
    """Root mean square of the error over the number of the stop."""
    found = {key: results.samples[key] for key in CHAINS if key in results.samples}
    if not found:
        return None
    figure, (axis,) = panels("Learning from stop to stop", height=4.6)
    for key, samples in found.items():
        text, colour = CHAINS[key]
        stop = samples["stop"].to_numpy(dtype=int)
        squares = np.bincount(stop, samples["stop_error"].to_numpy(dtype=float) ** 2)
        size = np.sqrt(squares / np.bincount(stop))
        axis.plot(np.arange(1, len(size) + 1), size, ".-", color=colour, label=text)
    axis.set_ylim(bottom=0.0)
    label(axis, "stop of the train at the station", "RMS of the stop error / cm")
    legend(axis)
    return figure
