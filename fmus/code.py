"""The generated C of a plant: CasADi's functions, and the tables that the wrapper needs."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ..base.errors import BuildError
from ..models.event import Event
from ..models.expressions import exact_expressions
from ..models.solver import DormandPrince, Rodas, RungeKutta4, SemiImplicitEuler, Solver
from .functions import Functions
from .layout import SOLVER, Layout, Scalar

GUID_MARK = "@GUID@"


@dataclass(frozen=True)
class Method:
    """How the wrapper carries a solver: its source, slopes to store, whether it adapts its step."""

    source: str
    stages: int
    adaptive: bool
    needs: tuple[str, ...] = ()


METHODS: dict[type[Solver], Method] = {
    RungeKutta4: Method("solver_runge_kutta_4.h", 4, False),
    SemiImplicitEuler: Method("solver_semi_implicit_euler.h", 1, False),
    DormandPrince: Method("solver_dormand_prince.h", 7, True, ("error_norm.h",)),
    Rodas: Method("solver_rodas.h", 7, True, ("error_norm.h",)),
}


def plant_c(functions: Functions) -> str:
    """Return plant.c: C for everything that the wrapper calls."""
    if not functions.evaluation.called:
        return "#define casadi_int int\n" + functions.evaluation.text
    with exact_expressions():
        generator = ca.CodeGenerator("plant.c", {"casadi_int": "int", "with_header": False})
        for function in functions.evaluation.called:
            generator.add(function)
        text = generator.dump()
    if "#error" in text:
        raise BuildError(f"plant '{functions.plant.name}': CasADi cannot generate C for it")
    return text + functions.evaluation.text


def plant_h(functions: Functions) -> str:
    """Return plant.h: counts, names, start values, bounds and kinds."""
    layout = functions.layout
    lines = [f'#define MODEL_GUID "{GUID_MARK}"', *_counts(functions)]
    lines += [
        "enum { SET_ANY_TIME, SET_AT_EVENTS, SET_BEFORE_RUN, COMPUTED };",
        "enum { RISING, FALLING, BOTH };",
        "typedef struct { int at, first, count; } Run; /* values, results */",
        _array("const double nominal[SIZE_X]", [_nominal(s) for s in layout.states]),
        *_values(layout),
        *_events(functions),
    ]
    if layout.plant.updates:
        places = [s.reference for n in layout.plant.updates for s in layout.scalars_of(n)]
        lines.append(_runs("updates", places))
    return "\n".join(lines) + "\n"


def _counts(functions: Functions) -> list[str]:
    layout, plant = functions.layout, functions.plant
    n_x = len(layout.states)
    n_z = sum(e.size for e in plant.events if e.kind == "state")
    n_e = sum(e.size for e in plant.events)
    changes = [sum(c.shape[0] for c in e.changes.values()) for e in plant.events]
    updates = sum(value.shape[0] for value in plant.updates.values())
    dense = n_x if isinstance(layout.solver, Rodas) else 1
    method = METHODS[type(layout.solver)]
    counts = {
        "N_X": n_x, "SIZE_X": max(n_x, 1), "N_VALUES": layout.count,
        "N_U": len(layout.inputs), "SIZE_U": max(len(layout.inputs), 1),
        "FIRST_INPUT": layout.first_input, "FIRST_PARAMETER": layout.first_parameter,
        "FIRST_DEPENDENT": layout.first_dependent, "FIRST_DISCRETE": layout.first_discrete,
        "FIRST_OUTPUT": layout.first_output, "FIRST_SOLVER": layout.first_solver,
        "N_DEPENDENTS": len(layout.dependents), "N_UPDATES": updates,
        "N_Z": n_z, "N_E": n_e, "SIZE_E": max(n_e, 1), "N_GROUPS": len(plant.events),
        "SIZE_CHANGES": max(1, updates, *changes),
        "ADAPTIVE": int(method.adaptive), "STAGES": method.stages,
        "HAS_MODEL_EXCHANGE": int(not plant.frictions),
        "SIZE_MATRIX": dense * dense, "SIZE_PIVOT": dense,
        "SIZE_IW": functions.evaluation.integers, "SIZE_W": functions.evaluation.work,
    }  # fmt: skip
    return [
        f'#define SOLVER_SOURCE "{method.source}"',
        *(f"#define {name} {count}" for name, count in counts.items()),
    ]


def _nominal(scalar: Scalar) -> str:
    nominal = scalar.variable.nominal
    return "1.0" if nominal is None else repr(nominal[scalar.index])


def _values(layout: Layout) -> list[str]:
    """Return tables of name, kind, start, bounds and type, in value-reference order."""
    rows = [_row(scalar) for scalar in layout.scalars]
    for name, (_, value) in layout.settings.items():
        low = "1e-9" if name == "inner_step" else "1e-15"
        head = (f'"{SOLVER}{name}"', "SET_BEFORE_RUN", repr(value), low)
        rows.append((*head, "HUGE_VAL", "0", "0"))
    longest = max(len(row[0]) for row in rows) - 1  # quotes, and the zero at the end
    # Arrays, not pointers: each of these would take a relocation as well.
    heads = (
        f"const char variable_name[N_VALUES][{longest}]",
        "const unsigned char kind[N_VALUES]",
        "const double start_value[N_VALUES]",
        "const double minimum[N_VALUES]",
        "const double maximum[N_VALUES]",
        "const unsigned char is_integer[N_VALUES]",
        "const unsigned char is_output[N_VALUES]",
    )
    columns = zip(*rows, strict=True)
    return [_array(head, column) for head, column in zip(heads, columns, strict=True)]


def _row(scalar: Scalar) -> tuple[str, ...]:
    v, i = scalar.variable, scalar.index
    if scalar.is_computed:
        kind = "COMPUTED"
    elif v.kind == "input":
        kind = "SET_ANY_TIME"
    else:
        kind = "SET_AT_EVENTS" if v.variability == "tunable" else "SET_BEFORE_RUN"
    start = 0.0 if scalar.is_computed or v.start is None else v.start[i]
    low = "-HUGE_VAL" if v.minimum is None else repr(v.minimum[i])
    high = "HUGE_VAL" if v.maximum is None else repr(v.maximum[i])
    is_output = scalar.derivative_of is None and (v.exposed or v.kind == "output")
    flags = (str(int(v.kind == "mode")), str(int(is_output)))
    return (f'"{scalar.name}"', kind, repr(start), low, high, *flags)


def _events(functions: Functions) -> list[str]:
    """Return the tables of events: by element, by group, and what each group changes."""
    groups = functions.plant.events
    if not groups:
        return []
    ordered = [e for kind in ("state", "time") for e in groups if e.kind == kind]
    first, place = {}, 0
    for event in ordered:
        first[event.name] = place
        place += event.size
    elements = [(n, e.direction.upper()) for e in ordered for n in e.element_names]
    targets = [_targets(functions.layout, event) for event in groups]
    rates = functions.crossing_rates
    ends = [sum(len(t) for t in targets[:i]) for i in range(len(groups) + 1)]
    flat = [t for group in targets for t in group]
    return [
        _array("const char *const event_name[N_E]", [f'"{n}"' for n, _ in elements]),
        _array("const unsigned char direction[N_E]", [d for _, d in elements]),
        _array(
            "const double crossing_nominal[SIZE_E]",
            [repr(e.nominal) for e in ordered for _ in range(e.size)],
        ),
        _array(
            "const int element_group[N_E]",
            [groups.index(e) for e in ordered for _ in range(e.size)],
        ),
        _array("const int group_first[N_GROUPS]", [first[e.name] for e in groups]),
        _array("const int group_size[N_GROUPS]", [e.size for e in groups]),
        _array("const int group_changes[N_GROUPS + 1]", ends),
        _array(f"const int change_at[{len(flat)}]", [at for at, _ in flat]),
        _array(f"const int change_element[{len(flat)}]", [element for _, element in flat]),
        _array("const Evaluated group_change[N_GROUPS]", [f.name() for f in functions.changes]),
        _array(
            "const Derivative group_rate[N_GROUPS]",
            [rates[e.name].name() if e.name in rates else "NULL" for e in groups],
        ),
    ]


def _targets(layout: Layout, event: Event) -> list[tuple[int, int]]:
    """Return (value reference, element of the event or -1) of each value that it changes."""
    return [
        (scalar.reference, scalar.index if event.size > 1 else -1)
        for name in event.changes
        for scalar in layout.scalars_of(name)
    ]


def _runs(name: str, places: Sequence[int]) -> str:
    """Return a table of where a function's results belong, in runs of neighbours."""
    starts = [i for i, at in enumerate(places) if i == 0 or at != places[i - 1] + 1]
    ends = [*starts[1:], len(places)]
    runs = [f"{{{places[i]}, {i}, {end - i}}}" for i, end in zip(starts, ends, strict=False)]
    return _array(f"const Run {name}[{max(len(runs), 1)}]", runs or ["{0, 0, 0}"])


def _array(head: str, items: Sequence[object]) -> str:
    return f"static {head} = {{\n    " + ",\n    ".join(map(str, items or [0])) + "\n};"
