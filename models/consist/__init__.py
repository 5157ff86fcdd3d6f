"""Trains as lists of vehicles and couplers: their types, a reader, and the paper's coal train.

The reader, and with it pydantic and a YAML parser, is loaded when it is first used.
"""

from typing import TYPE_CHECKING

from ...base.lazy import lazy
from .coal import c80, coal_train, hxd1, mt2
from .consist import Consist, EndOfTrain
from .draft_gear import Coupler, DraftGear, Points, PowerLaw
from .vehicle import Envelope, RunningResistance, ShoeBrake, Vehicle

if TYPE_CHECKING:
    from .reader import read_consist

__all__ = [
    "Consist",
    "Coupler",
    "DraftGear",
    "EndOfTrain",
    "Envelope",
    "Points",
    "PowerLaw",
    "RunningResistance",
    "ShoeBrake",
    "Vehicle",
    "c80",
    "coal_train",
    "hxd1",
    "mt2",
    "read_consist",
]

__getattr__, __dir__ = lazy(__name__, {"read_consist": "reader"})
