"""Controllers, one a file, written once for floats (Python slaves) and CasADi symbols (C, FMUs)."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .adaptive_fuzzy import AdaptiveFuzzy
    from .atp import ATP
    from .braking_pattern import BrakingPattern
    from .fuzzy import Gaussians, Levels, Mamdani, Relation, Sugeno, Triangles
    from .fuzzy_speed import FuzzySpeed
    from .holding_brake import HoldingBrake
    from .limit_curve import LimitCurve
    from .pid import PID
    from .query_table import QueryTable
    from .single_neuron import SingleNeuron
    from .smooth_stop import SmoothStop
    from .soft_switching import SoftSwitching
    from .stop_prediction import StopPrediction
    from .tuning import reaction_curve, simc, ziegler_nichols

_HOME = {
    "ATP": "atp",
    "AdaptiveFuzzy": "adaptive_fuzzy",
    "BrakingPattern": "braking_pattern",
    "FuzzySpeed": "fuzzy_speed",
    "Gaussians": "fuzzy",
    "HoldingBrake": "holding_brake",
    "Levels": "fuzzy",
    "LimitCurve": "limit_curve",
    "Mamdani": "fuzzy",
    "PID": "pid",
    "QueryTable": "query_table",
    "Relation": "fuzzy",
    "SingleNeuron": "single_neuron",
    "SmoothStop": "smooth_stop",
    "SoftSwitching": "soft_switching",
    "StopPrediction": "stop_prediction",
    "Sugeno": "fuzzy",
    "Triangles": "fuzzy",
    "reaction_curve": "tuning",
    "simc": "tuning",
    "ziegler_nichols": "tuning",
}

__all__ = [
    "ATP",
    "PID",
    "AdaptiveFuzzy",
    "BrakingPattern",
    "FuzzySpeed",
    "Gaussians",
    "HoldingBrake",
    "Levels",
    "LimitCurve",
    "Mamdani",
    "QueryTable",
    "Relation",
    "SingleNeuron",
    "SmoothStop",
    "SoftSwitching",
    "StopPrediction",
    "Sugeno",
    "Triangles",
    "reaction_curve",
    "simc",
    "ziegler_nichols",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
