"""Measured and modelled speeds of some brakings."""

from typing import TYPE_CHECKING

import numpy as np

from ..plots import label, legend, panels
from .report import Report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = {
    "precise": ("precise", "#D55E00", "-"),
    "coarse": ("coarse, fitted", "#0072B2", "--"),
    "published": ("coarse as used", "#56B4E9", ":"),
}
MOST = 4  # brakings shown


def speeds_figure(report: Report, *, most: int = MOST) -> "Figure":
    """Return measured and modelled speeds over time.

    Shown are brakings from the best to the worst of the precise model, evenly by rank.
    """
    best = report.best
    order = np.argsort(best.rmse_by_log)
    ranks = np.linspace(0, len(order) - 1, min(most, len(order))).round().astype(int)
    shown = order[np.unique(ranks)]
    columns = 2 if len(shown) > 1 else 1
    rows = -(-len(shown) // columns)
    figure, axes = panels(
        "Measured and modelled speed, from the first brake command to the stop",
        rows, height=3.4, columns=columns, sharex=False,
    )  # fmt: skip
    for axis, number in zip(axes, shown, strict=False):
        braking = best.model.brakings[number]
        axis.plot(braking.time, braking.speed, ".", color="black", markersize=3, label="measured")
        for fit in (report.precise, report.coarse, report.published):
            if fit is not None:
                key = fit.method if fit.method == "published" else fit.model.name
                name, colour, line = LOOKS[key]
                text = f"{name}, {fit.rmse_by_log[number]:.1f} cm/s"
                axis.plot(
                    braking.time, fit.model.trajectory(fit.free, int(number)), line, color=colour,
                    linewidth=1.6, label=text,
                )  # fmt: skip
        if braking.onset is not None:
            axis.axvline(braking.onset, color="#999999", linewidth=1.0, label="air brake on")
        axis.set_title(braking.name, fontsize=10)
        label(axis, "time / s", "speed / m/s")
        legend(axis, where="upper right")
    for axis in axes[len(shown) :]:
        axis.remove()
    return figure
