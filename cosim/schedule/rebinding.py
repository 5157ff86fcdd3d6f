"""The schedule of a plan from that of another one, where the blocks' parameters alone differ.

Making it anew would take longer than many a run. Here only what parameters decide is made: start
values, delays' samples, and the functions of blocks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import MethodType
from typing import Any

from ..blocks.delay import Delay
from ..coupling.coupling import Coupling
from ..plan import Plan
from .delays import past
from .dividing import divided_values, jumps
from .forms import Values, apart, pieces
from .operations import Advance, Call, Divide, Keep, Move, Past, Read, Record
from .schedule import Schedule, starts

_Source = Callable[[Plan], Values | None]  # None: the form is another one
_NONE: Values = ()


@dataclass(frozen=True)
class Rebinding:
    """A schedule of so many pieces, and what gives values from another plan, with their places.

    `jumps` are the delays that divide ticks, in groups, in their order there. `division` are the
    operations of such ticks, if there are any, `at` their place, and `forms` those of their pieces.
    """

    schedule: Schedule
    sources: tuple[tuple[_Source, list[int]], ...]
    count: int
    jumps: tuple[tuple[int, ...], ...]
    division: Divide | None
    at: int
    forms: tuple[Any, ...]

    @classmethod
    def of(cls, schedule: Schedule, found: Sequence[Any]) -> "Rebinding | None":
        """Return the rebinding, or None for a schedule whose form may hang on parameters.

        `found` are its pieces.
        """
        plan = schedule.plan
        if schedule.coupling.is_always or not all(map(_is_plain, plan.nodes)):
            return None
        places = {node.name: i for i, node in enumerate(plan.nodes)}
        sources: dict[int, tuple[_Source, list[int]]] = {}
        division = next((one for one in found if isinstance(one, Divide)), None)
        at = 0 if division is None else found.index(division)
        inside = () if division is None else _inside(division)
        for n, piece in enumerate(found):
            if at <= n < at + len(inside) or isinstance(piece, Read | Advance | Move | Record):
                continue
            if id(piece) not in sources:  # some come several times
                source = _source(piece, plan, places)
                if source is None:
                    return None
                sources[id(piece)] = source, []
            sources[id(piece)][1].append(n)
        forms = tuple(apart(piece)[0] for piece in inside)
        groups = tuple(jumps(plan).values())
        return cls(schedule, tuple(sources.values()), len(found), groups, division, at, forms)

    def to(self, plan: Plan) -> tuple[Schedule, list[Values]] | None:
        """Return the schedule of a plan and its pieces' values, or None if it has another form."""
        former = self.schedule.plan
        same = all(getattr(plan, name) is getattr(former, name) for name in _WIRING)
        if not same or not all(map(_is_plain, plan.nodes)):
            return None
        inside = self._divided(plan)
        if inside is None:
            return None
        values = [_NONE] * self.count
        values[self.at : self.at + len(inside)] = inside
        for source, places in self.sources:
            found = source(plan)
            if found is None:
                return None
            for at in places:
                values[at] = found
        coupling = Coupling(plan, self.schedule.coupling.fmus.instances)
        start = (*starts(plan), *self.schedule.start[len(plan.nodes) :])
        return replace(self.schedule, plan=plan, start=start, coupling=coupling), values

    def _divided(self, plan: Plan) -> list[Values] | None:
        """Return the values of divided ticks, or None if these have another form."""
        if tuple(jumps(plan).values()) != self.jumps:
            return None
        if self.division is None:
            return []
        instances = self.schedule.coupling.fmus.instances
        found = divided_values(plan, instances, len(self.division.steps))
        pairs = zip(found, self.forms, strict=True)
        same = all(ours is None or ours == theirs for (ours, _), theirs in pairs)
        return [values for _, values in found] if same else None


_WIRING = ("clock", "algorithm", "signals", "ports", "units", "types", "loops", "network")


def _is_plain(node: Any) -> bool:
    """Whether a node is no delay, or a held one."""
    block = node.block
    return not isinstance(block, Delay) or block.interpolation == "hold"


def _inside(division: Divide) -> list[Any]:
    """Return the pieces of divided ticks, which come before those of the others."""
    count = sum(1 for _ in pieces(division.otherwise))
    every = list(pieces((division,)))
    return every[: len(every) - count]


def _source(piece: Any, plan: Plan, places: dict[str, int]) -> _Source | None:
    i = places.get(getattr(piece, "node", None) or "")
    if i is None:
        return None
    if isinstance(piece, Keep):
        return lambda plan: (plan.nodes[i].ring,)
    if isinstance(piece, Past) and not piece.ahead:
        form, _ = apart(piece)

        def renewed(plan: Plan) -> Values | None:
            new, values = apart(past(plan, i, result=piece.result))
            return values if new == form else None

        return renewed
    if isinstance(piece, Call) and type(piece.function) is MethodType:
        name = piece.function.__name__
        if piece.function == getattr(plan.nodes[i].block, name, None):
            return lambda plan: (getattr(plan.nodes[i].block, name),)
    return None
