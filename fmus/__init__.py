"""From a plant to an FMI 2.0 FMU: code generation, build, export, checks against a reference."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .build import build, export
    from .trace import trace

__all__ = ["build", "export", "trace"]

_HOME = {"build": "build", "export": "build", "trace": "trace"}


def __getattr__(name: str) -> Any:
    """Load the exporter, and CasADi with it, when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value  # 'build' is a module too: the function takes precedence
    return value
