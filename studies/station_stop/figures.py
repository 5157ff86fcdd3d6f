"""The query table, the stops, and how quiet the control is."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...controllers.fuzzy.relation import LevelDefuzzifier
from ...controllers.stop_rules import E_LEVELS, EC_LEVELS, STOP_RELATION
from ..plots import label, legend, panels
from ..results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = {
    "open_loop": ("constant demand (the driver)", "#000000"),
    "centroid": ("table, centroid", "#009E73"),
    "centroid_ec20": ("table, centroid, EC ±20 cm/s", "#56B4E9"),
    "mean_of_maxima": ("table, mean of maxima", "#E69F00"),
    "smooth": ("smooth (ours)", "#D55E00"),
}


def figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name."""
    return {
        "table3_centroid": _table("centroid", "Table 3, centroid (reconstruction of ours)"),
        "table3_mean_of_maxima": _table(
            "mean_of_maxima", "Table 3, mean of maxima (reconstruction of ours)"
        ),
        "stop_error": _histogram(results),
        "chatter": _chatter(results),
        "brake_force": _brake_force(results),
        "raw_error": _raw(results),
    }


def _table(defuzzify: LevelDefuzzifier, title: str) -> "Figure":
    figure, (axis,) = panels(title, height=6.2)
    values = np.array(STOP_RELATION.table(defuzzify))
    picture = axis.imshow(values, cmap="RdBu_r", vmin=-6.0, vmax=6.0, aspect="auto")
    for i, row in enumerate(values):
        for j, value in enumerate(row):
            colour = "white" if abs(value) > 3.5 else "black"
            axis.text(j, i, f"{value:.1f}", ha="center", va="center", fontsize=8, color=colour)
    axis.set_xticks(range(len(EC_LEVELS.names)), EC_LEVELS.names)
    axis.set_yticks(range(len(E_LEVELS.names)), E_LEVELS.names)
    axis.grid(visible=False)
    figure.colorbar(picture, ax=axis, label="level of U (u = 180 cm + 30 cm · U)")
    label(axis, "EC / level", "E / level")
    return figure


def _histogram(results: Results) -> "Figure":
    figure, (top, bottom) = panels("Where 300 trains stop", 2, sharex=False)
    samples = results.samples.get(("stop", "open_loop"))
    if samples is not None:
        top.hist(samples["stop_error"], bins=40, color=LOOKS["open_loop"][1], alpha=0.7,
                 label=LOOKS["open_loop"][0])  # fmt: skip
    bins = np.linspace(-6.0, 6.0, 61).tolist()
    for name in ("centroid", "mean_of_maxima", "smooth"):
        samples = results.samples.get(("stop", name))
        if samples is not None:
            text, colour = LOOKS[name]
            bottom.hist(np.clip(samples["stop_error"], -6.0, 6.0), bins=bins, color=colour,
                        histtype="step", linewidth=1.6, label=text)  # fmt: skip
    bottom.set_title("what lies beyond ±6 cm is counted in the outer bars", fontsize=10)
    for axis in (top, bottom):
        axis.set_xlabel("stop error / cm")
        axis.set_ylabel("stops")
        legend(axis)
    return figure


def _chatter(results: Results) -> "Figure":
    names = ("centroid", "mean_of_maxima", "smooth")
    figure, axes = panels("Control and acceleration in one stop", 4, height=2.6)
    for axis, name in zip(axes, names, strict=False):
        run = results.runs.get(("stop", name))
        text, colour = LOOKS[name]
        if run is not None:
            axis.step(run.time, run["controller.u"], where="post", color=colour, label=text)
            axes[3].plot(run.time, run["train.acceleration"], color=colour, label=text)
        axis.set_ylim(0.0, 360.0)
        axis.set_ylabel("u / cm")
        legend(axis, where="upper right")
    label(axes[3], "time / s", "acceleration / (m/s²)")
    run = results.runs.get(("stop", "smooth"))
    if run is not None and np.any(run["train.standstill"] == 1):
        axes[3].set_xlim(0.0, float(run.time[run["train.standstill"] == 1][0]) + 1.0)
    axes[3].set_ylim(-0.95, -0.6)
    axes[3].set_title("acceleration, rows every 0.1 s", fontsize=10)
    legend(axes[3], columns=3, where="upper left")
    return figure


def _brake_force(results: Results) -> "Figure":
    figure, (axis,) = panels("Stop error over brake force", height=4.6)
    for name in ("open_loop", "centroid", "mean_of_maxima", "smooth"):
        samples = results.samples.get(("stop", name))
        if samples is not None:
            text, colour = LOOKS[name]
            axis.plot(100.0 * samples["train.effectiveness"], samples["stop_error"], ".",
                      color=colour, markersize=4, label=text)  # fmt: skip
    axis.set_yscale("symlog", linthresh=10.0)
    label(axis, "brake force / % of the demanded", "stop error / cm (linear within ±10)")
    legend(axis, where="lower left")
    return figure


def _raw(results: Results) -> "Figure":
    figure, (axis,) = panels("The raw error E = g − x: where 300 trains stop", height=4.2)
    bins = np.linspace(-20.0, 80.0, 51).tolist()
    for name in ("centroid", "mean_of_maxima"):
        samples = results.samples.get(("raw_error", name))
        if samples is not None:
            text, colour = LOOKS[name]
            _bars(axis, samples["stop_error"].dropna(), bins, colour, text)
    axis.axvspan(-10.0, 10.0, color="#000000", alpha=0.07, label="±10 cm")
    label(axis, "stop error / cm (past the mark: positive)", "stops")
    legend(axis)
    return figure


def _bars(axis: "Axes", values: Any, bins: list[float], colour: str, text: str) -> None:
    clipped = np.clip(values, bins[0], bins[-1])
    axis.hist(clipped, bins=bins, color=colour, histtype="step", linewidth=1.6, label=text)
