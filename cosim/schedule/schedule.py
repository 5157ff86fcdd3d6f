"""The schedule of a plan: the operations of a tick, for every engine to carry out.

Registers that live from tick to tick:

    x3  state of node 3 (a delay's ring)        y5  signal 5
    z5  what a Jacobi slave has computed        p5  an FMU output one step ago
    e3  the next event of node 3                m   what the coupling of FMUs remembers
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...base.errors import DiagramError, RailcosimError
from ..algorithms import GaussSeidel
from ..block import Block
from ..blocks.delay import Delay
from ..blocks.fmu import Fmu
from ..coupling.coupling import Coupling
from ..coupling.loop_solver import LoopSolver
from ..coupling.network import is_slave
from ..coupling.within import next_event
from ..fmu.instance import FmuInstance
from ..plan import Node, Plan
from .ahead import straight
from .delays import edges, past
from .dividing import divided
from .operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Due,
    Input,
    Keep,
    Move,
    Operation,
    Read,
)


@dataclass(frozen=True)
class Schedule:
    """Operations in order. `initial` are the outputs at the start, from the FMUs' present ones,
    `outputs` what a tick needs of them, and `observed` all of them.

    Of the FMUs `partly` only the outputs at these places are up to date after a tick. `registers`
    are those that live, with `labels` that mean the same in any diagram, and `start` their values
    before the first tick.
    """

    plan: Plan
    initial: tuple[Operation, ...]
    outputs: tuple[Operation, ...]
    observed: tuple[Operation, ...]
    updates: tuple[Operation, ...]
    registers: tuple[str, ...]
    labels: tuple[str, ...]
    start: tuple[Any, ...]
    coupling: Coupling
    partly: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


def make_schedule(
    plan: Plan, instances: Mapping[str, FmuInstance], kept: Collection[int] | None = None
) -> Schedule:
    """Return the schedule of a plan with its FMUs' instances.

    `kept` are the signals that are recorded or observed (None: all). An FMU output that neither
    they nor a block needs is not read in a tick, only for `observe` (see Schedule). Nor need an FMU
    tell it then.
    """
    coupling = Coupling(plan, instances)
    needed = None if kept is None else {*kept, *(j for n in plan.nodes for j in n.inputs)}
    parts = {} if needed is None else _parts(plan, instances, needed)
    writer = _Writer(plan, instances, coupling, parts)
    registers = _registers(plan, coupling)
    return Schedule(
        plan,
        initial=tuple(writer.outputs(initial=True)),
        outputs=tuple(writer.outputs(needed=needed)),
        observed=tuple(writer.outputs()),
        updates=tuple(writer.updates()),
        registers=tuple(r for r, _, _ in registers),
        labels=tuple(label for _, label, _ in registers),
        start=tuple(value for _, _, value in registers),
        coupling=coupling,
        partly=parts,
    )


def _parts(
    plan: Plan, instances: Mapping[str, FmuInstance], needed: Collection[int]
) -> dict[str, tuple[int, ...]]:
    """Return the places of the outputs that are needed of an FMU, where that is not all.

    What an FMU of others goes on from might hang on what it was asked for.
    """
    if isinstance(plan.algorithm, GaussSeidel) and len(plan.network.fmus) > 1:
        return {}  # within a tick all are read
    parts = {}
    for node in plan.nodes:
        if isinstance(node.block, Fmu):
            instance = instances[node.name]
            places = tuple(n for n, j in enumerate(node.outputs) if j in needed)
            whole = len(places) == len(node.outputs)
            if not whole and instance.steps_inline and instance.is_ours:
                parts[node.name] = places
    return parts


def slaves(plan: Plan) -> list[int]:
    """Return the nodes that are stepped in parallel with the FMUs: Jacobi's Python blocks."""
    return [i for i, node in enumerate(plan.nodes) if is_slave(node, plan.algorithm)]


def starts(plan: Plan) -> list[Any]:
    """Return the nodes' states at the start."""
    return [_start(node) for node in plan.nodes]


def _registers(plan: Plan, coupling: Coupling) -> list[tuple[str, str, Any]]:
    nodes = zip(plan.nodes, starts(plan), strict=True)
    found = [(f"x{i}", f"state {n.name}", start) for i, (n, start) in enumerate(nodes)]
    found += [(f"y{j}", f"signal {port}", 0.0) for j, port in enumerate(plan.ports)]
    for i in slaves(plan):
        for j in plan.nodes[i].outputs:
            found.append((f"z{j}", f"next {plan.ports[j]}", 0.0))
    if coupling.is_always:
        found.append(("m", "coupling", ()))
    else:
        found += [(f"p{j}", f"last {plan.ports[j]}", None) for j in coupling.extrapolated]
    for i in plan.network.events:
        if plan.nodes[i].announces and not coupling.is_always:
            found.append((f"e{i}", f"event {plan.nodes[i].name}", -float("inf")))
    return found


def _start(node: Node) -> Any:
    if isinstance(node.block, Delay):
        return [0.0] * node.ring
    try:
        return node.block.start()
    except RailcosimError:
        raise
    except Exception as error:
        what = f"block '{node.name}': start() failed: {type(error).__name__}: {error}"
        raise DiagramError(what) from error


@dataclass
class _Writer:
    plan: Plan
    instances: Mapping[str, FmuInstance]
    coupling: Coupling
    parts: Mapping[str, tuple[int, ...]]
    slaves: list[int] = field(init=False)
    _made: dict[int, Operation] = field(default_factory=dict)  # outputs of blocks, by place

    def __post_init__(self) -> None:
        self.slaves = slaves(self.plan)

    # Outputs

    def outputs(
        self, *, initial: bool = False, needed: Collection[int] | None = None
    ) -> list[Operation]:
        operations: list[Operation] = []
        loops = {loop.start: loop for loop in self.plan.loops}
        inside = {i for loop in self.plan.loops for i in loop}
        for i, node in enumerate(self.plan.nodes):
            if i in self.slaves and not initial:
                operations += [
                    Move(result=f"y{j}", source=f"z{j}", every=node.ticks, node=node.name)
                    for j in node.outputs
                ]
            elif i in loops and (initial or not self.slaves):
                operations.append(self._loop(loops[i]))
            elif i not in inside or self.slaves:
                if isinstance(node.block, Fmu):
                    operations.append(self._read(node, needed))
                    continue
                if i not in self._made:
                    self._made[i] = self._output(i, node)
                operations.append(self._made[i])
        return [o for o in operations if not (isinstance(o, Read) and not o.values)]

    def _read(self, node: Node, needed: Collection[int] | None) -> Operation:
        slots = self.instances[node.name].output_slots
        values = tuple(
            (f"y{j}", array, slot)
            for j, (array, slot, _) in zip(node.outputs, slots, strict=True)
            if needed is None or j in needed
        )
        return Read(values=values, node=node.name, every=node.ticks)

    def _output(self, i: int, node: Node) -> Operation:
        block = node.block
        if isinstance(block, Delay):
            return past(self.plan, i, result=f"y{node.outputs[0]}")
        if block.feedthrough:
            return self._step(i, node, [f"y{j}" for j in node.outputs])
        return Call(
            function=block.output,
            arguments=(f"x{i}", *_time(node), *(f"y{j}" for j in node.direct)),
            results=_plain([f"y{j}" for j in node.outputs]),
            node=node.name,
            every=node.ticks,
        )

    def _step(self, i: int, node: Node, results: Sequence[str]) -> Call:
        return Call(
            function=node.block.step,
            arguments=(f"x{i}", *_time(node), *(f"y{j}" for j in node.inputs)),
            results=(_plain(results) or "_", f"x{i}"),
            node=node.name,
            every=node.ticks,
        )

    def _loop(self, loop: range) -> Call:
        solver = self.plan.algorithm.loops
        assert solver is not None
        group = LoopSolver(self.plan, loop, solver)
        states = [f"x{i}" for i in loop]
        return Call(
            function=group.solve,
            arguments=("k", *states, *(f"y{j}" for j in (*group.outside, *group.inside))),
            results=(*states, *(f"y{j}" for j in group.inside)),
        )

    # Updates

    def updates(self) -> list[Operation]:
        operations: list[Operation] = []
        nodes = list(enumerate(self.plan.nodes))
        for i, node in nodes:
            if isinstance(node.block, Delay):
                source = f"y{node.inputs[0]}"
                operations.append(
                    Keep(ring=f"x{i}", length=node.ring, source=source, node=node.name)
                )
        operations += self._coupled()
        for i, node in nodes:
            block = node.block
            if isinstance(block, Fmu):
                if node.ticks > 1:
                    operations.append(self.advance(node, {}))
            elif i in self.slaves:
                operations.append(self._step(i, node, [f"z{j}" for j in node.outputs]))
            elif not block.feedthrough and type(block).update is not Block.update:
                operations.append(self._update(i, node))
        return operations

    def _update(self, i: int, node: Node) -> Call:
        return Call(
            function=node.block.update,
            arguments=(f"x{i}", *_time(node), *(f"y{j}" for j in node.inputs)),
            results=f"x{i}",
            node=node.name,
            every=node.ticks,
        )

    def _coupled(self) -> list[Operation]:
        """Return the operations that bring the FMUs of every tick from t_k to t_{k+1}."""
        if not self.plan.network.fmus:
            return []
        coupling, network = self.coupling, self.plan.network
        arguments = (
            *(f"y{j}" for j in range(len(self.plan.signals))),
            *(f"x{i}" for i in network.between),
        )
        if coupling.is_always:
            return [Call(function=coupling.tick, arguments=("k", "m", *arguments), results="m")]
        operations = straight(self.plan, self.instances, coupling.extrapolated, self.advance)
        kept = [Move(result=f"p{j}", source=f"y{j}") for j in coupling.extrapolated]
        division = divided(self.plan, self.instances, tuple(operations), self.parts)
        tests: list[Any] = []
        announcing: list[Operation] = []
        for i in network.events:
            node = self.plan.nodes[i]
            if isinstance(node.block, Delay):
                tests += [] if division else edges(self.plan, i)
            else:
                tests.append(Due(event=f"e{i}"))
                announcing.append(_announced(i, node))
        operations = operations if division is None else [division]
        if not tests:
            return [*operations, *kept]
        last = tuple(f"p{j}" for j in coupling.extrapolated)
        call = Call(function=coupling.split, arguments=("k", last, *arguments), results=None)
        branch = Branch(tests=tuple(tests), call=call, otherwise=tuple(operations))
        return [*announcing, branch, *kept]

    def advance(self, node: Node, ahead: Mapping[int, str]) -> Advance:
        """Return the step of an FMU; `ahead` has the registers of signals known for its end."""
        types, first_order = self.plan.types, self.coupling.extrapolation
        inputs = []
        for j, (_, _, convert) in zip(
            node.inputs, self.instances[node.name].input_slots, strict=True
        ):
            end = ahead.get(j)
            if end is None:
                inputs.append(Input(value=f"y{j}"))
            elif first_order and not (convert or self.plan.signals[j] in types):
                inputs.append(Input(value=f"y{j}", ahead=end))
            else:
                inputs.append(Input(value=end))
        return Advance(
            instance=self.instances[node.name],
            inputs=tuple(inputs),
            span=float(self.plan.clock.step * node.ticks),
            node=node.name,
            every=node.ticks,
            outputs=self.parts.get(node.name),
        )


def _announced(i: int, node: Node) -> Operation:
    """Return what finds a source's next event: once it has passed, or if it depends on a state."""

    def checked(x: Any, t: float) -> float:
        return next_event(node, x, t)

    if type(node.block).update is Block.update:
        return Announce(event=f"e{i}", function=checked, state=f"x{i}", node=node.name)
    return Call(function=checked, arguments=(f"x{i}", "t"), results=f"e{i}", node=node.name)


def _time(node: Node) -> tuple[str, ...]:
    return ("t",) if node.block.timed else ()


def _plain(registers: Sequence[str]) -> Any:
    """Return one register by itself, several as a tuple, none as None."""
    return registers[0] if len(registers) == 1 else tuple(registers) or None
