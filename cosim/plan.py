"""The schedule of a diagram: order of blocks, periods in ticks, and which signal drives what."""

from dataclasses import dataclass
from fractions import Fraction
from graphlib import CycleError, TopologicalSorter

from ..base.errors import AlgebraicLoopError, DiagramError, listing
from .block import Block
from .blocks.delay import Delay
from .clock import Clock, rational
from .diagram import Diagram, Port


@dataclass(frozen=True)
class Node:
    """A block in the plan. `inputs` and `outputs` are places in the plan's list of signals."""

    name: str
    block: Block
    ticks: int
    feedthrough: bool
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


@dataclass(frozen=True)
class Plan:
    """A diagram made ready to run: nodes in the order of their outputs within a tick."""

    name: str
    clock: Clock
    nodes: tuple[Node, ...]
    signals: tuple[str, ...]
    units: dict[str, str]


def make_plan(diagram: Diagram, start: float | Fraction) -> Plan:
    """Return the plan; raise DiagramError for an open input, AlgebraicLoopError for a loop."""
    clock = Clock(diagram.step, rational(start))
    blocks, connections = diagram.blocks, diagram.connections
    _require_driven(diagram)
    feedthrough = {name: _feedthrough(block, clock) for name, block in blocks.items()}
    signals = [Port(name, port) for name, block in blocks.items() for port in block.outputs]
    place = {port: i for i, port in enumerate(signals)}
    nodes = []
    for name in _order(diagram, feedthrough):
        block = blocks[name]
        span = block.period
        ticks = 1 if span is None else clock.ticks(span, f"block '{name}': period")
        inputs = tuple(place[connections[Port(name, port)]] for port in block.inputs)
        outputs = tuple(place[Port(name, port)] for port in block.outputs)
        nodes.append(Node(name, block, ticks, feedthrough[name], inputs, outputs))
    units = {str(port): unit for port in signals if (unit := diagram.unit(port)) is not None}
    return Plan(diagram.name, clock, tuple(nodes), tuple(str(s) for s in signals), units)


def _feedthrough(block: Block, clock: Clock) -> bool:
    """Return whether the outputs need this tick's inputs; for a delay that depends on the step."""
    if isinstance(block, Delay):
        return block.split(clock.step)[0] == 0
    return block.feedthrough and bool(block.inputs)


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


def _order(diagram: Diagram, feedthrough: dict[str, bool]) -> list[str]:
    """Return the blocks such that each with feedthrough comes after what drives it."""
    needs: dict[str, set[str]] = {name: set() for name in diagram.blocks}
    for target, source in diagram.connections.items():
        if feedthrough[target.block]:
            needs[target.block].add(source.block)
    try:
        return list(TopologicalSorter({n: sorted(needs[n]) for n in needs}).static_order())
    except CycleError:
        raise AlgebraicLoopError(_loop_message(diagram, feedthrough)) from None


def _loop_message(diagram: Diagram, feedthrough: dict[str, bool]) -> str:
    import networkx as nx

    graph = nx.DiGraph()
    for target, source in diagram.connections.items():
        if feedthrough[target.block]:
            graph.add_edge(source.block, target.block, ports=f"{source} → {target}")
    chain = [graph.edges[a, b]["ports"] for a, b in nx.find_cycle(graph)]
    return (
        f"'{diagram.name}' has an algebraic loop: {', '.join(chain)}; "
        "put a block without direct feedthrough into it, such as a Delay of one step or more"
    )
