"""Checks of an FMU: structure, behaviour, and its run against a reference."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .check import check
    from .report import Report

__all__ = ["Report", "check"]

_HOME = {"check": "check", "Report": "report"}


def __getattr__(name: str) -> Any:
    """Load each name when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value  # 'check' is a module too: the function takes precedence
    return value
