"""A Python block as a CasADi function: its step traced on symbols."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca

from ..base.errors import BuildError
from ..cosim.block import Block
from ..models.expressions import exact_expressions, has_nan_constant


def trace(block: Block, *, parameters: Sequence[str] = ()) -> ca.Function:
    """Return the function (x, u, p) -> (y, x_next) of a block with direct feedthrough.

    x is the block's state as a flat vector, in the order of its nested tuple; u its inputs and y
    its outputs in the ports' order; p the parameters named in `parameters`, which become symbols
    while all others stay numbers. Raise BuildError for a block whose step cannot be traced:
    one that branches on a value, or uses functions that know no symbols.
    """
    what = f"{type(block).__name__} cannot be traced"
    if not block.feedthrough or block.timed:
        raise BuildError(f"{what}: only blocks with feedthrough and without time can")
    start = block.start()
    with exact_expressions():
        p = [ca.SX.sym(name) for name in parameters]
        if p:
            block = replace(block, **dict(zip(parameters, p, strict=True)))  # pyright: ignore
        x = [ca.SX.sym(f"x{i}") for i in range(len(flat(start)))]
        u = [ca.SX.sym(name) for name in block.inputs]
        try:
            y, following = block.step(_nested(start, iter(x)), *u)
        except (RuntimeError, TypeError, ValueError, NotImplementedError) as error:
            words = str(error).partition("\n")[0]
            raise BuildError(
                f"{what}: {words}; use railcosim.base.ops instead of if, and, min, max and math"
            ) from error
        outputs = y if isinstance(y, tuple) else (y,)
        results = [_column(outputs), _column(flat(following))]
        for result in results:
            if has_nan_constant(result):
                raise BuildError(f"{what}: it holds a NaN, as math's functions give on symbols")
        arguments = [_column(x), _column(u), _column(p)]
        names = (["x", "u", "p"], ["y", "x_next"])
        return ca.Function(type(block).__name__, arguments, results, *names)


def flat(state: Any) -> list[Any]:
    """Return a nested tuple's leaves in order."""
    if isinstance(state, tuple):
        return [leaf for part in state for leaf in flat(part)]
    return [state]


def _column(values: Sequence[Any]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *map(ca.SX, values))


def _nested(like: Any, leaves: Any) -> Any:
    if isinstance(like, tuple):
        return tuple(_nested(part, leaves) for part in like)
    return next(leaves)
