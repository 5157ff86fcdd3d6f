"""The paper's figures 5 to 8, from what the study measured; the others stand in two files more."""

from typing import TYPE_CHECKING

import numpy as np

from ..plots import label, legend, panels
from ..results import Results
from .figures_line import line_figures
from .figures_spread import spread_figures
from .stations import STATIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOKS = {
    "pid_m0": ("PID", "#E69F00"),
    "smc_m0": ("SMC", "#56B4E9"),
    "smarc_m0": ("SMARC", "#009E73"),
    "smarc_dob_m2": ("SMARC, prediction and observer", "#D55E00"),
    "predictive_v6": ("predictive stop (ours)", "#0072B2"),
}
MODELS = {
    "figure5": ("coarse", "Figure 5: the existing model on a synthetic log"),
    "figure6": ("precise", "Figure 6: the precise model on the same log"),
}


def figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name: those whose experiments were run."""
    found = {name: _log(results, *about) for name, about in MODELS.items()}
    found["figure7"] = _speeds(results)
    found["figure8"] = _speed_errors(results)
    found |= spread_figures(results) | line_figures(results)
    return {name: figure for name, figure in found.items() if figure is not None}


def _log(results: Results, model: str, title: str) -> "Figure | None":
    run = results.runs.get(("fidelity", model))
    if run is None:
        return None
    figure, axes = panels(title, 2, height=3.2)
    measured, modelled = run["log.speed"], run["model.speed"]
    axes[0].plot(run.time, measured, color="#000000", label="log")
    axes[0].plot(run.time, modelled, color="#D55E00", label=f"{model} model")
    axes[1].plot(run.time, 100.0 * (modelled - measured), color="#D55E00", label="model − log")
    axes[1].axhline(0.0, color="#000000", linewidth=0.8)
    label(axes[0], "time / s", "speed / (m/s)")
    label(axes[1], "time / s", "error / (cm/s)")
    for axis in axes:
        legend(axis)
    return figure


def _speeds(results: Results) -> "Figure | None":
    """Speed over position at the first station."""
    runs = {name: results.runs.get((STATIONS[0].key, name)) for name in LOOKS}
    if not any(runs.values()):
        return None
    figure, axes = panels(f"Figure 7: the stop at {STATIONS[0].name}, nominal", 2, sharex=False)
    for name, run in runs.items():
        if run is None:
            continue
        text, colour = LOOKS[name]
        position, speed = run["train.position"], run["train.speed"]
        axes[0].plot(position, speed, color=colour, label=text)
        near = position > -8.0
        axes[1].plot(100.0 * position[near], speed[near], color=colour, label=text)
    axes[1].axvline(0.0, color="#000000", linewidth=0.8, label="mark")
    axes[0].set_xlabel("position / m")
    axes[1].set_xlabel("position / cm (the last 8 m)")
    for axis in axes:
        axis.set_ylabel("speed / (m/s)")
        legend(axis)
    return figure


def _speed_errors(results: Results) -> "Figure | None":
    """Command and speed error over time at the first station."""
    from ...controllers import BrakingProfile
    from .loop import START

    runs = {name: results.runs.get((STATIONS[0].key, name)) for name in LOOKS}
    if not any(runs.values()):
        return None
    profile = BrakingProfile(lead_in=0.0)
    lead_in = (profile.start_position - START) / profile.speed
    figure, axes = panels("Figure 8: speed error and command, nominal", 2, height=3.4)
    for name, run in runs.items():
        if run is None:
            continue
        text, colour = LOOKS[name]
        end = int(np.argmax(run["train.standstill"] == 1)) or len(run.time)
        time = run.time[:end]
        if not name.startswith("predictive"):  # which has no target curve
            target = np.array([float(profile.at(t - lead_in).speed) for t in time])
            error = 100.0 * (run["train.speed"][:end] - target)
            axes[0].plot(time, error, color=colour, label=text)
        axes[1].plot(time, run["controller.command"][:end], color=colour, label=text)
    label(axes[0], "time / s", "speed error / (cm/s)")
    label(axes[1], "time / s", "command / (m/s²)")
    for axis in axes:
        legend(axis)
    return figure
