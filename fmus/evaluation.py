"""The C functions that the wrapper calls for the plant, all called alike:

    name(t, x, u, p, iw, w, result)

t is the time, x and u are the states and inputs, p all values by value reference, iw and w memory
to work in. A step's function (see `Functions`) finds after the time the step's length, and then the
inputs at its end.
Directional derivatives take a seed for each of the first four, dt, dx, du and dp, after them.
The functions are loops (see `loops`) wherever that can be, else they call CasADi's C.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca

from ..models.expressions import exact_expressions
from ..models.variable import Variable
from .layout import Layout
from .loop_code import Writer
from .loop_tracing import loops_of
from .loops import UnsupportedError, codes

_GIVEN = ("t", "x", "u", "p")
_SEEDS = ("dt", "dx", "du", "dp")
_START = """
#if defined(_MSC_VER) && !defined(__clang__)
#define restrict __restrict
#endif

typedef void (*Evaluated)({0});
typedef void (*Derivative)({1});

/* fmin and fmax, which compilers call instead of writing them out. Unlike those they are no number
 * where b is none; to test for it would cost a third of a step of many vehicles. */
static double smaller(double a, double b) {{ return a < b ? a : b; }}
static double larger(double a, double b) {{ return a > b ? a : b; }}
"""


@dataclass(frozen=True)
class Evaluation:
    """The C text, CasADi's functions that it calls, and the memory that all of it needs."""

    text: str
    called: Sequence[ca.Function]
    work: int
    integers: int


def write_evaluation(
    layout: Layout,
    arguments: Sequence[Variable],
    functions: Iterable[ca.Function],
    derivatives: Iterable[ca.Function],
) -> Evaluation:
    """Write functions of time and `arguments` with one column as the result, and derivatives.

    A step's function has its length and the inputs at its end as arguments after those.

    A derivative is CasADi's `forward(1)`, or called as that is: it has the function's own result as
    another argument, which is empty, and then the seeds.
    """
    places = [("t", 0, 1), *(_place(layout, variable) for variable in arguments)]
    step = [("t", 1, 1), *(("t", 2 + at, n) for array, at, n in places if array == "u")]
    seeds = [(f"d{array}", first, length) for array, first, length in places]
    texts = [_START.format(_parameters(_GIVEN), _parameters((*_GIVEN, *_SEEDS)))]
    called, work = [], 0
    jobs = [(f, _GIVEN, [*places, *step][: f.n_in()]) for f in functions]
    jobs += [(f, (*_GIVEN, *_SEEDS), [*places, ("0", 0, 0), *seeds]) for f in derivatives]
    for function, names, at in jobs:
        texts.append(f"static void {function.name()}({_parameters(names, 'restrict ')}) {{")
        try:
            writer = _loops(function, names, at)
            texts += [f"    {statement}" for statement in writer.statements]
            work = max(work, writer.work)
        except UnsupportedError:
            called.append(_renamed(function, f"casadi_{function.name()}"))
            texts += _call(called[-1], at)
        texts.append("}\n")
    work = max([1, work, *(f.sz_w() for f in called)])
    integers = max([1, *(f.sz_iw() for f in called)])
    return Evaluation("\n".join(texts), called, work, integers)


_Place = tuple[str, int, int]  # array, first element, number of elements


def _place(layout: Layout, variable: Variable) -> _Place:
    reference = layout.scalars_of(variable.name)[0].reference
    if variable.kind == "state":
        return "x", reference, variable.length
    if variable.kind == "input":
        return "u", reference - layout.first_input, variable.length
    return "p", reference, variable.length


def _parameters(names: Sequence[str], restrict: str = "") -> str:
    pointers = ", ".join(f"const double *{restrict}{name}" for name in names)
    return f"{pointers},\n        casadi_int *iw, double *{restrict}w, double *{restrict}result"


def _loops(function: ca.Function, names: Sequence[str], places: Sequence[_Place]) -> Writer:
    if function.size2_out(0) != 1:
        raise UnsupportedError
    given = [
        codes(names.index(array) + 1 if length else 0, first + length)[first:]
        for array, first, length in places
    ]
    return Writer(loops_of(function, names, given))


def _renamed(function: ca.Function, name: str) -> ca.Function:
    with exact_expressions():
        symbols = function.mx_in()
        return ca.Function(name, symbols, function.call(symbols, True, False))


def _call(function: ca.Function, places: Sequence[_Place]) -> list[str]:
    pointers = ", ".join(f"{array} + {first}" if n else "0" for array, first, n in places)
    return [
        f"    const double *arg[{function.sz_arg()}] = {{{pointers}}};",
        f"    double *res[{function.sz_res()}] = {{result}};",
        f"    {function.name()}(arg, res, iw, w, 0);",
    ]
