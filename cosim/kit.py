"""Where a simulation has its parts from: made for it alone, or kept from one run to the next."""

from collections import OrderedDict
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from .blocks.fmu import Fmu
from .engine.choice import Engine, choose_engine
from .engine.generate import Program, all_pieces, generate
from .fmu.kept import KeptInstances
from .plan import Plan
from .schedule.forms import apart
from .schedule.operations import Call, Record
from .schedule.rebinding import Rebinding
from .schedule.schedule import Schedule, make_schedule

_REBINDINGS = 8  # forms of one diagram whose schedules are kept too
_PROGRAMS = 32  # forms of one diagram: with delays on the grid and off it, in either order, …


class Kit:
    """Makes the parts of one simulation; what is made is not used again."""

    chunk = 256  # ticks between two looks at the clock, at first
    plan: Plan | None = None  # one of the same diagram, whose order and wiring may be taken over

    def keep_plan(self, plan: Plan) -> None:
        """Take note of the plan of a run without changes."""

    def instance(self, name: str, block: Fmu) -> Any:
        """Return an FMU's instance, with its values set."""
        return block.instance(name)

    def give_back(self, name: str, block: Fmu, instance: Any, *, is_whole: bool) -> str | None:
        """Let go of an instance; return what went wrong in ending its run, if anything.

        `is_whole` says that the run did not fail.
        """
        return instance.close()

    def prepared(
        self,
        wanted: str,
        plan: Plan,
        instances: Mapping[str, Any],
        kept: Collection[int],
        record: Record,
        before: Sequence[Call],
        after: Sequence[Call],
    ) -> tuple[Schedule, Program, Engine]:
        """Return the schedule of a plan (see make_schedule), its program, and the engine wanted."""
        schedule = make_schedule(plan, instances, kept)
        return schedule, *self.program(wanted, schedule, record, before, after)

    def program(
        self,
        wanted: str,
        schedule: Schedule,
        record: Record,
        before: Sequence[Call],
        after: Sequence[Call],
    ) -> tuple[Program, Engine]:
        """Return the generated program of a schedule and the engine that is wanted."""
        program = generate(schedule, record, before=before, after=after)
        return program, choose_engine(wanted, schedule, program, record, before, after)


class KeptKit(Kit):
    """Keeps plan, programs and FMU instances for the next run of the same diagram."""

    def __init__(self) -> None:
        self.instances = KeptInstances(self._forget)
        self._programs: OrderedDict[Any, tuple[Program, Engine]] = OrderedDict()
        self._latest: list[tuple[Any, Rebinding, Program, Engine]] = []  # the latest one first

    def keep_plan(self, plan: Plan) -> None:
        """Take note of the plan of a run without changes."""
        self.plan = plan

    def instance(self, name: str, block: Fmu) -> Any:
        """Return an FMU's instance, reset or made, with its values set."""
        return self.instances.take(name, block)

    def give_back(self, name: str, block: Fmu, instance: Any, *, is_whole: bool) -> str | None:
        """Take an instance back; return what went wrong in ending its run, if anything."""
        return self.instances.give(name, block, instance, is_whole=is_whole)

    def prepared(
        self,
        wanted: str,
        plan: Plan,
        instances: Mapping[str, Any],
        kept: Collection[int],
        record: Record,
        before: Sequence[Call],
        after: Sequence[Call],
    ) -> tuple[Schedule, Program, Engine]:
        """Return schedule, program and engine: a former one's with other values, if they fit."""
        given = (wanted, sorted(kept), record, [*before], [*after], [*map(id, instances.values())])
        for n, (known, rebinding, program, engine) in enumerate(self._latest):
            found = rebinding.to(plan) if known == given else None
            if found is not None:
                self._latest.insert(0, self._latest.pop(n))
                engine.bind(found[1])
                return found[0], program, engine
        made = super().prepared(wanted, plan, instances, kept, record, before, after)
        schedule, program, engine = made
        rebinding = Rebinding.of(schedule, all_pieces(schedule, record, before, after))
        if rebinding is not None:
            self._latest.insert(0, (given, rebinding, program, engine))
            del self._latest[_REBINDINGS:]
        return made

    def program(
        self,
        wanted: str,
        schedule: Schedule,
        record: Record,
        before: Sequence[Call],
        after: Sequence[Call],
    ) -> tuple[Program, Engine]:
        """Return program and engine: those of the same form with other values, if there are."""
        known_pieces: dict[int, Any] = {}  # some come several times
        found = [
            known_pieces.get(id(piece)) or known_pieces.setdefault(id(piece), apart(piece))
            for piece in all_pieces(schedule, record, before, after)
        ]
        parts = tuple(
            map(len, (before, schedule.outputs, after, schedule.updates, schedule.observed))
        )
        form = (wanted, parts, schedule.registers, tuple(form for form, _ in found))
        known = self._programs.get(form)
        if known is None:
            known = super().program(wanted, schedule, record, before, after)
            self._programs[form] = known
            if len(self._programs) > _PROGRAMS:
                self._programs.popitem(last=False)
            return known
        self._programs.move_to_end(form)
        known[1].bind([values for _, values in found])
        return known

    def close(self) -> None:
        """Free everything."""
        self.instances.close()
        self._forget()

    def _forget(self) -> None:
        """Forget the programs: an instance that they know is to be freed."""
        self._programs.clear()
        self._latest.clear()
