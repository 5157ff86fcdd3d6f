"""Controllers, one a file, written once for floats (Python slaves) and CasADi symbols (C, FMUs)."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .fuzzy import Mamdani, Sugeno, Triangles
    from .fuzzy_speed import FuzzySpeed
    from .pid import PID
    from .single_neuron import SingleNeuron
    from .soft_switching import SoftSwitching
    from .tuning import reaction_curve, simc, ziegler_nichols

_HOME = {
    "FuzzySpeed": "fuzzy_speed",
    "Mamdani": "fuzzy",
    "PID": "pid",
    "SingleNeuron": "single_neuron",
    "SoftSwitching": "soft_switching",
    "Sugeno": "fuzzy",
    "Triangles": "fuzzy",
    "reaction_curve": "tuning",
    "simc": "tuning",
    "ziegler_nichols": "tuning",
}

__all__ = [
    "PID",
    "FuzzySpeed",
    "Mamdani",
    "SingleNeuron",
    "SoftSwitching",
    "Sugeno",
    "Triangles",
    "reaction_curve",
    "simc",
    "ziegler_nichols",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
