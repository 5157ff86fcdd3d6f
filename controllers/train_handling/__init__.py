"""Handling of long trains: force and brake planned ahead, so that coupler forces stay low."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .driver import HandlingDriver
    from .handling import Handling
    from .journey import Aims, Journey
    from .notches import notched
    from .optimum import optimal_handling
    from .reduced import ForceCurve, ReducedBrake, ReducedTrain
    from .rigid import RigidTrain

_HOME = {
    "Aims": "journey",
    "ForceCurve": "reduced",
    "Handling": "handling",
    "HandlingDriver": "driver",
    "Journey": "journey",
    "ReducedBrake": "reduced",
    "ReducedTrain": "reduced",
    "RigidTrain": "rigid",
    "notched": "notches",
    "optimal_handling": "optimum",
}

__all__ = [
    "Aims",
    "ForceCurve",
    "Handling",
    "HandlingDriver",
    "Journey",
    "ReducedBrake",
    "ReducedTrain",
    "RigidTrain",
    "notched",
    "optimal_handling",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
