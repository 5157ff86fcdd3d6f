"""How a diagram is run, as a value."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from ..base.errors import DiagramError, ParameterError
from .algorithms import Master
from .checkpoint import Checkpoint
from .clock import is_time
from .results.observer import Observer
from .results.pacing import Pace
from .results.recording import Recording
from .scenario import Scenario


@dataclass(frozen=True, kw_only=True)
class Options:
    """How a diagram is run; see Diagram.run. Raise ParameterError for what is none of that."""

    start: float | Fraction = 0.0
    algorithm: Master | None = None
    record: Sequence[str] | Recording | None = None
    scenario: Scenario | None = None
    observers: Sequence[Observer] = ()
    pace: Pace | None = None
    engine: str = "auto"
    resume: Checkpoint | None = None

    def __post_init__(self) -> None:
        if not is_time(self.start):
            raise DiagramError(f"start must be a time in s, not {self.start!r}")
        if self.engine not in ("auto", "python", "compiled"):
            raise ParameterError(f"engine is 'auto', 'python' or 'compiled', not {self.engine!r}")
        if isinstance(self.observers, Observer) or not isinstance(self.observers, Sequence):
            raise ParameterError(f"observers must be a list of them, not {self.observers!r}")
        for observer in self.observers:
            if not isinstance(observer, Observer):
                raise ParameterError(f"observers must be Observer(…) values, not {observer!r}")
        for name, kind in (("pace", Pace), ("resume", Checkpoint)):
            value = getattr(self, name)
            if value is not None and not isinstance(value, kind):
                raise ParameterError(f"{name} must be a {kind.__name__}, not {value!r}")
