"""Running a plan: initialization, the ticks in chunks, and what is kept when a block fails."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy as np

from ..base.errors import AlgebraicLoopError, DiagramError, RailcosimError, listing, suggest
from .blocks.fmu import Fmu
from .clock import rational
from .fmu_instance import FmuInstance
from .generate import Program, generate
from .plan import Plan
from .result import Run, SimulationError

_CHUNK_SECONDS = 0.1  # between two looks at the clock, the progress bar and the signals


def run(
    plan: Plan,
    stop: float | Fraction,
    *,
    record: Sequence[str] | None = None,
    progress: bool = True,
) -> Run:
    """Run a plan to `stop` (s); see Diagram.run."""
    if not isinstance(stop, int | float | Fraction) or not math.isfinite(stop):
        raise DiagramError(f"stop must be a time in s, not {stop!r}")
    if not rational(stop) > plan.clock.start:
        start = float(plan.clock.start)
        raise DiagramError(f"stop = {float(stop):g} s must lie after start = {start:g} s")
    what = "stop − start" if plan.clock.start else "stop"
    ticks = plan.clock.ticks(rational(stop) - plan.clock.start, what)
    kept = _signals(plan, record)
    instances: dict[str, FmuInstance] = {}
    try:
        for node in plan.nodes:
            if isinstance(node.block, Fmu):
                instances[node.name] = node.block.instance(node.name)
        program = generate(plan, instances, kept)
        values = _initialize(plan, program, instances, ticks)
        return _Loop(plan, program, kept, ticks, progress).run(values)
    finally:
        for instance in instances.values():
            instance.close()


def _signals(plan: Plan, record: Sequence[str] | None) -> list[int]:
    if record is None:
        return list(range(len(plan.signals)))
    for name in record:
        if name not in plan.signals:
            raise DiagramError(
                f"no signal '{name}' to record in '{plan.name}'; signals: {listing(plan.signals)}"
                f"{suggest(name, plan.signals)}"
            )
    return [plan.signals.index(name) for name in record]


def _initialize(
    plan: Plan, program: Program, instances: dict[str, FmuInstance], ticks: int
) -> list[Any]:
    """Bring all FMUs through initialization mode and return the values at the start.

    There FMI allows reading outputs after setting inputs. So the first tick's outputs are
    computed again, from the same states, until the FMUs' outputs stay as they are: as many
    sweeps as there are FMUs in a chain, and one more to see it.
    """
    start = plan.clock.time(0)
    nodes = {node.name: node for node in plan.nodes}
    for name, instance in instances.items():
        # A slower FMU's last step ends at its own hit, which may lie behind the run's stop.
        span = nodes[name].ticks
        instance.enter_initialization(start, plan.clock.time(-(-ticks // span) * span))
        instance.fetch()
    values = list(program.start)
    states = len(plan.nodes)
    for _ in range(len(instances) + 2):
        before = {name: instance.outputs() for name, instance in instances.items()}
        try:
            signals = program.observe(0, values)[states:]
        except Exception as error:
            place = _where(program, error)
            what = _failed(place.node if place else None, start, error)
            raise SimulationError(what, _empty(plan, what)) from error
        what = _no_number(plan, {f"y{i}": signal for i, signal in enumerate(signals)}, 0)
        if what is not None:
            raise SimulationError(what, _empty(plan, what))
        for name, instance in instances.items():
            instance.inputs([signals[i] for i in nodes[name].inputs])
            instance.put()
            instance.fetch()
        after = {name: instance.outputs() for name, instance in instances.items()}
        if all(np.array_equal(before[n], after[n], equal_nan=True) for n in after):
            break
    else:
        raise AlgebraicLoopError(
            f"'{plan.name}': the initial outputs of {listing(instances)} do not settle; "
            "they depend on each other without a delay"
        )
    for name, instance in instances.items():
        instance.exit_initialization()
        instance.fetch()
        for port, value in zip(nodes[name].block.outputs, instance.outputs(), strict=True):
            if not math.isfinite(value):
                what = f"{name}.{port} is {value:g} at the start, t = {start:.9g} s"
                raise SimulationError(what, _empty(plan, what))
    return values


@dataclass
class _Loop:
    """The ticks of one run: chunks of about 0.1 s, each packed into one buffer of rows."""

    plan: Plan
    program: Program
    kept: list[int]
    ticks: int
    progress: bool

    def __post_init__(self) -> None:
        self.layout = struct.Struct(f"{len(self.kept)}d")
        self.chunks: list[np.ndarray] = []
        self.done = 0  # ticks whose rows are kept

    def run(self, values: list[Any]) -> Run:
        from tqdm import tqdm

        began = perf_counter()
        # disable=None: no bar where standard error is not a terminal.
        with tqdm(
            total=self.ticks,
            desc=self.plan.name,
            unit=" steps",
            delay=2.0,
            disable=None if self.progress else True,
            leave=False,
        ) as bar:
            size = 256
            while self.done < self.ticks:
                end = min(self.done + size, self.ticks)
                before = perf_counter()
                count = end - self.done
                values = self._chunk(end, values)
                bar.update(count)
                spent = perf_counter() - before
                size = max(64, min(4 * size, int(count * _CHUNK_SECONDS / max(spent, 1e-6))))
        self._last_row(values)
        return replace(self._result(None), wall_time=perf_counter() - began)

    def _chunk(self, end: int, values: list[Any]) -> list[Any]:
        rows = bytearray((end - self.done) * self.layout.size)
        try:
            values = self.program.advance(
                self.done, end, values, self.layout.pack_into, rows, self.layout.size
            )
        except Exception as error:
            self._fail(error, rows)
        self._keep(rows, end)
        return values

    def _last_row(self, values: list[Any]) -> None:
        row = bytearray(self.layout.size)
        try:
            signals = self.program.observe(self.ticks, values)[len(self.plan.nodes) :]
            self.layout.pack_into(row, 0, *(signals[i] for i in self.kept))
        except Exception as error:
            self._fail(error, row)
        self._keep(row, self.ticks + 1)

    def _keep(self, rows: bytearray, end: int) -> None:
        """Append rows; a signal that is not finite ends the run at its row."""
        block = np.frombuffer(rows).reshape(end - self.done, len(self.kept))
        bad = ~np.isfinite(block)
        if bad.any():
            row, column = (int(i) for i in np.argwhere(bad)[0])
            self.chunks.append(block[: row + 1])
            time = self.plan.clock.time(self.done + row)
            signal = self.plan.signals[self.kept[column]]
            what = f"{signal} is {block[row, column]:g} at t = {time:.9g} s"
            self.done += row + 1
            raise SimulationError(what, self._result(what))
        self.chunks.append(block)
        self.done = end

    def _fail(self, error: Exception, rows: bytearray) -> None:
        """Keep the complete rows before a block's failure and raise SimulationError."""
        place = _where(self.program, error)
        tick = self.done if place is None else place.tick
        complete = tick - self.done
        if place is not None and place.in_updates:
            complete += 1  # the failing tick's row had been recorded
        if complete and self.kept:
            self._keep(rows[: complete * self.layout.size], self.done + complete)
        what = _no_number(self.plan, place.values, tick) if place is not None else None
        what = what or _failed(place.node if place else None, self.plan.clock.time(tick), error)
        raise SimulationError(what, self._result(what)) from error

    def _result(self, failure: str | None) -> Run:
        clock, columns = self.plan.clock, tuple(self.plan.signals[i] for i in self.kept)
        values = np.concatenate(self.chunks) if self.chunks else np.empty((0, len(columns)))
        time = np.array(clock.times(len(values)))
        units = {c: self.plan.units[c] for c in columns if c in self.plan.units}
        return Run(self.plan.name, time, values, columns, units, failure)


@dataclass(frozen=True)
class _Place:
    """Where generated code failed: the block of the line, the tick, the values of that moment."""

    node: str | None
    tick: int
    in_updates: bool
    values: dict[str, Any]


def _where(program: Program, error: BaseException) -> _Place | None:
    """Return the place in the generated code that an error came through."""
    trace = error.__traceback__
    while trace is not None:
        frame, line = trace.tb_frame, trace.tb_lineno
        if frame.f_code.co_filename == program.filename:
            updates = frame.f_code.co_name == "advance" and line > program.pack_line
            values = dict(frame.f_locals)
            return _Place(program.node_of_line.get(line), values["k"], updates, values)
        trace = trace.tb_next
    return None


def _no_number(plan: Plan, values: dict[str, Any], tick: int) -> str | None:
    """Return a message if a block's output is no number, which only a later line noticed."""
    for i, signal in enumerate(plan.signals):
        value = values.get(f"y{i}", 0.0)
        try:
            struct.pack("d", value)
        except (struct.error, TypeError, OverflowError):
            block, _, port = signal.partition(".")
            time = plan.clock.time(tick)
            return (
                f"block '{block}' at t = {time:.9g} s: output '{port}' is {value!r}, "
                "which is no number"
            )
    return None


def _failed(name: str | None, time: float, error: Exception) -> str:
    if isinstance(error, RailcosimError):
        return str(error)
    block = f"block '{name}'" if name else "the diagram"
    words = str(error) or type(error).__name__
    if "unpack" in words:
        words += "; step() returns (outputs, next state), several outputs as a tuple"
    return f"{block} failed at t = {time:.9g} s: {type(error).__name__}: {words}"


def _empty(plan: Plan, failure: str) -> Run:
    return Run(plan.name, np.empty(0), np.empty((0, 0)), (), {}, failure)
