"""Checks of an FMU: structure, behaviour, and its run against a reference."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .checking import check
    from .isolated import check_isolated
    from .report import Report

__all__ = ["Report", "check", "check_isolated"]

__getattr__, __dir__ = lazy(
    __name__, {"Report": "report", "check": "checking", "check_isolated": "isolated"}
)
