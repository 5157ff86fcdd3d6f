"""The gradients of a line, as the parameters of a plant that runs on it."""

from typing import Any

import casadi as ca

from .line.line import STEEPEST
from .plant import Plant

NOWHERE = 1e9  # m; a stretch that begins there never comes


def declare_gradients(plant: Plant, count: int) -> tuple[Any, Any]:
    """Declare up to `count` stretches; return where they begin (m) and by how much they turn (‰).

    Stretch k begins at `gradient_position[k]` with the slope `gradient[k]`; before the first the
    first one holds. Those that are not set begin at 1e9 m, where no train comes.
    """
    begins = plant.parameter(
        "gradient_position", [0.0, *[NOWHERE] * (count - 1)], unit="m", size=count, nominal=1000.0,
        description="where a stretch begins, in rising order; those that are not used at 1e9 m",
    )  # fmt: skip
    slopes = plant.parameter(
        "gradient", 0.0, unit="1", size=count, nominal=1.0, minimum=-STEEPEST, maximum=STEEPEST,
        description="slope of the stretch in per mille, uphill positive",
    )  # fmt: skip
    change = plant.dependent(
        "gradient_change", slopes - ca.vertcat(0.0, *ca.vertsplit(slopes)[:-1]), unit="1",
        description="slope over that of the stretch before, in per mille",
    )  # fmt: skip
    return begins, change
