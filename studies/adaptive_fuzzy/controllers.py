"""The controllers that the study compares, by the names used in its results."""

from dataclasses import replace

from ...controllers import PID, AdaptiveFuzzy
from ...cosim import Block

PERIOD = 0.02  # s; our choice

# Ziegler-Nichols on the identified plant's reaction curve, as in the soft-switching study.
PID_ZN = PID(kp=6.65, ti=2.83, td=0.707, period=PERIOD)

# The full controller and its three reduced forms.
FUZZY: dict[str, AdaptiveFuzzy] = {
    "fuzzy": AdaptiveFuzzy.conventional(period=PERIOD),
    "universe": AdaptiveFuzzy.variable_universe(period=PERIOD),
    "scaling": AdaptiveFuzzy.scaled(period=PERIOD),
    "adaptive": AdaptiveFuzzy(period=PERIOD),
}
LINE_UP: dict[str, PID | AdaptiveFuzzy] = {"pid_zn": PID_ZN, **FUZZY}


def absolute(ku: float) -> dict[str, Block]:
    """Return the fuzzy controllers without the base notch, u being the rules' alone."""
    return {name: replace(block, base_gain=0.0, ku=ku) for name, block in FUZZY.items()}


def wide(limit: float) -> dict[str, Block]:
    """Return all controllers with |u| up to a wider limit, in notches."""
    return {name: replace(block, limits=(-limit, limit)) for name, block in LINE_UP.items()}
