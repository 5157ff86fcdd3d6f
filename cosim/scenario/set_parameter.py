"""A parameter that changes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .change import Change

if TYPE_CHECKING:
    from ..diagram import Diagram


@dataclass(frozen=True, slots=True)
class SetParameter(Change):
    """A block's parameter, spelled "block.parameter", has a new value from `at` (s) on.

    A Python block keeps its state. Of an FMU only parameters with variability "tunable" can
    change, and inputs that are held at a value; its step from the tick at `at` on has them.
    """

    parameter: str
    value: Any

    kind = "set_parameter"

    def __post_init__(self) -> None:
        Change.__post_init__(self)
        self._require_spelling("parameter", "block.parameter")
        object.__setattr__(self, "value", _tuples(self.value))

    def check(self, diagram: "Diagram") -> None:
        """Raise DiagramError or ParameterError if the parameter cannot change so in a run."""
        from .check import check_parameter

        check_parameter(diagram, self.parameter, self.value)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value
