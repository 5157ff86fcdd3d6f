"""The plan of a diagram while some of its ports are faulty."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from ..algorithms import Master
from ..diagram import Diagram, Port
from ..plan import Plan, make_plan
from .fault import FaultBlock


def faulty_plan(
    diagram: Diagram,
    start: float | Fraction,
    algorithm: Master,
    rings: Mapping[str, int],
    faults: Mapping[str, FaultBlock],
) -> Plan:
    """Return the plan with a block on each faulty port.

    The signal of a faulty output is what readers see; what the block itself gives is hidden
    behind another name, and so is what a faulty input gets.
    """
    if not faults:
        return make_plan(diagram, start, algorithm, rings)
    wired = Diagram(diagram.name, step=diagram.step)
    for name, block in diagram.blocks.items():
        wired.add(name, block)
    names = {port: _free_name(diagram, number) for number, port in enumerate(faults)}
    outputs: dict[Port, str] = {}
    inputs: dict[Port, str] = {}
    for spelling, block in faults.items():
        wired.add(names[spelling], block)
        name, _, port = spelling.partition(".")
        ends = outputs if port in diagram.block(name).outputs else inputs
        ends[Port(name, port)] = names[spelling]
    for target, source in diagram.connections.items():
        seen = f"{outputs[source]}.y" if source in outputs else str(source)
        if target in inputs:
            wired.connect(seen, f"{inputs[target]}.u")
            seen = f"{inputs[target]}.y"
        wired.connect(seen, str(target))
    for source, name in outputs.items():
        wired.connect(str(source), f"{name}.u")
    plan = make_plan(wired, start, algorithm, rings)
    return _renamed(plan, {names[p]: p for p in faults}, {str(p) for p in outputs})


def _free_name(diagram: Diagram, number: int) -> str:
    name = f"fault_{number}"
    while name in diagram.blocks:
        name += "_"
    return name


def _renamed(plan: Plan, ports: Mapping[str, str], outputs: set[str]) -> Plan:
    """Give a faulty output's signal to its fault block."""
    names = {}
    for block, port in ports.items():
        names[f"{block}.y"] = port if port in outputs else f"{port} (faulty)"
    names |= {port: f"{port} (before its fault)" for port in outputs}
    nodes = tuple(
        replace(node, name=f"fault on {ports[node.name]}") if node.name in ports else node
        for node in plan.nodes
    )
    signals = tuple(names.get(signal, signal) for signal in plan.signals)
    ports_of = {f"{block}.y": f"fault on {port}" for block, port in ports.items()}
    made_by = tuple(ports_of.get(port, port) for port in plan.ports)
    units = {names.get(signal, signal): unit for signal, unit in plan.units.items()}
    types = {names.get(signal, signal): kind for signal, kind in plan.types.items()}
    return replace(plan, nodes=nodes, signals=signals, ports=made_by, units=units, types=types)
