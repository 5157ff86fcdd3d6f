"""FMU steps in straight line: in parallel or one after the other, extrapolated or not.

A signal's value "ahead" is the one it has, or is taken to have, at the step's end. What is held
has none. An FMU output is extrapolated along a line through its last two values, a linear delay
knows its next value, a source's line goes through its value in the step's middle; what lies
behind continuous blocks is computed from those. In Gauss–Seidel order an FMU that has stepped
gives its true values.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..algorithms import GaussSeidel
from ..blocks.delay import Delay
from ..plan import Node, Plan
from .delays import past
from .operations import Call, Line, Operation, Read


def straight(
    plan: Plan,
    instances: Mapping[str, Any],
    extrapolated: Sequence[int],
    advance: Callable[[Node, Mapping[int, str]], Operation],
) -> list[Operation]:
    """Return the operations that bring the FMUs of a plan over one step."""
    ahead: dict[int, str] = {}
    operations: list[Operation] = []
    if plan.algorithm.extrapolation:
        for j in extrapolated:
            operations.append(Line(result=f"a{j}", start=f"p{j}", end=f"y{j}"))
            ahead[j] = f"a{j}"
        operations += _known(plan, ahead)
        operations += _between(plan, ahead, set(ahead))
    in_order = isinstance(plan.algorithm, GaussSeidel)
    for n, i in enumerate(plan.network.fmus):
        node = plan.nodes[i]
        operations.append(advance(node, ahead))
        if in_order and n + 1 < len(plan.network.fmus):
            slots = instances[node.name].output_slots
            values = tuple(
                (f"a{j}", array, slot)
                for j, (array, slot, _) in zip(node.outputs, slots, strict=True)
            )
            operations.append(Read(values=values, node=node.name))
            ahead |= {j: f"a{j}" for j in node.outputs}
            operations += _between(plan, ahead, set(node.outputs))
    return operations


def _known(plan: Plan, ahead: dict[int, str]) -> list[Operation]:
    """Return the operations for what is known in advance: linear delays and continuous sources."""
    operations: list[Operation] = []
    for i in plan.network.between:
        node = plan.nodes[i]
        if not node.continuous or not node.outputs:
            continue
        (j,) = node.outputs[:1]
        if isinstance(node.block, Delay):
            if node.block.split(plan.clock.step)[0] == 0:
                continue  # it needs what the present step brings
            operations.append(past(plan, i, result=f"a{j}", ahead=1))
        elif not node.inputs:
            middle = _results([f"b{j}" for j in node.outputs])
            time = ("tm",) if node.block.timed else ()
            call = Call(
                function=node.block.output,
                arguments=(f"x{i}", *time),
                results=middle,
                node=node.name,
            )
            operations.append(call)
            operations += [
                Line(result=f"a{j}", start=f"y{j}", end=f"b{j}", node=node.name)
                for j in node.outputs
            ]
        else:
            continue
        ahead |= {j: f"a{j}" for j in node.outputs}
    return operations


def _between(plan: Plan, ahead: dict[int, str], changed: set[int]) -> list[Operation]:
    """Return the operations for continuous blocks behind the signals that changed."""
    operations: list[Operation] = []
    for i in plan.network.between:
        node = plan.nodes[i]
        if isinstance(node.block, Delay) or changed.isdisjoint(node.inputs):
            continue
        results = _results([f"a{j}" for j in node.outputs])
        inputs = (ahead.get(j, f"y{j}") for j in node.inputs)
        if node.block.is_wire:
            function, time, target = node.block.passed, "t", results
        else:
            function, time, target = node.block.step, "t1", (results, "_")
        call = Call(
            function=function,
            arguments=(f"x{i}", *((time,) if node.block.timed else ()), *inputs),
            results=target,
            node=node.name,
        )
        operations.append(call)
        ahead |= {j: f"a{j}" for j in node.outputs}
        changed |= set(node.outputs)
    return operations


def _results(registers: list[str]) -> Any:
    return registers[0] if len(registers) == 1 else tuple(registers)
