"""Figures of the whole train: all couplers over time, and the envelope along the train (ours)."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..plots import label, legend, panels
from ..results import Results
from .measures import joints_of
from .train_cases import DAMPINGS, INNER_STEPS, inner_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLES = {0.005: ":", 0.002: "-.", 0.001: "-", 0.0005: "--"}
FORMS = {
    "incremental": ("#D55E00", "increments"), "dahl": ("#0072B2", "Dahl"),
    "switching": ("#999999", "switching"),
}  # fmt: skip
WAVES = {
    "front_only": ("#D55E00", "brake wave from the front alone"),
    "end_of_train": ("#0072B2", "and from the end-of-train device"),
    "distributed": ("#009E73", "and from a locomotive in the middle"),
}


def train_figures(results: Results) -> "dict[str, Figure]":
    """Return the figures by file name."""
    return {
        "space_time_violent": space_time(
            results, "violent_start", "incremental_1000us",
            "Violent start: coupler forces, vehicle × time (ours)",
        ),
        "space_time_start_up": space_time(
            results, "start_up", "fuzzy_folded",
            "Start-up on +6 ‰, fuzzy PID: coupler forces, vehicle × time (ours)",
        ),
        "space_time_braking": space_time(
            results, "braking", "fuzzy_folded",
            "Cyclic braking on −6 ‰, fuzzy PID: coupler forces, vehicle × time (ours)",
        ),
        "convergence": _convergence(results),
        "damping": _damping(results),
        "envelope": _envelope(results),
        "brake_wave": _waves(results),
    }  # fmt: skip


def space_time(results: Results, experiment: str, name: str, title: str) -> "Figure":
    """Return the forces (kN) of all couplers as a picture over time and place in the train."""
    figure, (axis,) = panels(title, height=5.0)
    run = results.runs.get((experiment, name))
    if run is not None:
        joints = joints_of(run)
        every = max(1, len(run.time) // 1200)
        forces = np.stack([run[f"train.coupler[{i}].force"][::every] for i in joints]) / 1e3
        most = float(np.abs(forces).max()) or 1.0
        times = run.time[::every]
        picture = axis.imshow(
            forces, aspect="auto", origin="upper", cmap="RdBu_r", vmin=-most, vmax=most,
            extent=(float(times[0]), float(times[-1]), len(joints) + 0.5, 0.5),
            interpolation="nearest",
        )  # fmt: skip
        figure.colorbar(picture, ax=axis, label="coupler force / kN, tension positive")
    axis.grid(visible=False)
    label(axis, "time / s", "coupler, counted from the front")
    return figure


def _extremes(axis: "Axes", run: Any, look: dict[str, Any], text: str) -> None:
    """Draw the extremes over all inner steps where the run has them, else over its rows."""
    joints = joints_of(run)
    for end, of_rows, name in (("highest", np.max, text), ("lowest", np.min, None)):
        ports = [f"train.coupler[{i}].{end}" for i in joints]
        values = [
            (run[port][-1] if port in run.columns else of_rows(run[f"train.coupler[{i}].force"]))
            / 1e3
            for i, port in zip(joints, ports, strict=True)
        ]
        axis.plot(joints, values, label=name, **look)


def _along(axis: "Axes") -> None:
    axis.axhline(0.0, color="#000000", linewidth=0.6)
    label(axis, "coupler, counted from the front", "extreme forces / kN")


def _convergence(results: Results) -> "Figure":
    figure, axes = panels("Violent start: extreme forces at four inner steps (ours)", 3, height=3.0)
    for axis, (form, (colour, text)) in zip(axes, FORMS.items(), strict=True):
        for step in INNER_STEPS:
            run = results.runs.get(("violent_start", f"{form}_{inner_name(step)}"))
            if run is not None:
                look = {"color": colour, "linestyle": STYLES[step], "linewidth": 1.1}
                _extremes(axis, run, look, f"{1e3 * step:g} ms")
        axis.set_title(text, fontsize=10)
        _along(axis)
        legend(axis, columns=4, where="center")
    return figure


def _damping(results: Results) -> "Figure":
    figure, (axis,) = panels("Violent start: damping parallel to the gears (ours)")
    for damping, colour in zip(DAMPINGS, ("#999999", "#E69F00", "#D55E00", "#0072B2"), strict=True):
        run = results.runs.get(("damping", f"damping_{round(damping / 1e3)}"))
        if run is not None:
            _extremes(axis, run, {"color": colour, "linewidth": 1.2}, f"{damping / 1e3:g} kN·s/m")
    _along(axis)
    legend(axis)
    return figure


def _envelope(results: Results) -> "Figure":
    figure, (axis,) = panels("Extreme forces along the train (ours)")
    runs = {
        ("violent_start", "incremental_1000us"): ("#999999", "violent start, level"),
        ("open_loop_start", "open_loop"): ("#E69F00", "40 kN/s on +6 ‰"),
        ("start_up", "fuzzy_folded"): ("#D55E00", "start-up, fuzzy PID"),
        ("braking", "fuzzy_folded"): ("#0072B2", "cyclic braking, fuzzy PID"),
    }
    for key, (colour, text) in runs.items():
        run = results.runs.get(key)
        if run is not None:
            _extremes(axis, run, {"color": colour, "linewidth": 1.4}, text)
    _along(axis)
    axis.set_ylim(-450.0, 2100.0)
    legend(axis, columns=2, where="upper center")
    return figure


def _waves(results: Results) -> "Figure":
    figure, (top, bottom) = panels(
        "100 kPa of service braking from 65 km/h on the level (ours)", 2, sharex=False
    )
    for name, (colour, text) in WAVES.items():
        run = results.runs.get(("brake_wave", name))
        if run is not None:
            _extremes(top, run, {"color": colour, "linewidth": 1.4}, text)
            for port in ("coupler_maximum", "coupler_minimum"):
                bottom.plot(run.time, run[f"train.{port}"] / 1e3, color=colour, linewidth=1.2,
                            label=text if port == "coupler_maximum" else None)  # fmt: skip
    _along(top)
    top.set_xlabel("coupler, counted from the front")
    bottom.set_xlabel("time / s")
    bottom.set_ylabel("greatest and least force / kN")
    legend(top, where="lower right")
    return figure
