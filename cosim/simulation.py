"""A simulation that is going on: a diagram brought to some tick, to be taken further or saved."""

import struct
import warnings
from contextlib import suppress
from fractions import Fraction
from time import perf_counter
from typing import Any, Self

import numpy as np

from ..base.errors import DiagramError, RailcosimError
from .algorithms import TwoPhase
from .blocks.fmu import Fmu
from .checkpoint import Checkpoint
from .clock import is_time, rational
from .coupling.initialise import Initialisation, NotFiniteError
from .diagram import Diagram
from .engine.choice import Engine
from .engine.places import ObserverError, Place, message, no_number
from .finite import first_made, not_finite, present
from .fmu.instance import FmuInstance
from .kit import Kit
from .options import Options
from .phases import Phases
from .plan import Plan
from .registers import at_start, carried
from .results.pacing import Pacer
from .results.recording import Recorder, Recording
from .results.result import Run, SimulationError
from .schedule.operations import Record
from .watching import StopRunError, observer_call, wait_call

_CHUNK_SECONDS = 0.1  # between two looks at the clock, the progress bar and the signals


class Simulation:
    """A diagram between two ticks; see Diagram.simulation. Close it, or use it in a `with`.

    `tick` says where it stands, counted from the start, and `ended` whether an observer has asked
    for the end. `simulation["block.port"]` is a signal there.
    """

    def __init__(
        self, diagram: Diagram, options: Options, *, ticks: int | None = None,
        kit: Kit | None = None,
    ) -> None:  # fmt: skip
        self._began = perf_counter()
        self._options, self._ticks = options, ticks
        self._kit = Kit() if kit is None else kit
        algorithm = TwoPhase() if options.algorithm is None else options.algorithm
        self._phases = Phases(diagram, options.start, algorithm, options.scenario, self._kit.plan)
        self._kit.keep_plan(self._phases.base)
        self._plan = self._phases.base
        recording = Recording.of(options.record)
        names = self._plan.signals
        self._kept = [names[i] for i in recording.places(names, diagram.name)]
        for observer in options.observers:
            observer.places(names, diagram.name)
        if options.resume is not None:
            options.resume.require(self._plan, self._phases.scenario)
        self.tick = 0 if options.resume is None else options.resume.tick
        self.ended = self._closed = False
        self._warnings: list[str] = []
        self._instances: dict[str, FmuInstance] = {}
        self._pacer = None if options.pace is None else Pacer(options.pace, self._clock)
        self._recorder = Recorder(
            self._kept, self._plan.units, self._plan.types, self._clock,
            None if ticks is None else ticks - self.tick, recording, name=diagram.name,
            first=self.tick,
        )  # fmt: skip
        self._has_last_row = False
        self._finished: int | None = None  # the tick that `finish` has recorded
        self._broken = "has not begun"  # why it cannot go on
        self._size = self._kit.chunk  # ticks in a chunk
        try:
            self._open(options.resume)
        except BaseException as error:
            self.close()
            with suppress(RailcosimError):
                self._recorder.close(str(error))
            raise

    # Life

    def _open(self, resume: Checkpoint | None) -> None:
        for name, block in self._phases.diagram.blocks.items():
            if isinstance(block, Fmu):
                self._instances[name] = self._kit.instance(name, block)
        self._compile()
        self._values = list(self._schedule.start)
        self._initialise(is_resumed=resume is not None)
        if resume is not None:
            self._values = resume.restore(self._schedule, self._instances)
        else:
            self._change_fmus()
        if self._pacer is not None:
            self._pacer.anchor(self.tick)
        self._broken = ""

    def _compile(self) -> None:
        """Make the program for the plan that holds from the present tick on."""
        plan = self._plan = self._phases.plan(self.tick)
        watched = {name for observer in self._options.observers for name in observer.ports}
        kept = {plan.signals.index(name) for name in (*self._kept, *watched)}
        registers = tuple(f"y{plan.signals.index(name)}" for name in self._kept)
        record = Record(registers=registers, every=self._recorder.every)
        before = () if self._pacer is None else (wait_call(self._pacer),)
        after = tuple(observer_call(observer, plan) for observer in self._options.observers)
        self._schedule, self._program, self._engine = self._kit.prepared(
            self._options.engine, plan, self._instances, kept, record, before, after
        )

    def _initialise(self, *, is_resumed: bool) -> None:
        plan, states = self._plan, len(self._plan.nodes)

        def signals() -> list[Any]:
            try:
                values = self._program.initial(0, self._values)[states:]
            except RailcosimError:
                raise
            except Exception as error:
                raise self._failed(error, self._program.where(error)) from error
            values = values[: len(plan.signals)]
            try:
                struct.pack(f"{len(values)}d", *values)
            except (struct.error, TypeError, OverflowError):
                what = no_number(plan, {f"y{i}": y for i, y in enumerate(values)}, 0)
                if what is not None:
                    raise self._failure(what) from None
            return values

        initialisation = Initialisation(plan, self._instances, signals, self._ticks)
        initialisation.settle()
        try:
            initialisation.finish()
        except NotFiniteError as error:
            raise self._failure(str(error)) from None
        if not is_resumed:
            self._values = at_start(self._schedule, self._values, signals())

    def close(self) -> None:
        """Terminate and free the FMUs; what goes wrong in that becomes a warning."""
        if hasattr(self, "_schedule"):
            self._schedule.coupling.release()
        is_whole = not self._broken
        self._kit.chunk = self._size
        for name, instance in self._instances.items():
            instance.time = self.time
            block: Any = self._phases.diagram.block(name)
            trouble = self._kit.give_back(name, block, instance, is_whole=is_whole)
            if trouble:
                self._warnings.append(trouble)
                warnings.warn(trouble, stacklevel=2)
        self._instances = {}
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # A file that no result has completed is completed here, so that it can be read.
        with suppress(RailcosimError):
            if kind is not None:
                what = f"broken off at t = {self.time:.9g} s by {kind.__name__}"
                self._broken = self._broken or "was broken off"
                self._recorder.close(what, info=self._info())
            elif self._ticks is None and not (self._broken or self._closed):
                self.finish()
                self._recorder.close(info=self._info())
        self.close()

    # Where it stands

    @property
    def _clock(self) -> Any:
        return self._phases.clock

    @property
    def time(self) -> float:
        """The time (s) of the present tick."""
        return self._clock.time(self.tick)

    def __getitem__(self, port: str) -> Any:
        """Return the value of an output "block.port" at the present tick."""
        Recording([port]).places(self._phases.base.signals, self._plan.name)
        return self.signals()[self._plan.signals.index(port)]

    def signals(self) -> list[Any]:
        """Return all signals at the present tick, in the plan's order."""
        if self.ended:
            return list(self._last_signals)
        self._require_whole()
        try:
            values = self._program.observe(self.tick, self._values)
        except Exception as error:
            raise self._failed(error, self._program.where(error)) from error
        states = len(self._plan.nodes)
        return values[states : states + len(self._plan.signals)]

    @property
    def states(self) -> list[Any]:
        """The blocks' states before the present tick, in the plan's order."""
        return self._values[: len(self._plan.nodes)]

    @property
    def instances(self) -> dict[str, FmuInstance]:
        """The FMUs' instances by block."""
        return self._instances

    @property
    def plan(self) -> Plan:
        """The plan that holds now."""
        return self._plan

    def checkpoint(self) -> Checkpoint:
        """Return all that is needed to go on from here, in this process or another.

        Raise CheckpointError for an FMU that cannot save its state as bytes, or a block whose
        state is not made of numbers.
        """
        self._require_whole()
        if self.ended:
            raise DiagramError(
                f"an observer has ended the simulation at t = {self.time:.9g} s, in the middle "
                "of a step; there is no checkpoint of that"
            )
        base, scenario = self._phases.base, self._phases.scenario
        return Checkpoint.of(self.tick, base, scenario, self._schedule, self._values,
                             self._instances)  # fmt: skip

    # Going on

    def advance(self, until: float | Fraction) -> Self:
        """Go on to a time (s) and return self; rows are recorded on the way.

        Raise SimulationError, which carries the rows so far, if a block fails.
        """
        if not is_time(until):
            raise DiagramError(f"advance() needs a time in s, not {until!r}")
        if self.ended:
            raise DiagramError(f"an observer has ended the simulation at t = {self.time:.9g} s")
        what = "advance: until − start" if self._clock.start else "advance: until"
        ticks = self._clock.ticks(rational(until) - self._clock.start, what)
        if ticks < self.tick:
            raise DiagramError(f"advance({float(until):g}): the simulation is at {self.time:g} s")
        if self._pacer is not None:
            self._pacer.anchor(self.tick)  # time that passed between two calls is no lateness
        while self.tick < ticks and not self.ended:
            self.advance_ticks(ticks)
        return self

    def advance_ticks(self, end: int) -> None:
        """Go on towards a tick, for about 0.1 s of computing."""
        self._require_whole()
        if self._has_last_row:
            self._recorder.keep(-1)
            self._has_last_row = False
        boundary = self._phases.next_boundary(self.tick)
        end = int(min(end, self.tick + self._chunk(), boundary))
        before = perf_counter()
        count = end - self.tick
        self._run(end)
        spent = perf_counter() - before
        self._size = max(64, min(4 * self._size, int(count * _CHUNK_SECONDS / max(spent, 1e-6))))
        if self.tick == boundary and not self.ended:
            try:
                self._cross()
            except RailcosimError as error:
                raise self._failure(str(error)) from error

    def _require_whole(self) -> None:
        if self._broken:
            raise DiagramError(f"the simulation {self._broken}; start again, or from a checkpoint")
        if self._closed:
            raise DiagramError("the simulation has been closed")

    def _chunk(self) -> int:
        size = min(self._size, self._recorder.limit * self._recorder.every)
        if self._options.pace is not None:
            size = min(size, int(_CHUNK_SECONDS * self._options.pace.factor / self._clock.step))
        return max(1, size)

    def _run(self, end: int) -> None:
        rows = self._recorder.buffer(self._recorder.count(self.tick, end))
        try:
            self._values = self._engine.advance(self.tick, end, self._values, rows)
        except StopRunError as stop:
            place = self._engine.where(stop)
            assert place is not None
            self._keep(rows, place.tick + 1)
            self.tick, self.ended = place.tick, True
            self._last_signals = [place.values[f"y{j}"] for j in range(len(self._plan.signals))]
            return
        except (Exception, SystemExit) as error:  # exit() in a block is the block's failure
            place = self._engine.where(error)
            tick = self.tick if place is None else place.tick
            self._keep(rows, tick + 1 if place is not None and place.recorded else tick)
            self.tick = tick
            raise self._failed(error, place) from error
        except BaseException as error:  # Ctrl-C: the rows that are complete are kept
            place = self._engine.where(error)
            if place is not None:
                with suppress(RailcosimError):
                    self._keep(rows, place.tick + place.recorded)
                self.tick = place.tick
            self._broken = f"was interrupted after t = {self.time:.9g} s"
            with suppress(RailcosimError):
                self._recorder.close(f"interrupted after t = {self.time:.9g} s", info=self._info())
            raise
        self._keep(rows, end)
        self.tick = end
        self._require_finite()

    def _keep(self, rows: np.ndarray, end: int) -> None:
        """Keep the rows of the ticks before `end`; one that is not finite ends the run."""
        count = self._recorder.count(self.tick, end)
        bad = ~np.isfinite(rows[:count])
        if not bad.any():
            self._recorder.keep(count)
            return
        row = int(np.argwhere(bad)[0][0])
        tick = self._recorder.tick(self._recorder.rows + row)
        self._recorder.keep(row + 1)
        name = first_made(self._plan, (self._kept[c] for c in np.flatnonzero(bad[row])))
        value, time = float(rows[row, self._kept.index(name)]), self._clock.time(tick)
        when = "at" if self._recorder.every == 1 else "at the latest at"
        self.tick = tick
        raise self._failure(f"{name} is {value:g} {when} t = {time:.9g} s")

    def _require_finite(self) -> None:
        """Raise SimulationError for a signal that is not finite, recorded or not."""
        n = len(self._plan.nodes)
        signals = self._values[n : n + len(self._plan.signals)]
        try:
            outputs = present(self._instances, self._schedule.partly, self.time)
        except RailcosimError as error:
            raise self._failed(error, None) from error
        if (what := not_finite(self._plan, signals, outputs, self.tick)) is not None:
            raise self._failure(what)

    def _cross(self) -> None:
        """Change over to the plan that holds from this tick on."""
        before = dict(zip(self._schedule.labels, self._values, strict=True))
        steps = self._schedule.coupling.fmus.steps
        self._schedule.coupling.release()
        self._compile()
        self._schedule.coupling.fmus.steps = steps
        self._values = carried(before, self._schedule)
        self._change_fmus()

    def _change_fmus(self) -> None:
        for name, parameter, value in self._phases.fmu_changes(self.tick):
            self._instances[name].set(parameter, value)

    # Results

    def result(self) -> Run:
        """Return what has been recorded, the present tick included. A file is closed by it."""
        self.finish()
        return self._result(None)

    def finish(self) -> None:
        """Record the present tick, and let observers see it, as the last one for now."""
        if self._finished == self.tick or self.ended:
            return
        if self._pacer is not None:
            self._pacer.wait(self.tick)
        signals = dict(zip(self._plan.signals, self.signals(), strict=True))
        if self.tick % self._recorder.every == 0:
            row = self._recorder.buffer(1)
            try:
                row[0] = [signals[name] for name in self._kept]
            except (TypeError, ValueError) as error:
                values = {f"y{j}": value for j, value in enumerate(signals.values())}
                place = Place(None, self.tick, False, values)
                raise self._failed(error, place) from error
            self._keep(row, self.tick + 1)
            self._has_last_row = True
        self._finished = self.tick
        for observer in self._options.observers:
            if self.tick % observer.every == 0:
                try:
                    observer.function(self.time, *(signals[name] for name in observer.ports))
                except Exception as error:
                    failure = ObserverError(observer.label)
                    failure.__cause__ = error
                    raise self._failed(failure, None) from error

    def _failed(self, error: BaseException, place: Place | None) -> SimulationError:
        tick = self.tick if place is None else place.tick
        return self._failure(message(self._plan, place, tick, error))

    def _failure(self, what: str) -> SimulationError:
        self._broken = "has failed"
        with suppress(RailcosimError):
            return SimulationError(what, self._result(what))
        return SimulationError(what, Run(self._plan.name, failure=what))

    def _result(self, failure: str | None) -> Run:
        pacing = None if self._pacer is None else self._pacer.report()
        return self._recorder.result(
            failure, info=self._info(), pacing=pacing, wall_time=perf_counter() - self._began
        )

    def _info(self) -> dict[str, Any]:
        engine: Engine | None = getattr(self, "_engine", None)
        return {
            "engine": "" if engine is None else engine.name,
            "engine_reason": "" if engine is None else engine.reason,
            "algorithm": repr(self._plan.algorithm),
            "order": list(self._plan.order),
            "step": float(self._clock.step),
            "start": self._clock.time(0),
            "steps": self._schedule.coupling.counted if hasattr(self, "_schedule") else None,
            "warnings": list(self._warnings),
        }
