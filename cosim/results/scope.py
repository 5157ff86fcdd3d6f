"""A figure of signals over time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .result import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def scope(run: Run, ports: Sequence[str]) -> "Figure":
    """Return a figure with one axis for each unit among the ports; raise for an unknown port."""
    from matplotlib.figure import Figure

    groups: dict[str, list[str]] = {}
    for port in ports:
        run[port]  # an unknown name is refused before anything is drawn
        groups.setdefault(run.units.get(port, "?"), []).append(port)
    figure = Figure(figsize=(9, 1.2 + 2.6 * len(groups)), layout="constrained")
    axes = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (unit, members) in zip(axes, groups.items(), strict=True):
        for port in members:
            axis.plot(run.time, run[port], label=port, linewidth=1.3)
        axis.set_ylabel({"1": "dimensionless", "?": "no unit"}.get(unit, unit))
        axis.grid(alpha=0.3)
        axis.legend(loc="best")
    axes[-1].set_xlabel("time / s")
    axes[0].set_title(run.name)
    return figure
