"""A plan as straight-line Python: one function for many ticks, one for a tick's outputs alone.

The text of a tick is the same in both. States and signals are local variables (x0, y0, …), so
that a step costs no look-up; an FMU's inputs and outputs are slots of its arrays.
"""

import hashlib
import linecache
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..base.errors import DiagramError, RailcosimError
from .block import Block
from .blocks.delay import Delay
from .blocks.fmu import Fmu
from .fmu_instance import FmuInstance
from .plan import Node, Plan


@dataclass(frozen=True)
class Program:
    """The generated functions, with what is needed to explain a failure inside them.

    advance(k, end, values, pack, buffer, size) runs ticks k … end−1 and returns the values then;
    observe(k, values) returns the values after the outputs of tick k. Values are the nodes'
    states followed by the signals.
    """

    source: str
    filename: str
    advance: Callable[..., list[Any]]
    observe: Callable[[int, Sequence[Any]], list[Any]]
    node_of_line: dict[int, str]
    pack_line: int
    start: tuple[Any, ...]


class _Text:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.node_of_line: dict[int, str] = {}

    def add(self, depth: int, text: str, node: str | None = None) -> None:
        self.lines.append("    " * depth + text)
        if node is not None:
            self.node_of_line[len(self.lines)] = node


def generate(plan: Plan, instances: dict[str, FmuInstance], record: Sequence[int]) -> Program:
    """Write, compile and return the program of a plan; `record` are the signals to keep."""
    names: dict[str, Any] = {}
    states = [f"x{i}" for i in range(len(plan.nodes))]
    everything = ", ".join([*states, *(f"y{i}" for i in range(len(plan.signals)))])
    text = _Text()
    text.add(0, "def advance(k, end, values, pack, buffer, size):")
    text.add(1, f"[{everything}] = values")
    text.add(1, "row = 0")
    text.add(1, "while k < end:")
    _outputs(text, 2, plan, names, instances)
    kept = "".join(f", y{i}" for i in record)
    text.add(2, f"pack(buffer, row{kept})")
    pack_line = len(text.lines)
    text.add(2, "row += size")
    _updates(text, 2, plan, names, instances)
    text.add(2, "k += 1")
    text.add(1, f"return [{everything}]")
    text.add(0, "")
    text.add(0, "def observe(k, values):")
    text.add(1, f"[{everything}] = values")
    _outputs(text, 1, plan, names, instances)
    text.add(1, f"return [{everything}]")
    source = "\n".join(text.lines) + "\n"
    digest = hashlib.sha256(source.encode()).hexdigest()[:12]
    filename = f"<railcosim diagram '{plan.name}' {digest}>"
    # In linecache a traceback through the generated code shows its lines.
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    exec(compile(source, filename, "exec"), names)
    start = (*(_start(node, plan) for node in plan.nodes), *([0.0] * len(plan.signals)))
    return Program(
        source, filename, names["advance"], names["observe"], text.node_of_line, pack_line, start
    )


def _start(node: Node, plan: Plan) -> Any:
    if isinstance(node.block, Delay):
        whole, _ = node.block.split(plan.clock.step)
        return [0.0] * (whole + 2)
    try:
        return node.block.start()
    except RailcosimError:
        raise
    except Exception as error:
        what = f"block '{node.name}': start() failed: {type(error).__name__}: {error}"
        raise DiagramError(what) from error


def _time(plan: Plan) -> str:
    a, b, q = plan.clock.integers
    ticks = "k" if b == 1 else f"k * {b}"
    return f"t = ({a} + {ticks}) / {q}" if a else f"t = {ticks} / {q}"


def _hit(text: _Text, depth: int, node: Node) -> int:
    """Write the condition under which a slower block has a sample hit; return the new depth."""
    if node.ticks == 1:
        return depth
    text.add(depth, f"if k % {node.ticks} == 0:", node.name)
    return depth + 1


def _outputs(
    text: _Text, depth: int, plan: Plan, names: dict[str, Any], instances: dict[str, FmuInstance]
) -> None:
    if _needs_time(plan):
        text.add(depth, _time(plan))
    for i, node in enumerate(plan.nodes):
        block, inner = node.block, _hit(text, depth, node)
        y = ", ".join(f"y{j}" for j in node.outputs)
        u = "".join(f", y{j}" for j in node.inputs)
        t = ", t" if block.timed else ""
        if isinstance(block, Fmu):
            for j, (array, slot, _) in zip(
                node.outputs, instances[node.name].output_slots, strict=True
            ):
                names[f"out{j}"] = array
                text.add(inner, f"y{j} = out{j}[{slot}]", node.name)
        elif isinstance(block, Delay):
            text.add(inner, f"{y} = {_delayed(i, node, plan, names)}", node.name)
        elif block.feedthrough:
            names[f"step{i}"] = block.step
            target = f"({y}), x{i}" if len(node.outputs) > 1 else f"{y or '_'}, x{i}"
            text.add(inner, f"{target} = step{i}(x{i}{t}{u})", node.name)
        else:
            names[f"output{i}"] = block.output
            text.add(inner, f"{y or '_'} = output{i}(x{i}{t})", node.name)


def _updates(
    text: _Text, depth: int, plan: Plan, names: dict[str, Any], instances: dict[str, FmuInstance]
) -> None:
    for i, node in enumerate(plan.nodes):
        block = node.block
        u = "".join(f", y{j}" for j in node.inputs)
        if isinstance(block, Fmu):
            inner = _hit(text, depth, node)
            instance = instances[node.name]
            slots = zip(node.inputs, instance.input_slots, strict=True)
            for n, (j, (array, slot, convert)) in enumerate(slots):
                names[f"in{i}_{n}"] = array
                value = f"{convert.__name__}(y{j})" if convert else f"y{j}"
                text.add(inner, f"in{i}_{n}[{slot}] = {value}", node.name)
            names[f"advance{i}"] = instance.advance
            span = float(plan.clock.step * node.ticks)
            text.add(inner, f"advance{i}(t, {span!r})", node.name)
        elif isinstance(block, Delay):
            size = block.split(plan.clock.step)[0] + 2
            text.add(depth, f"x{i}[k % {size}] = y{node.inputs[0]}", node.name)
        elif not block.feedthrough and type(block).update is not Block.update:
            inner = _hit(text, depth, node)
            names[f"update{i}"] = block.update
            t = ", t" if block.timed else ""
            text.add(inner, f"x{i} = update{i}(x{i}{t}{u})", node.name)


def _delayed(i: int, node: Node, plan: Plan, names: dict[str, Any]) -> str:
    """Return the delay's formula: u[k−n] + f·(u[k−n−1] − u[k−n]), or the history before that."""
    block = node.block
    assert isinstance(block, Delay)
    whole, part = block.split(plan.clock.step)
    size, u = whole + 2, f"y{node.inputs[0]}"
    new = u if whole == 0 else f"x{i}[(k - {whole}) % {size}]"
    if part:
        old = f"x{i}[(k - {whole + 1}) % {size}]"
        formula = f"{new} + {part!r} * ({old} - {new})"
    else:
        formula = new
    ticks = whole + 1 if part else whole
    if not ticks:
        return formula
    if callable(block.initial):
        names[f"history{i}"] = block.history
        return f"{formula} if k >= {ticks} else history{i}(t - {float(block.time)!r})"
    return f"{formula} if k >= {ticks} else {float(block.initial)!r}"


def _needs_time(plan: Plan) -> bool:
    return any(
        node.block.timed
        or isinstance(node.block, Fmu)
        or (isinstance(node.block, Delay) and callable(node.block.initial))
        for node in plan.nodes
    )
