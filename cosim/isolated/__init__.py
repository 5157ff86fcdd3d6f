"""FMUs in processes of their own: one that crashes, hangs or exits takes nothing else with it."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .instance import IsolatedInstance

__all__ = ["IsolatedInstance"]

__getattr__, __dir__ = lazy(__name__, {"IsolatedInstance": "instance"})
