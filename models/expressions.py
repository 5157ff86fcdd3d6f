"""CasADi expressions: traced as they are written, and free of NaN."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import casadi as ca


@contextmanager
def exact_expressions() -> Iterator[None]:
    """Keep CasADi from simplifying what is traced, so that C repeats Python's bits."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)


def has_nan_constant(expression: Any) -> bool:
    """Return whether a CasADi MX or SX expression contains a NaN constant."""
    function = ca.Function("f", ca.symvar(expression), [expression])
    if function.is_a("SXFunction"):
        constants = (
            function.instruction_constant(i)
            for i in range(function.n_instructions())
            if function.instruction_id(i) == ca.OP_CONST
        )
        return any(math.isnan(c) for c in constants)
    for i in range(function.n_instructions()):
        if function.instruction_id(i) == ca.OP_CONST:
            values = function.instruction_MX(i).to_DM().nonzeros()
            if any(math.isnan(c) for c in values):
                return True
    return False
