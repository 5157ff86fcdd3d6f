"""The line breaker of an electric train: an emergency opens it, and traction ends at once."""

from typing import Any

import casadi as ca

from .plant import Plant


def line_breaker(plant: Plant, traction: Any) -> Any:
    """Declare the input `trip`; return 0 while it holds the line breaker open, else 1.

    `traction` is the state that gives the tractive force: it becomes 0 when the breaker opens, and
    its derivative must be multiplied by what is returned, so that it stays so. It opens above 0.5
    and closes below 0.4, so that a trip that passes slowly opens it once. Our choice.
    """
    trip = plant.input(
        "trip", unit="1", minimum=0.0, maximum=1.0,
        description="1: line breaker open, no traction (opens above 0.5, closes below 0.4)",
    )  # fmt: skip
    tripped = plant.mode(
        "tripped", minimum=0, maximum=1, output=True,
        description="1 while the line breaker is open, else 0; set by events",
    )  # fmt: skip
    plant.event(
        "open_line_breaker", trip - 0.5, direction="rising", when=tripped == 0,
        changes={tripped: 1, traction: 0.0}, description="trip has come up",
    )  # fmt: skip
    plant.event(
        "close_line_breaker", trip - 0.4, direction="falling", when=tripped == 1,
        changes={tripped: 0}, description="trip has gone",
    )  # fmt: skip
    return ca.if_else(tripped == 1, 0.0, 1.0)
