"""From a plant to an FMI 2.0 FMU: code generation, build, export, checks against a reference."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .building import build, export
    from .tracing import trace

__all__ = ["build", "export", "trace"]

__getattr__, __dir__ = lazy(
    __name__, {"build": "building", "export": "building", "trace": "tracing"}
)
