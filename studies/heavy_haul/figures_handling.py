"""The handlings of the rolling line (ours): speed, force, and extreme coupler forces."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..plots import label, legend, panels
from ..results import Results
from .recorded import SIZE
from .rolling import rolling_section

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = {
    "pid": ("#999999", "PID on a held speed"),
    "fuzzy_pid": ("#E69F00", "fuzzy PID on a held speed"),
    "plan": ("#D55E00", "planned (ours)"),
    "plan_notched": ("#0072B2", "planned, in notches (ours)"),
}


def handling_figure(results: Results) -> "Figure":
    """Return the runs over the place of the train's front."""
    figure, (speed, force, couplers) = panels("Handling on a rolling line (ours)", 3, height=3.4)
    for name, (colour, text) in LOOKS.items():
        run = results.runs.get(("handling", name))
        if run is None:
            continue
        place = run["train.position"] / 1e3
        look = {"color": colour, "linewidth": 1.2}
        speed.plot(place, 3.6 * run["train.speed"], label=text, **look)
        force.plot(place, run["train.group[1].applied"] / 1e3, label=text, **look)
        for extreme in (np.max, np.min):
            couplers.plot(place, extreme(_forces(run), axis=0), **look)
    _heights(speed)
    label(speed, "", "speed / (km/h)")
    label(force, "", "force of the locomotives / kN")
    label(couplers, "place of the train's front / km", "extreme coupler forces / kN")
    speed.set_ylim(20.0, 85.0)
    legend(force, columns=2, where="upper right")
    return figure


def _forces(run: Any) -> Any:
    return np.stack([run[f"train.coupler[{i}].force"] for i in range(1, SIZE)]) / 1e3


def _heights(axis: "Axes") -> None:
    """Show the line's height behind an axis."""
    section = rolling_section()
    places = np.linspace(0.0, section.length, 600)
    heights = [section.elevation(float(place)) for place in places]
    behind = axis.twinx()
    behind.fill_between(places / 1e3, heights, -8.0, color="#000000", alpha=0.12, linewidth=0.0)
    behind.set_ylim(-8.0, 40.0)
    behind.set_ylabel("height / m (grey)")
