"""The paper's figures 1 and 4 to 6, named as there, and ours."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...controllers import AdaptiveFuzzy
from ...controllers.adaptive_rules import GAMMA_RULES
from ..comfort import ride_to_standstill
from ..plots import label, legend, panels, present, style
from ..results import Results
from .controllers import FUZZY, LINE_UP
from .line import LIMITS, MARK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TIME, SPEED = "time / s", "speed / (m/s)"
NOTCH = "u / notch"


def figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name."""
    return {
        "fig1_pattern": _pattern(results),
        "fig4_regulation": _regulation(results),
        "fig5_acceleration": _acceleration(results),
        "fig6_factors": _factors(results),
        "factors_over_error": _universe(),
        "gamma": _gamma(),
        "output_readings": _readings(results),
        "notches": _notches(results),
        "runaway": _runaway(results),
    }


def _curves(
    axis: "Axes", results: Results, experiment: str, port: str, names: Any = LINE_UP
) -> None:
    there = [c for e, c in results.runs if e == experiment]
    for name in present(names, there):
        run = results.runs[experiment, name]
        axis.plot(run.time, run[port], **style(name))


def _target(axis: "Axes", value: float) -> None:
    axis.axhline(value, color="#000000", linewidth=1.0, linestyle="--", label="target")


def _regulation(results: Results) -> "Figure":
    figure, axes = panels("Fig. 4: from 10 to 7 m/s (ku = 10 on top of the base notch)", 2)
    for axis in axes:
        _target(axis, 7.0)
        _curves(axis, results, "regulation", "train.speed")
        label(axis, TIME, SPEED)
    axes[0].set_xlim(0.0, 20.0)
    axes[1].set_ylim(6.8, 7.2)
    axes[1].axhspan(6.94, 7.06, color="#000000", alpha=0.07, label="2 % of the step")
    axes[1].set_title("the same, near the target", fontsize=10)
    legend(axes[0], columns=2)
    return figure


def _acceleration(results: Results) -> "Figure":
    figure, axes = panels("Fig. 5: acceleration and control from 10 to 7 m/s", 2)
    for bound in (-1.5, 1.5):
        axes[0].axhline(bound, color="#000000", linewidth=1.0, linestyle=":")
    _curves(axes[0], results, "regulation", "train.acceleration")
    _curves(axes[1], results, "regulation", "controller.u")
    axes[0].set_title("dotted: the bound of comfort, 1.5 m/s²", fontsize=10)
    label(axes[0], TIME, "acceleration / (m/s²)")
    label(axes[1], TIME, NOTCH)
    axes[0].set_xlim(0.0, 20.0)
    legend(axes[0], columns=2, where="lower right")
    return figure


def _factors(results: Results) -> "Figure":
    figure, (top, middle, bottom) = panels("Fig. 6: factors on the way to 10 m/s", 3, height=3.0)
    _target(top, 10.0)
    _curves(top, results, "start", "train.speed", ("fuzzy", "adaptive"))
    run = results.runs.get(("start", "adaptive"))
    if run is not None:
        middle.plot(run.time, run["controller.ke"], color="#0072B2", label="Ke")
        middle.plot(run.time, run["controller.kec"], color="#999999", label="Kec")
        bottom.plot(run.time, run["controller.scale"], color="#D55E00", label="γ·Ku")
    label(top, TIME, SPEED)
    label(middle, TIME, "factor (Ke in s/m, Kec in s²/m)")
    label(bottom, TIME, "γ·Ku / notch")
    top.set_xlim(0.0, 20.0)
    for axis in (top, middle, bottom):
        legend(axis)
    return figure


def _universe() -> "Figure":
    """Show ke and kec over the error, as equations 6 to 9 have them."""
    figure, (top, bottom) = panels("Contraction of the universe (eq. 6 to 9)", 2, height=3.0)
    block = AdaptiveFuzzy()
    errors = np.linspace(-6.0, 6.0, 1201)
    ke = np.array([block.factors(float(e), 1.0)[0] for e in errors])
    top.plot(errors, ke, color="#0072B2", label="Ke")
    bottom.plot(errors, np.minimum(3.0, np.abs(ke * errors)) * np.sign(errors), color="#D55E00",
                label="Ke·e, adaptive")  # fmt: skip
    bottom.plot(errors, np.clip(errors, -3.0, 3.0), color="#009E73", label="e, conventional")
    label(top, "e / (m/s)", "Ke / (s/m)")
    label(bottom, "e / (m/s)", "input of the rules")
    legend(top)
    legend(bottom)
    return figure


def _gamma() -> "Figure":
    """Show γ over both inputs of the rules."""
    figure, (axis,) = panels("γ over the inputs of the rules (table 2)", height=5.0)
    e, ec = np.linspace(-3.0, 3.0, 121), np.linspace(-6.0, 6.0, 121)
    values = np.array([[GAMMA_RULES(float(row), float(column)) for column in e] for row in ec])
    picture = axis.pcolormesh(e, ec, values, cmap="viridis", vmin=0.0, vmax=1.0, rasterized=True)
    figure.colorbar(picture, ax=axis, label="γ")
    axis.grid(visible=False)
    label(axis, "Ke·e", "Kec·ec")
    return figure


def _readings(results: Results) -> "Figure":
    readings = {
        "regulation": "Ku = 10 on top of the base notch",
        "regulation_absolute_10": "Ku = 10, absolute",
        "regulation_absolute_30": "Ku = 30, absolute",
    }
    figure, axes = panels("How u comes from the rules: three readings", 3, height=3.0)
    for axis, (experiment, text) in zip(axes, readings.items(), strict=True):
        _target(axis, 7.0)
        _curves(axis, results, experiment, "train.speed", FUZZY)
        axis.set_title(text, fontsize=10)
        axis.set_ylim(6.4, 8.0)
        axis.set_xlim(0.0, 25.0)
        label(axis, TIME, SPEED)
    legend(axes[0], columns=2, where="upper right")
    return figure


def _notches(results: Results) -> "Figure":
    figure, (top, bottom) = panels("A handle with whole notches (ours)", 2)
    _target(top, 7.0)
    _curves(top, results, "regulation_notches", "train.speed")
    _curves(bottom, results, "regulation_notches", "handle.y", ("fuzzy", "adaptive"))
    top.set_ylim(6.4, 8.0)
    top.set_xlim(0.0, 40.0)
    label(top, TIME, SPEED)
    label(bottom, TIME, "handle / notch")
    legend(top, columns=2)
    legend(bottom)
    return figure


def _pattern(results: Results) -> "Figure":
    figure, (top, bottom) = panels("Fig. 1: one regulation step, then the stopping curve", 2)
    top.plot(*LIMITS.points(0.0, MARK + 30.0), color="#CC0000", label="ATP limit curve")
    there = [c for e, c in results.runs if e == "pattern"]
    for name in present(LINE_UP, there):
        run = results.runs["pattern", name]
        rows = ride_to_standstill(run["train.standstill"]) or slice(None)
        top.plot(run["train.position"][rows], run["train.speed"][rows], **style(name))
        bottom.plot(run["train.position"][rows], run["controller.u"][rows], **style(name))
    run = results.runs.get(("pattern", "adaptive"))
    if run is not None:
        line = style("reference") | {"linewidth": 1.0, "linestyle": "--", "label": "target"}
        top.plot(run["train.position"], run["pattern.target"], **line)
    for axis in (top, bottom):
        axis.axvline(MARK, color="#000000", linewidth=0.8, linestyle=":")
    label(top, "position / m", SPEED)
    label(bottom, "position / m", NOTCH)
    bottom.set_title("dotted: the stopping mark", fontsize=10)
    legend(top, columns=2, where="lower left")
    return figure


def _runaway(results: Results) -> "Figure":
    figure, (top, bottom) = panels(
        "A controller that runs away, with and without ATP (ours)", 2, sharex=False
    )
    top.plot(*LIMITS.points(0.0, 400.0), color="#CC0000", label="ATP limit curve")
    looks = {"atp": ("#0072B2", "with ATP"), "no_atp": ("#E69F00", "without ATP")}
    for name, (colour, text) in looks.items():
        run = results.runs.get(("runaway", name))
        if run is not None:
            top.plot(run["train.position"], run["train.speed"], color=colour, label=text)
        samples = results.samples.get(("runaway", name))
        if samples is not None and len(samples):
            bottom.hist(samples["least_margin"], bins=60, color=colour, alpha=0.8, label=text)
    top.set_title("the first run of each", fontsize=10)
    top.set_xlim(0.0, 400.0)
    top.set_ylim(0.0, 24.0)
    bottom.set_yscale("log")
    bottom.axvline(0.0, color="#CC0000", linewidth=1.0)
    label(top, "position / m", SPEED)
    top.set_xlabel("position / m")
    label(bottom, "least margin to the limit curve in a run / (m/s); below 0: passed", "runs")
    legend(top, where="upper left")
    legend(bottom, where="upper left")
    return figure
