"""Predictive stop: the model's parameters are estimated as the train brakes, and learnt by stops.

All of this is our choice; the precise braking paper has nothing like it.
"""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .braking_model import BrakingModel, Plan, Probe, Samples
    from .cheap_stop import trimmed
    from .controller import PredictiveStop
    from .learning import Learning
    from .prior import PARAMETERS, Prior
    from .probing import ProbingStop

_HOME = {
    "PARAMETERS": "prior",
    "BrakingModel": "braking_model",
    "Learning": "learning",
    "Plan": "braking_model",
    "PredictiveStop": "controller",
    "Prior": "prior",
    "Probe": "braking_model",
    "ProbingStop": "probing",
    "Samples": "braking_model",
    "trimmed": "cheap_stop",
}

__all__ = [
    "PARAMETERS",
    "BrakingModel",
    "Learning",
    "Plan",
    "PredictiveStop",
    "Prior",
    "Probe",
    "ProbingStop",
    "Samples",
    "trimmed",
]

__getattr__, __dir__ = lazy(__name__, _HOME)
