"""The schedule of a diagram: order of blocks, periods in ticks, and which signal drives what."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ..base.errors import AlgebraicLoopError, DiagramError, listing
from .algorithms import Jacobi, Master, TwoPhase
from .block import Block
from .blocks.delay import Delay
from .blocks.fmu import Fmu
from .clock import Clock, is_time, rational
from .coupling.algebraic import check_guess
from .coupling.network import Network, is_stateless, make_network
from .diagram import Diagram, Port
from .order import loop_chain, ordered


@dataclass(frozen=True)
class Node:
    """A block in the plan. `inputs` and `outputs` are places in the plan's list of signals.

    `direct` are the places of those inputs that the outputs need at the same instant. Of a delay,
    `ring` is how many samples the engine keeps, `steps` its time in steps, and `whole` and `part`
    are what `Delay.split` makes of that.
    """

    name: str
    block: Block
    ticks: int
    direct: tuple[int, ...]
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    ring: int = 0
    steps: Fraction = Fraction(0)
    whole: int = 0
    part: float = 0.0

    @classmethod
    def of_delay(
        cls,
        name: str,
        block: Delay,
        step: Fraction,
        ring: int,
        inputs: tuple[int, ...],
        outputs: tuple[int, ...],
    ) -> "Node":
        """Return the node of a delay whose ring has at least a length."""
        steps = block.steps(step)
        whole, part = block.split_steps(steps)
        direct = () if whole else inputs
        # One sample more than are read at ticks: a held signal's edge lies between them.
        ring = max(ring, whole + 3)
        return cls(name, block, 1, direct, inputs, outputs, ring, steps, whole, part)

    @property
    def continuous(self) -> bool:
        """Whether the outputs are continuous signals, not sampled and held ones."""
        return self.ticks == 1 and self.block.continuous

    @property
    def announces(self) -> bool:
        """Whether the block is a source that announces its events."""
        return self.ticks == 1 and not self.inputs and self.block.has_events


@dataclass(frozen=True)
class Plan:
    """A diagram made ready to run: nodes in the order of their outputs within a tick.

    `loops` are ranges of nodes that form algebraic loops, to be solved. `order` are the FMUs as
    they are stepped. `ports` are the outputs that give the signals: other names only where a fault
    lies between. `types` is what a signal holds if no float.
    """

    name: str
    clock: Clock
    algorithm: Master
    nodes: tuple[Node, ...]
    signals: tuple[str, ...]
    ports: tuple[str, ...]
    units: dict[str, str]
    types: dict[str, str]
    loops: tuple[range, ...]
    network: Network

    @property
    def order(self) -> tuple[str, ...]:
        """The FMUs that take part in every base step, in the order in which they are stepped."""
        return tuple(self.nodes[i].name for i in self.network.fmus)


def make_plan(
    diagram: Diagram,
    start: float | Fraction,
    algorithm: Master | None = None,
    rings: Mapping[str, int] | None = None,
    like: Plan | None = None,
) -> Plan:
    """Return the plan; raise DiagramError for an open input, AlgebraicLoopError for a loop.

    `rings` are least lengths of delays' rings, for a delay that will grow. `like` is a plan of the
    same diagram, but for its blocks' parameters, start and algorithm included: order and wiring
    are taken from it where the blocks allow.
    """
    if like is not None and (found := _like(like, diagram, rings or {})) is not None:
        return found
    algorithm = TwoPhase() if algorithm is None else algorithm
    if not isinstance(algorithm, Master):
        raise DiagramError(f"algorithm must be one of railcosim's, such as {TwoPhase()!r}, not "
                           f"{algorithm!r}")  # fmt: skip
    if not is_time(start):
        raise DiagramError(f"start must be a time in s, not {start!r}")
    clock = Clock(diagram.step, rational(start))
    blocks = diagram.blocks
    _require_driven(diagram)
    signals = [Port(name, port) for name, block in blocks.items() for port in block.outputs]
    place = {port: i for i, port in enumerate(signals)}
    nodes = {
        name: _node(diagram, name, clock, place, (rings or {}).get(name, 0)) for name in blocks
    }
    needs = {name: {signals[i].block for i in node.direct} for name, node in nodes.items()}
    groups = ordered(needs)
    if algorithm.loops is None:
        for group in groups:
            if _is_loop(group, needs):
                raise AlgebraicLoopError(_loop_message(diagram, nodes, signals, algorithm))
    in_order = [nodes[name] for group in groups for name in group]
    units = {str(port): unit for port in signals if (unit := diagram.unit(port)) is not None}
    loops = _loops(groups, needs)
    unknown = {j for loop in loops for i in loop for j in in_order[i].outputs}
    unknown |= {j for node in in_order if isinstance(node.block, Fmu) for j in node.outputs}
    check_guess(algorithm.loops, [str(signals[j]) for j in sorted(unknown)])
    return Plan(
        name=diagram.name,
        clock=clock,
        algorithm=algorithm,
        nodes=tuple(in_order),
        signals=tuple(str(s) for s in signals),
        ports=tuple(str(s) for s in signals),
        units=units,
        types={f"{n}.{p}": kind for n, b in blocks.items() for p, kind in b.types.items()},
        loops=loops,
        network=make_network(in_order, algorithm),
    )


def _node(diagram: Diagram, name: str, clock: Clock, place: dict[Port, int], ring: int) -> Node:
    block, connections = diagram.block(name), diagram.connections
    span = block.period
    ticks = 1 if span is None else clock.ticks(span, f"block '{name}': period")
    inputs = tuple(place[connections[Port(name, port)]] for port in block.inputs)
    outputs = tuple(place[Port(name, port)] for port in block.outputs)
    if isinstance(block, Delay):
        return Node.of_delay(name, block, clock.step, ring, inputs, outputs)
    direct = inputs if block.feedthrough and not isinstance(block, Fmu) else ()
    if block.direct and not block.feedthrough:
        ports = list(block.inputs)
        direct = tuple(inputs[ports.index(port)] for port in block.direct)
    return Node(name, block, ticks, direct, inputs, outputs)


def _like(plan: Plan, diagram: Diagram, rings: Mapping[str, int]) -> Plan | None:
    """Return a plan with a diagram's blocks in it; None if one does not fit into its place."""
    nodes = []
    for node in plan.nodes:
        block, name = diagram.block(node.name), node.name
        if block is node.block and name not in rings:
            nodes.append(node)
        elif isinstance(block, Delay) and isinstance(node.block, Delay):
            ring = rings.get(name, 0)
            made = Node.of_delay(name, block, plan.clock.step, ring, node.inputs, node.outputs)
            if made.direct != node.direct or block.continuous != node.block.continuous:
                return None
            nodes.append(made)
        elif _fits(block, node.block):
            nodes.append(_changed(node, block=block))
        else:
            return None
    return _changed(plan, nodes=tuple(nodes))


def _changed(value: Any, **fields: Any) -> Any:
    """Return what dataclasses.replace does, of a class without slots, quickly."""
    made = object.__new__(type(value))
    made.__dict__.update(value.__dict__, **fields)
    return made


def _fits(new: Block, old: Block) -> bool:
    """Return whether a plan does not tell two blocks apart."""
    if type(new) is not type(old):
        return False
    if isinstance(new, Fmu) and isinstance(old, Fmu):
        return new.form() == old.form() and new.period == old.period
    return all(getattr(new, what) == getattr(old, what) for what in _FORM) and (
        not new.continuous or is_stateless(new) == is_stateless(old)
    )


_FORM = (
    "inputs", "outputs", "feedthrough", "direct", "timed", "is_wire", "continuous",
    "run_by_engine", "shares_unit", "period", "types",
)  # fmt: skip


def _is_loop(group: tuple[str, ...], needs: dict[str, set[str]]) -> bool:
    return any(name in needs[other] for name in group for other in group)


def _loops(groups: list[tuple[str, ...]], needs: dict[str, set[str]]) -> tuple[range, ...]:
    loops, first = [], 0
    for group in groups:
        if _is_loop(group, needs):
            loops.append(range(first, first + len(group)))
        first += len(group)
    return tuple(loops)


def _require_driven(diagram: Diagram) -> None:
    open_inputs = [
        f"{name}.{port}"
        for name, block in diagram.blocks.items()
        for port in block.inputs
        if Port(name, port) not in diagram.connections
    ]
    if open_inputs:
        raise DiagramError(
            f"'{diagram.name}' has open inputs: {listing(open_inputs)}; connect them "
            "(to a Constant if nothing else)"
        )
    if not diagram.blocks:
        raise DiagramError(f"'{diagram.name}' has no blocks")


def _loop_message(
    diagram: Diagram, nodes: dict[str, Node], signals: list[Any], algorithm: Master
) -> str:
    direct = {name: {str(signals[i]) for i in node.direct} for name, node in nodes.items()}
    arrows = [
        (source.block, target.block, f"{source} → {target}")
        for target, source in diagram.connections.items()
        if str(source) in direct[target.block]
    ]
    # Slaves break a loop from the first step on, but not for what they show before it.
    when = " at the start" if isinstance(algorithm, Jacobi) else ""
    return (
        f"'{diagram.name}' has an algebraic loop{when}: {', '.join(loop_chain(arrows))}; put a "
        "block without direct feedthrough into it, such as a Delay of one step or more, or have it "
        f"solved: algorithm={type(algorithm).__name__}(loops=Newton())"
    )
