"""Whether a diagram can be changed as a scenario says; raises for what cannot be."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ...base.errors import DiagramError, ParameterError, listing, suggest
from ..block import Block
from ..blocks.delay import Delay
from ..blocks.fmu import Fmu
from ..fmu.file import read_description
from .bias import Bias
from .change import Fault
from .drop_out import DropOut
from .override import Override

if TYPE_CHECKING:
    from ..diagram import Diagram


def check_fault(diagram: "Diagram", fault: Fault) -> None:
    """Check that the port is there, and that a port of whole numbers stays one."""
    name, _, port = fault.port.partition(".")
    block = diagram.block(name)
    ports = [*block.outputs, *block.inputs]
    if port not in ports:
        raise DiagramError(
            f"block '{name}' has no port '{port}'; ports: {listing(ports)}{suggest(port, ports)}"
        )
    kind = block.types.get(port, "Real")
    if isinstance(block, Fmu):
        variables = read_description(block.path).modelVariables
        kind = next(v.type for v in variables if v.name == port)
    if kind != "Real":
        _check_whole(fault, {"int64": "Integer", "bool": "Boolean"}.get(kind, kind))


def _check_whole(fault: Fault, kind: str) -> None:
    values: list[Any] = []
    if isinstance(fault, Bias):
        values = [fault.offset]
        if kind == "Boolean":
            raise ParameterError(f"{fault.port} is a Boolean, to which nothing can be added")
    elif isinstance(fault, Override) and fault.profile is not None:
        values = [value for _, value in fault.profile]
        if any(a[0] != b[0] and a[1] != b[1] for a, b in pairwise(fault.profile)):
            raise ParameterError(f"{fault.port} is a {kind}, which has no slopes; use jumps")
    elif isinstance(fault, Override | DropOut) and fault.value != "last":
        values = [fault.value]
    allowed = (0, 1) if kind == "Boolean" else None
    for value in values:
        if value != int(value) or (allowed and value not in allowed):
            raise ParameterError(f"{fault.port} is a {kind}, {value!r} is not")


def check_parameter(diagram: "Diagram", spelling: str, value: Any) -> None:
    """Check that a parameter is there, takes the value, and may change while a run goes on."""
    name, _, parameter = spelling.partition(".")
    block = diagram.block(name)
    if isinstance(block, Fmu):
        _check_fmu(block, name, parameter, value)
    elif block.run_by_engine:
        block.with_parameter(parameter, value)
        remedy = ""
        if isinstance(block, Delay) and parameter == "time":
            remedy = f"; use SetDelay('{name}', …)"
        raise ParameterError(f"'{spelling}' cannot change in a run{remedy}")
    else:
        _check_same_form(block, block.with_parameter(parameter, value), spelling)


def _check_fmu(block: Fmu, name: str, parameter: str, value: Any) -> None:
    if parameter in block.inputs:
        raise ParameterError(
            f"'{parameter}' of {block.path.name} is an input port, not a parameter; "
            f"use Override('{name}.{parameter}', …)"
        )
    block.with_parameter(parameter, value)
    variables = {v.name: v for v in read_description(block.path).modelVariables}
    if parameter not in variables:
        raise ParameterError(
            f"'{parameter}' of {block.path.name} is a vector; change its elements one by one"
        )
    variable = variables[parameter]
    if variable.causality == "input":
        return
    if variable.causality != "parameter":
        raise ParameterError(
            f"'{parameter}' of {block.path.name} is a start value: it acts before a run only"
        )
    if variable.variability != "tunable":
        tunable = [
            v.name
            for v in variables.values()
            if v.causality == "parameter" and v.variability == "tunable"
        ]
        raise ParameterError(
            f"'{parameter}' of {block.path.name} cannot change in a run: its variability is "
            f"'{variable.variability}'; tunable parameters: {listing(tunable)}"
        )


def _check_same_form(old: Block, new: Block, spelling: str) -> None:
    """Check that neither ports, schedule nor the state's form depend on the parameter."""
    for what in ("inputs", "outputs", "period", "feedthrough", "timed"):
        if getattr(old, what) != getattr(new, what):
            raise ParameterError(
                f"'{spelling}' cannot change in a run: the block's {what} would change"
            )
    try:
        same = _form(old.start()) == _form(new.start())
    except Exception:  # a start that fails is told by the run itself
        return
    if not same:
        raise ParameterError(f"'{spelling}' cannot change in a run: the state would not fit")


def _form(state: Any) -> Any:
    return tuple(map(_form, state)) if isinstance(state, tuple | list) else None


def check_delay(diagram: "Diagram", name: str) -> None:
    """Check that a block is a Delay."""
    block = diagram.block(name)
    if isinstance(block, Delay):
        return
    remedy = ""
    if "delay" in block.inputs:
        remedy = f"; use Override('{name}.delay', …)"
    else:
        delays = [n for n, b in diagram.blocks.items() if isinstance(b, Delay)]
        remedy = f"; delays: {listing(delays)}"
    raise DiagramError(f"block '{name}' is a {type(block).__name__}, no Delay{remedy}")
