"""Train plants in CasADi: `Plant`, the declarative layer, and one plant a file.

Imported from here: `Plant`, `catalogue`, and every plant by its name. CasADi is loaded with the
first plant, not with the package.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .catalogue import PLANTS, catalogue

if TYPE_CHECKING:
    from .plant import Plant
    from .second_order_train import second_order_train

__all__ = ["Plant", "catalogue", "second_order_train"]


def __getattr__(name: str) -> Any:
    """Load `Plant` and the plants when they are first asked for."""
    if name != "Plant" and name not in PLANTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{name.lower()}", __name__), name)
    globals()[name] = value  # a plant's module bears its name: the function takes precedence
    return value
