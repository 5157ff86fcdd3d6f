"""The generated C of a plant: CasADi's functions and the tables that the wrapper needs."""

import casadi as ca

from ..base.errors import BuildError
from ..models.expressions import exact_expressions
from .layout import INNER_STEP, Layout

GUID_MARK = "@GUID@"


def plant_c(layout: Layout) -> str:
    """Return plant.c: CasADi's C for the right-hand side and the outputs."""
    with exact_expressions():
        generator = ca.CodeGenerator("plant.c", {"casadi_int": "int", "with_header": False})
        generator.add(layout.rhs())
        generator.add(layout.outputs_function())
        text = generator.dump()
    if "#error" in text:
        raise BuildError(f"plant '{layout.plant.name}': CasADi cannot generate C for it")
    return text


def plant_h(layout: Layout, inner_step: float) -> str:
    """Return plant.h: counts, argument positions, names, start values, bounds and kinds."""
    functions = (layout.rhs(), layout.outputs_function())
    count = len(layout.states)
    at = [-1, *(layout.scalars_of(v)[0].reference for v in layout.arguments)]
    lines = [
        f'#define MODEL_GUID "{GUID_MARK}"',
        "enum {",
        f"    N_X = {count}, SIZE_X = {max(count, 1)}, N_VALUES = {layout.count},",
        f"    FIRST_PARAMETER = {layout.first_parameter}, FIRST_OUTPUT = {layout.first_output},",
        f"    FIRST_SOLVER = {layout.first_solver}, N_ARGUMENTS = {len(at)},",
        f"    SIZE_ARG = {max(f.sz_arg() for f in functions)},",
        f"    SIZE_RES = {max(f.sz_res() for f in functions)},",
        f"    SIZE_IW = {max(1, *(f.sz_iw() for f in functions))},",
        f"    SIZE_W = {max(1, *(f.sz_w() for f in functions))}",
        "};",
        "enum { SET_ANY_TIME, SET_BEFORE_RUN, COMPUTED };",
        _array("const int argument_at[N_ARGUMENTS]", [str(a) for a in at]),
    ]
    rows = _rows(layout, inner_step)
    columns = [list(column) for column in zip(*rows, strict=True)]
    heads = (
        "const char *const variable_name[N_VALUES]",
        "const unsigned char kind[N_VALUES]",
        "const double start_value[N_VALUES]",
        "const double minimum[N_VALUES]",
        "const double maximum[N_VALUES]",
    )
    lines += [_array(head, column) for head, column in zip(heads, columns, strict=True)]
    return "\n".join(lines) + "\n"


def _rows(layout: Layout, inner_step: float) -> list[tuple[str, str, str, str, str]]:
    """Return (name, kind, start, minimum, maximum) of every value, in value-reference order."""
    rows = []
    blocks = (layout.states, layout.derivatives, layout.inputs, layout.parameters, layout.outputs)
    for scalar in (s for block in blocks for s in block):
        v, i = scalar.variable, scalar.index
        computed = scalar.derivative_of is not None or v.kind == "output"
        free = v.kind == "input" or v.variability == "tunable"
        start = 0.0 if computed or v.start is None else v.start[i]
        low = "-HUGE_VAL" if v.minimum is None else repr(v.minimum[i])
        high = "HUGE_VAL" if v.maximum is None else repr(v.maximum[i])
        kind = "COMPUTED" if computed else "SET_ANY_TIME" if free else "SET_BEFORE_RUN"
        rows.append((f'"{scalar.name}"', kind, repr(start), low, high))
    rows.append((f'"{INNER_STEP}"', "SET_BEFORE_RUN", repr(inner_step), "1e-9", "HUGE_VAL"))
    return rows


def _array(head: str, items: list[str]) -> str:
    return f"static {head} = {{\n    " + ",\n    ".join(items) + "\n};"
