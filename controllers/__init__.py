"""Controllers, one a file, written once for floats (Python slaves) and CasADi symbols (C, FMUs)."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .adaptive_fuzzy import AdaptiveFuzzy
    from .ato import ATO
    from .atp import ATP
    from .brake_model import BrakeModel
    from .braking_pattern import BrakingPattern
    from .braking_profile import BrakingProfile
    from .delay_predictor import DelayPredictor
    from .disturbance_observer import DisturbanceObserver
    from .fuzzy import Gaussians, Levels, Mamdani, Relation, Sugeno, Triangles
    from .fuzzy_pid import FuzzyPID
    from .fuzzy_speed import FuzzySpeed
    from .holding_brake import HoldingBrake
    from .limit_curve import LimitCurve
    from .odometry import Odometry
    from .pid import PID
    from .position_pid import PositionPID
    from .predictive_stop import PredictiveStop
    from .query_table import QueryTable
    from .sample_pid import SamplePID
    from .single_neuron import SingleNeuron
    from .sliding_mode import SlidingMode
    from .smarc import SMARC
    from .smooth_stop import SmoothStop
    from .soft_switching import SoftSwitching
    from .speed_pid import SpeedPID
    from .stop_command import StopCommand
    from .stop_prediction import StopPrediction
    from .tracked_stop import TrackedStop
    from .train_handling import HandlingDriver
    from .tuning import reaction_curve, simc, ziegler_nichols

_HOME = {
    "ATO": "ato",
    "ATP": "atp",
    "AdaptiveFuzzy": "adaptive_fuzzy",
    "BrakeModel": "brake_model",
    "BrakingPattern": "braking_pattern",
    "BrakingProfile": "braking_profile",
    "DelayPredictor": "delay_predictor",
    "DisturbanceObserver": "disturbance_observer",
    "FuzzyPID": "fuzzy_pid",
    "FuzzySpeed": "fuzzy_speed",
    "Gaussians": "fuzzy",
    "HandlingDriver": "train_handling",
    "HoldingBrake": "holding_brake",
    "Levels": "fuzzy",
    "LimitCurve": "limit_curve",
    "Mamdani": "fuzzy",
    "Odometry": "odometry",
    "PID": "pid",
    "PositionPID": "position_pid",
    "PredictiveStop": "predictive_stop",
    "QueryTable": "query_table",
    "Relation": "fuzzy",
    "SMARC": "smarc",
    "SamplePID": "sample_pid",
    "SingleNeuron": "single_neuron",
    "SlidingMode": "sliding_mode",
    "SmoothStop": "smooth_stop",
    "SoftSwitching": "soft_switching",
    "SpeedPID": "speed_pid",
    "StopCommand": "stop_command",
    "StopPrediction": "stop_prediction",
    "Sugeno": "fuzzy",
    "TrackedStop": "tracked_stop",
    "Triangles": "fuzzy",
    "reaction_curve": "tuning",
    "simc": "tuning",
    "ziegler_nichols": "tuning",
}

__all__ = [
    "ATO",
    "ATP",
    "PID",
    "SMARC",
    "AdaptiveFuzzy",
    "BrakeModel",
    "BrakingPattern",
    "BrakingProfile",
    "DelayPredictor",
    "DisturbanceObserver",
    "FuzzyPID",
    "FuzzySpeed",
    "Gaussians",
    "HandlingDriver",
    "HoldingBrake",
    "Levels",
    "LimitCurve",
    "Mamdani",
    "Odometry",
    "PositionPID",
    "PredictiveStop",
    "QueryTable",
    "Relation",
    "SamplePID",
    "SingleNeuron",
    "SlidingMode",
    "SmoothStop",
    "SoftSwitching",
    "SpeedPID",
    "StopCommand",
    "StopPrediction",
    "Sugeno",
    "TrackedStop",
    "Triangles",
    "reaction_curve",
    "simc",
    "ziegler_nichols",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
