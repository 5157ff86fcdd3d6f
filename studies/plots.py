"""The common look of the studies' figures: sizes, colours, labels with units."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, which colour-blind readers tell apart; one for each controller.
COLOURS = {
    "reference": "#000000",
    "pid_zn": "#E69F00",
    "pid_simc": "#A05A00",
    "fuzzy": "#009E73",
    "neuron": "#56B4E9",
    "neuron_fixed": "#999999",
    "composite": "#D55E00",
    "composite_literal": "#CC79A7",
    "universe": "#0072B2",
    "scaling": "#CC79A7",
    "adaptive": "#D55E00",
}
NAMES = {
    "reference": "reference",
    "pid_zn": "PID, Ziegler-Nichols",
    "pid_simc": "PID, SIMC",
    "fuzzy": "fuzzy (conventional)",
    "neuron": "single neuron, K tuned",
    "neuron_fixed": "single neuron, K fixed",
    "composite": "composite (soft switching)",
    "composite_literal": "composite, literal",
    "universe": "variable universe only",
    "scaling": "γ only",
    "adaptive": "adaptive (both)",
}


def panels(
    title: str, rows: int = 1, *, height: float = 4.2, columns: int = 1, sharex: bool = True
) -> "tuple[Figure, list[Axes]]":
    """Return a figure with a title and its axes, top to bottom."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=sharex, squeeze=False).ravel().tolist()
    figure.suptitle(title, fontsize=12)
    for axis in axes:
        axis.grid(alpha=0.3)
    return figure, axes


def label(axis: "Axes", x: str, y: str) -> None:
    """Name both axes, units included."""
    if axis.get_subplotspec() is None or axis.get_subplotspec().is_last_row():  # pyright: ignore
        axis.set_xlabel(x)
    axis.set_ylabel(y)


def style(controller: str) -> dict[str, Any]:
    """Return line style and name of a controller's curve."""
    heavy = controller in ("composite", "adaptive")
    return {
        "color": COLOURS.get(controller),
        "label": NAMES.get(controller, controller),
        "linewidth": 2.0 if heavy else 1.2,
        "zorder": 3 if heavy else 2,
    }


def legend(axis: "Axes", *, columns: int = 1, where: Any = "best") -> None:
    """Show the legend, if anything was drawn."""
    if axis.get_legend_handles_labels()[0]:
        axis.legend(loc=where, ncols=columns, fontsize=9, framealpha=0.9)


def present(names: Iterable[str], available: Iterable[str]) -> list[str]:
    """Return the names that are available, in their own order."""
    there = set(available)
    return [name for name in names if name in there]
