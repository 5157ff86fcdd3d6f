"""Whole runs: energy over running time, the curves, and what the train made of them."""

from typing import TYPE_CHECKING

import numpy as np

from ..plots import label, legend, panels
from ..results import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHADES = ("#000000", "#D55E00", "#E69F00", "#009E73", "#56B4E9", "#0072B2", "#CC79A7")


def line_figures(results: Results) -> "dict[str, Figure | None]":
    """Return the figures by file name, None where the experiments were not run."""
    runs = {e: n for e, n in results.metrics.items() if e == "run" or e.startswith("run_")}
    return {
        "energy": _energy(results),
        "curves": _curves(results),
        **{
            experiment: _run(results, experiment, list(names)) for experiment, names in runs.items()
        },
    }


def _energy(results: Results) -> "Figure | None":
    rows = results.metrics.get("energy")
    if not rows:
        return None
    figure, (axis,) = panels("Energy at the wheel over the running time", height=4.6)
    time = [row["running_time"] or 0.0 for row in rows.values()]
    for metric, text, colour in (
        ("planned_energy", "least energy (optimal control)", "#D55E00"),
        ("coasting_energy", "fast, then coasting", "#0072B2"),
    ):
        energy = [row[metric] or 0.0 for row in rows.values()]
        axis.plot(time, energy, "o-", color=colour, label=text)
    axis.set_ylim(bottom=0.0)
    label(axis, "running time / s", "energy / kWh")
    legend(axis)
    return figure


def _curves(results: Results) -> "Figure | None":
    runs = {n: r for (e, n), r in results.runs.items() if e == "energy"}
    if not runs:
        return None
    figure, axes = panels("Curves of the least energy", 2, height=3.6)
    for (name, run), colour in zip(runs.items(), SHADES, strict=False):
        position = run["curve.position"]
        text = name.replace("time_", "") + " s"
        axes[0].plot(position, 3.6 * run["curve.speed"], color=colour, label=text)
        axes[1].plot(position, run["curve.acceleration"], color=colour, label=text)
    label(axes[0], "position / m", "speed / (km/h)")
    label(axes[1], "position / m", "acceleration / (m/s²)")
    legend(axes[0])
    return figure


def _run(results: Results, experiment: str, names: list[str]) -> "Figure | None":
    runs = {n: results.runs[experiment, n] for n in names if (experiment, n) in results.runs}
    if not runs:
        return None
    title = f"Run to {experiment[4:].capitalize()}" if "_" in experiment else "The run"
    figure, axes = panels(f"{title}, driven by the FMU under ATO and ATP", 2, height=3.6)
    for (name, run), colour in zip(runs.items(), SHADES, strict=False):
        position = run["train.position"]
        text = name.replace("time_", "") + (" s" if name.startswith("time_") else "")
        axes[0].plot(position, 3.6 * run["train.speed"], color=colour, label=text)
        axes[1].plot(position, run["train.acceleration"], color=colour, label=text)
    first = next(iter(runs.values()))
    limit = 3.6 * np.asarray(first["atp.limit"])
    axes[0].plot(first["train.position"], limit, "--", color="#999999", label="ATP's limit")
    axes[0].set_ylim(0.0, 110.0)
    label(axes[0], "position / m", "speed / (km/h)")
    label(axes[1], "position / m", "acceleration / (m/s²)")
    legend(axes[0], columns=2)
    return figure
