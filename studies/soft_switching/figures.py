"""The paper's figures 4 to 9, named as there, and two of ours."""

from typing import TYPE_CHECKING, Any

from ..plots import label, legend, panels, present, style
from ..results import Results
from .controllers import LITERAL_PERIODS, literal_name
from .experiments import DELAYS, PULSE_WIDTH, PULSES, delay_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = ("pid_zn", "pid_simc", "fuzzy", "neuron_fixed", "neuron", "composite")
TIME, SPEED = "time / s", "speed / (m/s)"


def figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name."""
    return {
        "fig4_step": _one(results, "step", "Fig. 4: unit step response"),
        "fig5_weights": _weights(results),
        "fig6_pulse": _pulses(results),
        "fig7a_gain": _one(results, "gain_plus_20", "Fig. 7a: unit step, gain +20 %"),
        "fig7b_frequency": _frequency(results),
        "fig8_profile": _profile(results, "Fig. 8: tracking the line profile", 0.0, 195.0),
        "fig9a_traction": _profile(results, "Fig. 9a: traction", 0.0, 12.0),
        "fig9b_cruise": _profile(results, "Fig. 9b: into the cruise", 28.0, 60.0),
        "literal": _literal(results),
        "delay": _delay(results),
    }


def _curves(
    axis: "Axes", results: Results, experiment: str, names: tuple[str, ...] = SHOWN
) -> None:
    there = [c for e, c in results.runs if e == experiment]
    for name in present(names, there):
        run = results.runs[experiment, name]
        axis.plot(run.time, run["train.speed"], **style(name))


def _reference(axis: "Axes", results: Results, experiment: str) -> None:
    run = next((run for (e, _), run in results.runs.items() if e == experiment), None)
    if run is not None:
        line = style("reference") | {"linewidth": 1.0, "linestyle": "--"}
        axis.plot(run.time, run["reference.y"], **line)


def _one(results: Results, experiment: str, title: str) -> "Figure":
    figure, axes = panels(title, 2)
    for axis in axes:
        _reference(axis, results, experiment)
        _curves(axis, results, experiment)
        label(axis, TIME, SPEED)
    axes[0].set_ylim(-0.05, 1.7)
    axes[1].set_ylim(0.94, 1.06)
    axes[1].set_title("the same, near the set point", fontsize=10)
    legend(axes[0], columns=2, where="lower right")
    return figure


def _weights(results: Results) -> "Figure":
    figure, (top, bottom) = panels("Fig. 5: weights of the composite on the unit step", 2)
    run = results.runs.get(("step", "composite"))
    if run is not None:
        top.plot(run.time, run["controller.cf"], color="#009E73", label="Cf, fuzzy")
        top.plot(run.time, run["controller.cnp"], color="#56B4E9", label="Cnp, single neuron")
        for port, text, colour in (
            ("controller.u_fuzzy", "u of fuzzy control", "#009E73"),
            ("controller.u_neuron", "u of the single neuron", "#56B4E9"),
            ("controller.u", "u of the composite", "#D55E00"),
        ):
            bottom.plot(run.time, run[port], color=colour, label=text, linewidth=1.2)
    label(top, TIME, "weight (dimensionless)")
    label(bottom, TIME, "control u (dimensionless)")
    top.set_xlim(0.0, 8.0)
    legend(top, where="center right")
    legend(bottom, where="upper right")
    return figure


def _pulses(results: Results) -> "Figure":
    figure, axes = panels("Fig. 6: pulse of −0.2 at the plant's input, 15 s long", 2, sharex=False)
    for axis, (experiment, at) in zip(axes, PULSES.items(), strict=True):
        axis.axvspan(at, at + PULSE_WIDTH, color="#000000", alpha=0.07, label="pulse")
        _reference(axis, results, experiment)
        _curves(axis, results, experiment)
        axis.set_title(f"pulse at {at:g} s", fontsize=10)
        axis.set_xlim(at - 5.0, at + 50.0)
        axis.set_ylim(0.9, 1.1)
        label(axis, TIME, SPEED)
    legend(axes[1], columns=2, where="lower right")
    return figure


def _frequency(results: Results) -> "Figure":
    figure, axes = panels("Fig. 7b: unit step, natural frequency +20 %", 2)
    texts = ("numerator K·wn² held", "gain K held (the numerator grows)")
    for axis, name, text in zip(axes, ("numerator_held", "gain_held"), texts, strict=True):
        experiment = f"frequency_plus_20_{name}"
        _reference(axis, results, experiment)
        _curves(axis, results, experiment)
        axis.set_title(text, fontsize=10)
        axis.set_ylim(-0.05, 1.7)
        label(axis, TIME, SPEED)
    legend(axes[0], columns=2, where="lower right")
    return figure


def _profile(results: Results, title: str, start: float, end: float) -> "Figure":
    figure, (top, bottom) = panels(title, 2)
    _reference(top, results, "profile")
    _curves(top, results, "profile")
    there = [c for e, c in results.runs if e == "profile"]
    lowest, highest, above, below = 0.0, 1.0, 0.1, -0.1
    for name in present(SHOWN, there):
        run = results.runs["profile", name]
        inside = (run.time >= start) & (run.time <= end)
        gap = run["reference.y"] - run["train.speed"]
        bottom.plot(run.time, gap, **style(name))
        above = max(above, 1.1 * float(gap[inside].max()))
        below = min(below, 1.1 * float(gap[inside].min()))
        speeds = run["train.speed"][inside]
        lowest = float(speeds.min()) if name == there[0] else min(lowest, float(speeds.min()))
        highest = max(highest, float(speeds.max()))
    margin = 0.05 * (highest - lowest)
    top.set_xlim(start, end)
    top.set_ylim(lowest - margin, highest + margin)
    bottom.set_ylim(below, above)
    label(top, TIME, SPEED)
    label(bottom, TIME, "reference − speed / (m/s)")
    legend(top, columns=2, where="lower right" if start or end < 100.0 else "lower center")
    return figure


def _literal(results: Results) -> "Figure":
    figure, axes = panels(
        "The equations as printed, at four sampling periods (unit step)",
        len(LITERAL_PERIODS),
        height=2.4,
    )
    for axis, text in zip(axes, LITERAL_PERIODS, strict=True):
        _reference(axis, results, "step")
        run = results.runs.get(("step", literal_name(text)))
        if run is not None:
            line: dict[str, Any] = style("composite_literal") | {
                "label": f"composite, literal, {text}"
            }
            axis.plot(run.time, run["train.speed"], **line)
        _curves(axis, results, "step", ("composite",))
        axis.set_ylim(-0.8, 2.2)
        axis.set_ylabel(SPEED)
        legend(axis, columns=3, where="lower right")
    axes[-1].set_xlabel(TIME)
    return figure


def _delay(results: Results) -> "Figure":
    figure, axes = panels("Transport delay between controller and train (unit step; ours)", 3)
    metrics: tuple[tuple[str, str], ...] = (
        ("overshoot", "overshoot / %"),
        ("settling_time", "settling time / s"),
        ("iae", "IAE / m"),
    )
    experiments = ["step", *(delay_name(delay) for delay in DELAYS)]
    for axis, (metric, text) in zip(axes, metrics, strict=True):
        for name in SHOWN:
            points: list[tuple[float, Any]] = [
                (results.parameters[experiment][name]["link.time"], value)
                for experiment in experiments
                if (value := results.get(experiment, name, metric)) is not None
            ]
            if points:
                x, y = zip(*sorted(points), strict=True)
                axis.plot(x, y, marker="o", markersize=4, **style(name))
        axis.set_ylabel(text)
        axis.set_ylim(bottom=0.0)
    axes[1].set_title("a missing point: not settled within 60 s", fontsize=9)
    axes[2].set_xlabel("delay / s")
    axes[2].set_ylim(0.0, 30.0)
    axes[2].set_title("cut at 30 m", fontsize=9)
    legend(axes[0], columns=2, where="upper left")
    return figure
