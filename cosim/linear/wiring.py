"""Which signals a linear system has: its inputs, its outputs, and where its loop is cut."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...base.errors import DiagramError, listing
from ..blocks.fmu import Fmu
from ..diagram import Diagram, Port
from ..plan import Plan
from .block import LinearisationError


@dataclass(frozen=True)
class Wiring:
    """Where the linear system's inputs enter the plan, which signals it shows, and its cut.

    What reads at `cut` gets, in place of the signal, input 0 if the cut `returns`, else nothing.
    """

    inputs: tuple[str, ...]
    outputs: tuple[int, ...]
    ports: dict[tuple[str, int], int]  # (block, place of its input port) -> input
    signals: dict[int, int]  # place of a signal -> input
    cut: frozenset[tuple[str, int]] = frozenset()
    returns: bool = False


def wire(
    diagram: Diagram,
    plan: Plan,
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    open_at: str | None,
) -> Wiring:
    """Return where in the plan the ports lie; raise DiagramError for one that does not exist."""
    cut: frozenset[tuple[str, int]] = frozenset()
    if open_at is not None:
        signal, cut = _cut(diagram, plan, open_at)
        if inputs is None and outputs is None:
            return Wiring((open_at,), (signal,), {}, {}, cut, returns=True)
    named = _sources(plan) if inputs is None else _names(inputs, "inputs")
    shown = plan.signals if outputs is None else _names(outputs, "outputs")
    places = tuple(plan.signals.index(str(diagram.port(name, "output"))) for name in shown)
    ports, signals = {}, {}
    for number, name in enumerate(named):
        port, is_input = _port(diagram, name)
        if is_input:
            ports[port.block, list(diagram.block(port.block).inputs).index(port.name)] = number
        else:
            signals[plan.signals.index(str(port))] = number
    return Wiring(named, places, ports, signals, cut)


def _cut(diagram: Diagram, plan: Plan, open_at: str) -> tuple[int, frozenset[tuple[str, int]]]:
    """Return the place of the signal that is cut, and the input ports that no longer read it."""
    port, is_input = _port(diagram, open_at)
    signal = plan.signals.index(str(diagram.connections[port] if is_input else port))
    cut = {
        (node.name, i)
        for node in plan.nodes
        for i, (name, place) in enumerate(zip(node.block.inputs, node.inputs, strict=True))
        if place == signal and (not is_input or Port(node.name, name) == port)
    }
    if not cut:
        raise DiagramError(f"open_at = '{open_at}': nothing reads it, so there is no loop to cut")
    return signal, frozenset(cut)


def _port(diagram: Diagram, spelling: str) -> tuple[Port, bool]:
    """Return a port and whether it is an input."""
    name, dot, port = spelling.partition(".") if isinstance(spelling, str) else ("", "", "")
    if dot and port in diagram.block(name).outputs and port not in diagram.block(name).inputs:
        return diagram.port(spelling, "output"), False
    return diagram.port(spelling, "input"), True


def _names(names: Sequence[str], what: str) -> tuple[str, ...]:
    names = (names,) if isinstance(names, str) else tuple(names)
    if not names:
        raise DiagramError(f"{what} is empty; a state space needs at least one port there")
    if len(set(names)) < len(names):
        raise DiagramError(f"{what} = {listing(names)}: one is named twice")
    return names


def _sources(plan: Plan) -> tuple[str, ...]:
    """Return the signals of all blocks without inputs but FMUs; where there is none, all signals.

    python-control knows no system without inputs, and a loop left to itself has poles too.
    """
    nodes = [node for node in plan.nodes if not (node.inputs or isinstance(node.block, Fmu))]
    places = sorted(i for node in nodes for i in node.outputs)
    return tuple(plan.signals[i] for i in places) or plan.signals


def require_held(plan: Plan, wiring: Wiring, frame: int, open_at: str) -> None:
    """Raise unless the loop's signal passes the cut once in a frame: only so is it one number."""
    readers = [node for node in plan.nodes if any(node.name == name for name, _ in wiring.cut)]
    (source,) = [node for node in plan.nodes if wiring.outputs[0] in node.outputs]
    if source.ticks == frame or all(node.ticks == frame for node in readers):
        return
    slow = [node for node in plan.nodes if node.ticks == frame]
    ports = [f"{node.name}.{port}" for node in slow for port in node.block.inputs]
    ports += [plan.signals[i] for node in slow for i in node.outputs]
    remedy = (
        f"cut at {listing(ports)}" if ports else "give its blocks periods that divide each other"
    )
    raise LinearisationError(
        f"open_at = '{open_at}' passes several values in the {float(plan.clock.step * frame):g} s "
        f"after which '{plan.name}' repeats itself; {remedy}"
    )
