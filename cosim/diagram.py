"""The diagram: blocks by name, connected by `block.port`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import DiagramError, UnitError, listing, suggest
from ..base.units import compatible, parse
from .block import Block, require_positive
from .clock import rational

if TYPE_CHECKING:
    from control import StateSpace

    from .algorithms import Master
    from .checkpoint import Checkpoint
    from .plan import Plan
    from .results.observer import Observer
    from .results.pacing import Pace
    from .results.recording import Recording
    from .results.result import Run
    from .runner import Runner
    from .scenario import Scenario
    from .simulation import Simulation


@dataclass(frozen=True)
class Port:
    """One end of a connection."""

    block: str
    name: str

    def __str__(self) -> str:
        return f"{self.block}.{self.name}"


class Diagram:
    """Blocks and connections, stepped together at a base step (s).

    A run does not change the diagram. Mistakes raise DiagramError (UnitError for units) at the
    call that makes them; an input left open and an algebraic loop when the diagram is run.
    """

    def __init__(self, name: str, *, step: float | Fraction) -> None:
        if not (isinstance(step, float | int | Fraction) and 0 < step < float("inf")):
            raise DiagramError(f"diagram '{name}': step must be a positive time in s, not {step!r}")
        self.name = name
        self.step = rational(step)
        self._blocks: dict[str, Block] = {}
        self._sources: dict[Port, Port] = {}  # input -> the output that drives it
        self._units: dict[Port, str] = {}

    def __repr__(self) -> str:
        return f"Diagram({self.name!r}, step={float(self.step):g}, blocks: {listing(self._blocks)})"

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks by name."""
        return dict(self._blocks)

    @property
    def connections(self) -> Mapping[Port, Port]:
        """For each driven input the output that drives it."""
        return dict(self._sources)

    def add(self, name: str, block: Block) -> None:
        """Add a block under a name, which is a Python identifier."""
        if not isinstance(name, str) or not name.isidentifier():
            raise DiagramError(f"'{name}' cannot name a block: letters, digits and _ only")
        if name in self._blocks:
            raise DiagramError(f"'{self.name}' already has a block '{name}'")
        if not isinstance(block, Block):
            hint = "; an FMU's path goes into Fmu(path)" if isinstance(block, str | Path) else ""
            raise DiagramError(f"add('{name}', …) needs a block, not {block!r}{hint}")
        _check_block(name, block)
        for port, unit in (*block.inputs.items(), *block.outputs.items()):
            if unit is not None:
                try:
                    parse(unit)
                except UnitError as error:
                    raise UnitError(f"block '{name}', port '{port}': {error}") from None
        self._blocks[name] = block
        for ports in (block.inputs, block.outputs):
            self._units |= {Port(name, p): unit for p, unit in ports.items() if unit is not None}

    def connect(self, source: str, target: str) -> None:
        """Connect an output "block.port" to an input "block.port"."""
        a, b = self.port(source, "output"), self.port(target, "input")
        if b in self._sources:
            raise DiagramError(
                f"connect({a} → {b}): {b} is driven already, by {self._sources[b]}; "
                "join signals in a Sum block"
            )
        before = dict(self._units)
        self._sources[b] = a
        try:
            self._spread(a, b)
        except UnitError:
            del self._sources[b]
            self._units = before
            raise

    def port(self, spelling: str, kind: str) -> Port:
        """Return the port spelled "block.port"; `kind` is "input" or "output"."""
        if not isinstance(spelling, str) or "." not in spelling:
            raise DiagramError(f"{spelling!r} is not spelled block.port")
        name, _, port = spelling.partition(".")
        block = self.block(name)
        ports = block.inputs if kind == "input" else block.outputs
        if port not in ports:
            others = block.outputs if kind == "input" else block.inputs
            turned = f" ('{port}' is the other way round)" if port in others else ""
            raise DiagramError(
                f"block '{name}' has no {kind} '{port}'{turned}; {kind}s: {listing(ports)}"
                f"{suggest(port, ports)}"
            )
        return Port(name, port)

    def block(self, name: str) -> Block:
        """Return a block by name."""
        if name not in self._blocks:
            raise DiagramError(
                f"no block '{name}' in '{self.name}'; blocks: {listing(self._blocks)}"
                f"{suggest(name, self._blocks)}"
            )
        return self._blocks[name]

    def unit(self, port: Port) -> str | None:
        """Return a port's unit; None if nothing connected has one."""
        return self._units.get(port)

    def with_values(self, values: Mapping[str, Any]) -> "Diagram":
        """Return a copy with parameters changed, spelled "block.parameter"."""
        blocks = dict(self._blocks)
        given: dict[str, dict[str, Any]] = {}
        for spelling, value in values.items():
            name, dot, parameter = spelling.partition(".")
            if not dot:
                raise DiagramError(f"'{spelling}' is not spelled block.parameter")
            given.setdefault(name, {})[parameter] = value
        for name, ours in given.items():
            blocks[name] = self.block(name).with_parameters(ours)
        copy = Diagram(self.name, step=self.step)
        if all(_has_ports_of(blocks[name], block) for name, block in self._blocks.items()):
            for name, block in blocks.items():
                if block is not self._blocks[name]:
                    _check_block(name, block)
            copy._blocks = blocks
            copy._sources, copy._units = self._sources.copy(), self._units.copy()
            return copy
        for name, block in blocks.items():
            copy.add(name, block)
        for target, source in self._sources.items():
            copy.connect(str(source), str(target))
        return copy

    def plan(self, *, start: float | Fraction = 0.0, algorithm: "Master | None" = None) -> "Plan":
        """Return the schedule; raise DiagramError for an open input or an algebraic loop."""
        from .plan import make_plan

        return make_plan(self, start, algorithm)

    def run(
        self,
        stop: float | Fraction,
        *,
        start: float | Fraction = 0.0,
        algorithm: "Master | None" = None,
        record: "Sequence[str] | Recording | None" = None,
        scenario: "Scenario | None" = None,
        observers: "Sequence[Observer]" = (),
        pace: "Pace | None" = None,
        engine: str = "auto",
        resume: "Checkpoint | None" = None,
        progress: bool = True,
    ) -> "Run":
        """Run afresh from start to stop (s) and return the recorded signals.

        N steps give N + 1 rows. Options, each a value of its own:

        - `algorithm`: how FMUs are coupled (default `TwoPhase()`), see `algorithms`.
        - `record`: the outputs to keep ("block.port"; default: all), or a `Recording`.
        - `scenario`: parameters, overrides and faults that change at given times.
        - `observers`: functions that are called at every tick, or every n-th.
        - `pace`: real time, or a multiple of it.
        - `engine`: "compiled" (needs a C compiler once), "python", or "auto", the first if it can
          be had. Both give the same bits; the run's `info` says which ran.
        - `resume`: a `Checkpoint` to go on from; `stop` still counts from the diagram's zero.
        - `progress`: on a terminal a bar appears after two seconds.

        Raise SimulationError, which carries the rows so far, if a block fails.
        """
        from .options import Options
        from .run import run

        options = Options(
            start=start,
            algorithm=algorithm,
            record=record,
            scenario=scenario,
            observers=observers,
            pace=pace,
            engine=engine,
            resume=resume,
        )
        return run(self, stop, options, progress=progress)

    def runner(
        self,
        stop: float | Fraction,
        *,
        start: float | Fraction = 0.0,
        algorithm: "Master | None" = None,
        record: "Sequence[str] | Recording | None" = None,
        observers: "Sequence[Observer]" = (),
        engine: str = "auto",
    ) -> "Runner":
        """Return what makes many runs from start to stop (s), each with values of its own, fast.

        Options as for `run`. Use it in a `with`:

            with loop.runner(60.0, record=["train.speed"]) as runner:
                runs = [runner.run({"link.time": t}) for t in (0.3, 0.35, 0.412)]
        """
        from .options import Options
        from .run import run_ticks
        from .runner import Runner

        options = Options(
            start=start, algorithm=algorithm, record=record, observers=observers, engine=engine
        )
        return Runner(self, options, run_ticks(self, stop, options))

    def simulation(
        self,
        *,
        start: float | Fraction = 0.0,
        algorithm: "Master | None" = None,
        record: "Sequence[str] | Recording | None" = None,
        scenario: "Scenario | None" = None,
        observers: "Sequence[Observer]" = (),
        pace: "Pace | None" = None,
        engine: str = "auto",
        resume: "Checkpoint | None" = None,
    ) -> "Simulation":
        """Return a simulation that stands at the start, to be taken on step by step.

        Options as for `run`. Use it in a `with`:

            with loop.simulation() as simulation:
                simulation.advance(5.0)
                simulation["train.speed"]
                simulation.checkpoint().save("at_5s.checkpoint")
        """
        from .options import Options
        from .simulation import Simulation

        options = Options(
            start=start,
            algorithm=algorithm,
            record=record,
            scenario=scenario,
            observers=observers,
            pace=pace,
            engine=engine,
            resume=resume,
        )
        return Simulation(self, options)

    def linearise(
        self,
        at: float | Fraction,
        *,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        open_at: str | None = None,
        start: float | Fraction = 0.0,
    ) -> "StateSpace":
        """Run afresh from start to `at` (s) and return the linear map of one step from there.

        The result is a sampled python-control StateSpace, dt the step, for differences from the
        operating point. `inputs` are ports "block.port": to an input port a disturbance is added
        there, to an output for all that read it (default: every source, or every signal where
        there is none). `outputs` are signals (default: all). Labels are spelled block/port, as
        python-control allows no dot.

        `open_at` cuts the loop at a port. Alone it gives the loop transfer function L, from what
        reads there back to there, with the sign turned: `control.feedback(L)` is the closed loop.
        With inputs or outputs, what reads there stays at its operating point, and only states
        between the inputs and the outputs are left.

        With several rates dt is the least common multiple of the periods: inputs are held over it
        and outputs belong to its beginning.

        Raise FmuError for an FMU that does not expose states and directional derivatives,
        LinearisationError for a block that jumps or bends just there, or a cut that passes several
        values in a dt, DiagramError for a wrong port or time.
        """
        from .linear.linearise import linearise

        return linearise(self, at, inputs=inputs, outputs=outputs, open_at=open_at, start=start)

    # Units: known ones travel along connections and through blocks that share a unit.

    def _spread(self, a: Port, b: Port) -> None:
        known = [self._units[p] for p in (a, b) if p in self._units]
        if len(known) == 2:
            if not compatible(*known):
                raise UnitError(
                    f"connect({a} [{known[0]}] → {b} [{known[1]}]): units differ; "
                    "a Gain with input_unit and unit converts"
                )
        elif known:
            self._learn(a if b in self._units else b, known[0])

    def _learn(self, port: Port, unit: str) -> None:
        """Give a port its unit, and with it all that must share it."""
        if port in self._units:
            if not compatible(self._units[port], unit):
                raise UnitError(
                    f"{port} would need both [{self._units[port]}] and [{unit}]: units differ"
                )
            return
        block = self._blocks[port.block]
        if not block.shares_unit:
            return
        self._units[port] = unit
        free = [p for ports in (block.inputs, block.outputs) for p, u in ports.items() if u is None]
        for name in free:
            self._learn(Port(port.block, name), unit)
        for target, source in self._sources.items():
            if port in (source, target):
                self._spread(source, target)


def _has_ports_of(new: Block, old: Block) -> bool:
    """Return whether a block has the ports and units of another, so that its wires fit as well."""
    return new is old or (
        new.inputs == old.inputs
        and new.outputs == old.outputs
        and new.shares_unit == old.shares_unit
    )


def _check_block(name: str, block: Block) -> None:
    """Raise DiagramError or ParameterError for a block that does not keep the protocol."""
    for ports, kind in ((block.inputs, "inputs"), (block.outputs, "outputs")):
        named = isinstance(ports, Mapping) and all(
            isinstance(p, str) and p and isinstance(unit, str | None) for p, unit in ports.items()
        )
        if not named:
            raise DiagramError(f"block '{name}': {kind} must map port names to units (or None)")
    if block.period is not None:
        require_positive(block, "period")
    for port in block.direct:
        if port not in block.inputs:
            raise DiagramError(
                f"block '{name}': direct names '{port}', which is no input; inputs: "
                f"{listing(block.inputs)}{suggest(port, block.inputs)}"
            )
    needed = ["step"] if block.feedthrough and block.inputs else []
    if not block.feedthrough and block.outputs:
        needed = ["output"]
    if not block.feedthrough and block.inputs:
        needed.append("update")
    for method in () if block.run_by_engine else needed:
        if getattr(type(block), method) is getattr(Block, method):
            raise DiagramError(f"block '{name}': {type(block).__name__} must define {method}()")
