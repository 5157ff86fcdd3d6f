"""Controllers, one a file, written once for floats (Python slaves) and CasADi symbols (C, FMUs)."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

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


def __getattr__(name: str) -> Any:
    """Load each name when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)
