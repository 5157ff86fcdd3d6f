"""How FMUs are coupled: which of them drive each other, directly or through continuous blocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...base.errors import DiagramError, listing, suggest
from ..algorithms import GaussSeidel, Jacobi, Master, StepDoubling
from ..block import Block
from ..blocks.delay import Delay
from ..blocks.fmu import Fmu
from ..order import ordered

if TYPE_CHECKING:
    from ..plan import Node


@dataclass(frozen=True)
class Network:
    """Places of nodes in the plan.

    `fmus` step at every tick, in this order. `between` lie between them and are evaluated within a
    step too: continuous blocks without state, delays, sources. `circles` are groups of FMUs that
    drive each other, each in an order of their own, or a single FMU. `events` are nodes of
    `between` that may jump between ticks.
    """

    fmus: tuple[int, ...]
    between: tuple[int, ...]
    circles: tuple[tuple[int, ...], ...]
    events: tuple[int, ...]


def make_network(nodes: "Sequence[Node]", algorithm: Master) -> Network:
    """Return the network of the plan's nodes; raise DiagramError for a wrong GaussSeidel order."""
    maker = {signal: i for i, node in enumerate(nodes) for signal in node.outputs}
    fmus = [i for i, node in enumerate(nodes) if isinstance(node.block, Fmu) and node.ticks == 1]
    fmus.sort(key=lambda i: nodes[i].outputs[:1])  # signals lie in the order of adding
    needed = {signal for i in fmus for signal in nodes[i].inputs}
    between = []
    for i in reversed(range(len(nodes))):
        node = nodes[i]
        if needed.isdisjoint(node.outputs) or not _between(node) or is_slave(node, algorithm):
            continue
        between.insert(0, i)
        if not isinstance(node.block, Delay):
            needed |= set(node.inputs)
    drivers = {i: _drivers(nodes, maker, set(between), i, nodes[i].inputs) for i in fmus}
    events = tuple(i for i in between if _may_jump(nodes[i]))
    circles = tuple(
        tuple(int(n) for n in group)
        for group in ordered({str(i): {str(d) for d in drivers[i]} for i in fmus})
    )
    inner = algorithm.inner if isinstance(algorithm, StepDoubling) else algorithm
    if isinstance(inner, GaussSeidel):
        fmus = _gauss_seidel(nodes, maker, set(between), fmus, inner)
    return Network(tuple(fmus), tuple(between), circles, events)


def is_slave(node: "Node", algorithm: Master) -> bool:
    """Return whether a Python block is stepped in parallel with the FMUs, as Jacobi does.

    What it gives is sampled, and held until its next hit.
    """
    block = node.block
    slave = block.feedthrough and node.inputs and not (block.run_by_engine or block.is_wire)
    return bool(slave) and isinstance(algorithm, Jacobi)


def _between(node: "Node") -> bool:
    if isinstance(node.block, Fmu):
        return False
    if isinstance(node.block, Delay):
        return True
    return node.announces or node.block.is_wire or (node.continuous and is_stateless(node.block))


def is_stateless(block: Block) -> bool:
    """Return whether a block has no state."""
    try:
        state = block.start()
        return isinstance(state, tuple) and not state
    except Exception:  # named when the run starts
        return False


def _may_jump(node: "Node") -> bool:
    return isinstance(node.block, Delay) or node.announces


def _drivers(
    nodes: "Sequence[Node]",
    maker: dict[int, int],
    between: set[int],
    place: int,
    inputs: Sequence[int],
) -> set[int]:
    """Return the FMUs whose outputs reach these inputs at the same instant."""
    found: set[int] = set()
    todo, seen = list(inputs), set()
    while todo:
        source = maker[todo.pop()]
        node = nodes[source]
        if isinstance(node.block, Fmu):
            if node.ticks == 1:
                found.add(source)
        elif source in between and source not in seen and not isinstance(node.block, Delay):
            seen.add(source)
            todo += node.inputs
    return found


def _gauss_seidel(
    nodes: "Sequence[Node]",
    maker: dict[int, int],
    between: set[int],
    fmus: list[int],
    algorithm: GaussSeidel,
) -> list[int]:
    by_name = {nodes[i].name: i for i in fmus}
    if algorithm.order is None:
        needs = {}
        for i in fmus:
            block: Any = nodes[i].block
            ports = zip(block.inputs, nodes[i].inputs, strict=True)
            inputs = [signal for port, signal in ports if port in block.direct_inputs]
            drivers = _drivers(nodes, maker, between, i, inputs)
            needs[nodes[i].name] = {nodes[d].name for d in drivers}
        return [by_name[name] for group in ordered(needs) for name in group]
    for name in algorithm.order:
        if name not in by_name:
            raise DiagramError(
                f"GaussSeidel order: '{name}' is no FMU that steps at every base step; those are: "
                f"{listing(by_name)}{suggest(name, by_name)}"
            )
    if sorted(algorithm.order) != sorted(by_name):
        missing = [name for name in by_name if name not in algorithm.order]
        twice = [n for n in dict.fromkeys(algorithm.order) if algorithm.order.count(n) > 1]
        wrong = [f"{listing(missing)} missing"] if missing else []
        wrong += [f"{listing(twice)} named twice"] if twice else []
        raise DiagramError(f"GaussSeidel order must name each FMU once: {' and '.join(wrong)}")
    return [by_name[name] for name in algorithm.order]
