"""A scenario: a list of changes, from Python or from a TOML file."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import FileError, ParameterError, RailcosimError
from ..clock import Clock, rational
from .change import Change, Fault, first_tick
from .fault import FaultBlock
from .set_delay import SetDelay
from .set_parameter import SetParameter

if TYPE_CHECKING:
    from ..diagram import Diagram

Rewrite = tuple[int, str, str, Any]


@dataclass(frozen=True, slots=True)
class Scenario:
    """What happens to a run at which time; the diagram itself stays as it is.

    Faults on one port act one after the other, in the order of the list. A change that lies behind
    the run's stop never acts; one from before its start has acted already at the first tick.
    """

    changes: Sequence[Change] = ()
    origin: str = field(default="", kw_only=True, repr=False, compare=False)  # a file, in messages

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "changes", tuple(self.changes))
        except TypeError:
            raise ParameterError(
                f"a scenario needs a list of changes, not {self.changes!r}"
            ) from None
        found: dict[Any, int] = {}
        for number, change in enumerate(self.changes, start=1):
            if not isinstance(change, Change):
                raise ParameterError(f"{self._where(number)}: {change!r} is no change")
            if isinstance(change, Fault):
                continue
            what = change.block if isinstance(change, SetDelay) else _parameter(change)
            first = found.setdefault((what, rational(change.at)), number)
            if first != number:
                raise ParameterError(
                    f"{self._where(number)}: change {first} sets '{what}' at "
                    f"{float(change.at):g} s as well"
                )

    @classmethod
    def load(cls, path: str | Path) -> "Scenario":
        """Read a scenario from a TOML file; raise FileError, naming file, change and key."""
        from .tables import read

        path = Path(path)
        try:
            return cls.from_dict(read(path), origin=str(path))
        except ParameterError as error:
            raise FileError(str(error)) from None

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], *, origin: str = "") -> "Scenario":
        """Return the scenario that a file's table {"change": [{"kind": …, …}, …]} describes.

        Raise ParameterError for a mistake; `origin` names the file in messages.
        """
        from .tables import changes

        return cls(changes(table, origin), origin=origin)

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as `from_dict` and a TOML file have it."""
        from .tables import table

        return table(self.changes)

    def check(self, diagram: "Diagram") -> None:
        """Raise DiagramError or ParameterError for the first change that the diagram cannot have.

        The message names the change, and what there is instead of what was not found.
        """
        for number, change in enumerate(self.changes, start=1):
            with self._named(number):
                change.check(diagram)

    # For the engine

    def rewrites(self, clock: Clock) -> list[Rewrite]:
        """Return (tick, block, parameter, value) of the parameters that change, in their order.

        A delay's new time is its parameter "time" in s. Later ones of the same tick hold.
        """
        found = []
        for number, change in enumerate(self.changes):
            if isinstance(change, SetDelay):
                block, name, value = change.block, "time", change.time
            elif isinstance(change, SetParameter):
                block, _, name = change.parameter.partition(".")
                value = change.value
            else:
                continue
            tick = first_tick(clock, change.at)
            found.append(((tick, rational(change.at), number), (tick, block, name, value)))
        return [rewrite for _, rewrite in sorted(found, key=lambda pair: pair[0])]

    def faults(self, clock: Clock) -> dict[str, FaultBlock]:
        """Return the block to put behind each faulty port "block.port" in a run.

        Raise DiagramError for a fault that falls between two ticks.
        """
        ports: dict[str, list[Fault]] = {}
        for number, change in enumerate(self.changes, start=1):
            if isinstance(change, Fault):
                with self._named(number):
                    FaultBlock.of([change], clock)
                ports.setdefault(change.port, []).append(change)
        blocks = {port: FaultBlock.of(faults, clock) for port, faults in ports.items()}
        return {port: block for port, block in blocks.items() if block.stages}

    def delays(self) -> dict[str, list[float]]:
        """Return the new times (s) of every Delay that changes: for how much it must remember."""
        times: dict[str, list[float]] = {}
        for change in self.changes:
            if isinstance(change, SetDelay):
                times.setdefault(change.block, []).append(float(change.time))
        return times

    def _where(self, number: int) -> str:
        change = self.changes[number - 1]
        kind = f" ({change.kind})" if isinstance(change, Change) else ""
        return f"{self.origin or 'scenario'}, change {number}{kind}"

    @contextmanager
    def _named(self, number: int) -> Iterator[None]:
        try:
            yield
        except RailcosimError as error:
            raise type(error)(f"{self._where(number)}: {error}") from None


def _parameter(change: Change) -> str:
    assert isinstance(change, SetParameter)
    return change.parameter
