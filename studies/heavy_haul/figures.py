"""The paper's figures 3, 4, 5, 7 and 8, named as there, and those of control that are ours."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...controllers.fuzzy_pid_rules import END, INPUT, OUTPUT
from ...models.consist import coal_train
from ..plots import label, legend, panels, present
from ..results import Results
from .figures_handling import handling_figure
from .figures_train import train_figures
from .gear_cases import WATCHED, stretch_and_force
from .recorded import SHOWN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TIME, FORCE = "time / s", "coupler force / kN"
LOOKS: dict[str, tuple[str, str]] = {
    "pid": ("#999999", "PID, fixed gains"),
    "pid_fast": ("#56B4E9", "PID, gains twice as high"),
    "pid_feed_forward": ("#0072B2", "PID with feed-forward"),
    "fuzzy_literal": ("#CC79A7", "fuzzy, literal, NL/PL ±6"),
    "fuzzy_literal_little": ("#E69F00", "fuzzy, literal, NL/PL ±2"),
    "fuzzy_folded": ("#D55E00", "fuzzy, folded"),
}
FORMS = {
    "incremental": ("#D55E00", "increments (reference)"),
    "dahl": ("#0072B2", "Dahl form"),
    "switching": ("#999999", "raw switching"),
}
COUPLERS = ("#000000", "#D55E00", "#0072B2", "#009E73")


def figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name."""
    return {
        "fig3_gear_loop": _gear_loop(results),
        "fig4_inputs": _members("Fig. 4: membership functions of e and ec", INPUT, "e, ec"),
        "fig5_outputs": _members(
            "Fig. 5: membership functions of ΔKp, ΔKi and ΔKd (σ = 0.85, ours)", OUTPUT,
            "ΔKp, ΔKi, ΔKd",
        ),
        "fig7_start_up": _couplers(results, "start_up", SHOWN, "Fig. 7: start-up on +6 ‰"),
        "fig8_braking": _couplers(results, "braking", (1, 4), "Fig. 8: cyclic braking on −6 ‰"),
        "errors": _errors(results),
        "steps": _steps(results),
        "speed": _speed(results),
        "gains": _gains(results),
        **train_figures(results),
        "handling": handling_figure(results),
    }  # fmt: skip


def _gear_loop(results: Results) -> "Figure":
    figure, (axis,) = panels(f"Fig. 3: force over stroke of coupler {WATCHED}'s draft gears")
    joint = coal_train().couplers[WATCHED - 1]
    strokes = np.linspace(0.0, 0.12, 200)
    loading = np.array([joint.gear.force(float(e)) for e in strokes]) / 1e3
    free = 0.5 * joint.slack
    for ratio, text in ((1.0, "loading curve fu"), (joint.gear.unloading_ratio, "unloading fl")):
        for sign in (1.0, -1.0):
            axis.plot(
                1e3 * sign * (free + strokes), sign * ratio * loading, color="#000000",
                linewidth=0.8, linestyle="--" if ratio == 1.0 else ":",
                label=text if sign > 0.0 else None,
            )  # fmt: skip
    for name, (colour, text) in FORMS.items():
        run = results.runs.get(("gear_loop", name))
        if run is not None:
            stretch, force = stretch_and_force(run)
            raw = name == "switching"
            axis.plot(
                1e3 * stretch, force / 1e3, color=colour, label=text, alpha=0.4 if raw else 1.0,
                linewidth=0.5 if raw else 1.4, zorder=1 if raw else 3,
            )  # fmt: skip
    axis.set_xlim(-60.0, 115.0)
    axis.set_ylim(-250.0, 850.0)
    label(axis, "stretch of the joint / mm", "force of the gears, without damping / kN")
    legend(axis, where="upper left")
    return figure


def _members(title: str, sets: Any, what: str) -> "Figure":
    figure, (axis,) = panels(title, height=3.2)
    places = np.linspace(-END, END, 601)
    degrees = np.array([sets.degrees(sets.position(float(x))) for x in places])
    for k, name in enumerate(sets.labels):
        axis.plot(places, degrees[:, k], label=name)
    label(axis, f"{what} on the universe ±6 (dimensionless)", "degree (dimensionless)")
    legend(axis, columns=7, where="upper center")
    axis.set_ylim(0.0, 1.25)
    return figure


def _target(axis: "Axes", results: Results, experiment: str, scale: float) -> None:
    run = next((run for (e, _), run in results.runs.items() if e == experiment), None)
    if run is not None:
        axis.plot(run.time, run["target.y"] * scale, color="#000000", linewidth=1.0,
                  linestyle="--", label="target of coupler 2", zorder=4)  # fmt: skip


def _couplers(results: Results, experiment: str, couplers: tuple[int, ...], title: str) -> "Figure":
    names = ("fuzzy_folded", "fuzzy_literal_little")
    figure, axes = panels(title, 2)
    for axis, name in zip(axes, names, strict=True):
        run = results.runs.get((experiment, name))
        if run is not None:
            for number in couplers:
                axis.plot(
                    run.time, run[f"train.coupler[{number}].force"] / 1e3, linewidth=1.2,
                    color=COUPLERS[number - 1], label=f"coupler {number}",
                )  # fmt: skip
        _target(axis, results, experiment, 1e-3)
        axis.set_title(LOOKS[name][1], fontsize=10)
        label(axis, TIME, FORCE)
    legend(axes[0], columns=2, where="best")
    return figure


def _curves(
    axis: "Axes", results: Results, experiment: str, of: Any, names: tuple[str, ...]
) -> None:
    there = [c for e, c in results.runs if e == experiment]
    for name in present(names, there):
        run = results.runs[experiment, name]
        colour, text = LOOKS[name]
        axis.plot(run.time, of(run), color=colour, label=text, linewidth=1.2)


def _error(run: Any) -> Any:
    return (run["target.y"] - run["train.coupler[2].force"]) / 1e3


def _errors(results: Results) -> "Figure":
    names = ("pid", "pid_fast", "pid_feed_forward", "fuzzy_literal_little", "fuzzy_folded")
    figure, (top, bottom) = panels("Error of the coupler force (ours)", 2, sharex=False)
    for axis, experiment, text in (
        (top, "start_up", "start-up"), (bottom, "braking", "cyclic braking"),
    ):  # fmt: skip
        _curves(axis, results, experiment, _error, names)
        axis.set_ylim(-60.0, 60.0)
        axis.set_title(text, fontsize=10)
        axis.set_xlabel(TIME)
        axis.set_ylabel("target − coupler 2 / kN")
    legend(top, columns=2, where="upper right")
    return figure


def _steps(results: Results) -> "Figure":
    names = ("pid", "pid_fast", "pid_feed_forward", "fuzzy_literal_little", "fuzzy_folded")
    figure, axes = panels("Steps of ±80 kN on +6 ‰ (ours)", 2, sharex=False)
    for axis, (begin, end), text in zip(
        axes, ((55.0, 110.0), (59.5, 64.0)), ("all four", "the first one"), strict=True
    ):
        _curves(axis, results, "steps", lambda run: run["train.coupler[2].force"] / 1e3, names)
        _target(axis, results, "steps", 1e-3)
        axis.set_xlim(begin, end)
        axis.set_ylim(845.0, 1065.0)
        axis.set_title(text, fontsize=10)
        axis.set_xlabel(TIME)
        axis.set_ylabel(FORCE)
    legend(axes[0], columns=2, where="lower left")
    return figure


def _speed(results: Results) -> "Figure":
    names = ("pid", "fuzzy_folded")
    figure, axes = panels("Tracking a speed (ours)", 2, sharex=False)
    for axis, experiment, text in zip(
        axes, ("start_up_speed", "braking_speed"), ("start-up on +6 ‰", "braking on −6 ‰"),
        strict=True,
    ):  # fmt: skip
        _curves(axis, results, experiment, lambda run: 3.6 * run["train.speed"], names)
        run = next((run for (e, _), run in results.runs.items() if e == experiment), None)
        if run is not None:
            axis.plot(run.time, 3.6 * run["target.y"], color="#000000", linewidth=1.0,
                      linestyle="--", label="target")  # fmt: skip
        axis.set_title(text, fontsize=10)
        axis.set_xlabel(TIME)
        axis.set_ylabel("speed of the first vehicle / (km/h)")
    legend(axes[0], where="lower right")
    return figure


def _gains(results: Results) -> "Figure":
    figure, axes = panels("The gains at start-up (ours)", 3, height=2.6)
    fixed = {"kp": 0.8, "ki": 0.003, "kd": 4.0}
    for axis, (gain, value) in zip(axes, fixed.items(), strict=True):
        for name in ("fuzzy_literal", "fuzzy_literal_little", "fuzzy_folded"):
            run = results.runs.get(("start_up", name))
            if run is not None:
                colour, text = LOOKS[name]
                axis.plot(run.time, run[f"controller.{gain}"], color=colour, label=text,
                          linewidth=1.0)  # fmt: skip
        axis.axhline(value, color="#000000", linewidth=0.8, linestyle="--", label="fixed gain")
        label(axis, TIME, f"K{gain[1]} per sample")
    legend(axes[0], columns=2, where="upper right")
    return figure
