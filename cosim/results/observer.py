"""Functions that look on while a run goes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ...base.errors import ParameterError
from .recording import port_names, require_every, signal_places


@dataclass(frozen=True, slots=True)
class Observer:
    """Call function(t, *values) at every n-th tick, with time t (s) and the outputs named.

    The call comes when the tick's row is recorded, before anything steps on. A function that
    returns True ends the run there: the result is complete up to this row, and no failure. What
    the function raises ends it as a failure. Ticks are counted from the run's start.
    """

    function: Callable[..., Any]
    ports: Sequence[str] = ()
    every: int = 1

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ParameterError(f"Observer: function must be callable, not {self.function!r}")
        object.__setattr__(self, "ports", port_names(self.ports, "Observer"))
        require_every(self.every, "Observer")

    @property
    def label(self) -> str:
        """The function's name, for messages."""
        return getattr(self.function, "__qualname__", None) or repr(self.function)

    def places(self, signals: Sequence[str], diagram: str) -> list[int]:
        """Return where the ports are among a plan's signals; raise DiagramError if one is not."""
        return signal_places(self.ports, signals, "observe", diagram)
