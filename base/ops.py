"""Operations that mean the same on floats and on CasADi symbols, to round-off.

A controller written with these runs as plain Python and can be traced into C. CasADi is
imported only when a symbol turns up: asking a symbol for its truth value raises RuntimeError.

On NaN the two differ: C's fmin and fmax drop a NaN, the Python forms may keep it. The master
refuses NaN before it matters. Outside a function's domain (log of 0, exp of 1000) floats raise as
Python's math does, and symbols give an infinity or NaN: keep arguments inside by maximum or clip.
"""

import math
from typing import Any


def _casadi() -> Any:
    import casadi

    return casadi


def is_symbol(a: Any) -> bool:
    """Return whether `a` is a CasADi expression rather than a number."""
    return type(a).__module__.startswith("casadi")


def _is_number(a: Any) -> bool:
    return type(a) is float or not is_symbol(a)  # the first is quick and nearly always holds


def minimum(a: Any, b: Any) -> Any:
    """Return the smaller of two values."""
    try:
        return a if a < b else b
    except RuntimeError:
        return _casadi().fmin(a, b)


def maximum(a: Any, b: Any) -> Any:
    """Return the larger of two values."""
    try:
        return a if a > b else b
    except RuntimeError:
        return _casadi().fmax(a, b)


def clip(a: Any, low: Any, high: Any) -> Any:
    """Return `a` limited to [low, high]."""
    try:
        return low if a < low else high if a > high else a
    except RuntimeError:
        return _casadi().fmin(_casadi().fmax(a, low), high)


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return `a` where the condition holds, else `b`; both are evaluated."""
    try:
        return a if condition else b
    except RuntimeError:
        return _casadi().if_else(condition, a, b)


def absolute(a: Any) -> Any:
    """Return |a|."""
    return _casadi().fabs(a) if is_symbol(a) else math.fabs(a)


def exp(a: Any) -> Any:
    """Return e to the power of `a`."""
    return math.exp(a) if _is_number(a) else _casadi().exp(a)


def log(a: Any) -> Any:
    """Return the natural logarithm of `a` > 0."""
    return math.log(a) if _is_number(a) else _casadi().log(a)


def sqrt(a: Any) -> Any:
    """Return the square root of `a` ≥ 0."""
    return math.sqrt(a) if _is_number(a) else _casadi().sqrt(a)


def floor(a: Any) -> Any:
    """Return the largest whole number that is not above `a`, as a float."""
    return float(math.floor(a)) if _is_number(a) else _casadi().floor(a)


def round_half_away(a: Any) -> Any:
    """Return `a` rounded to a whole number, halves away from zero, exactly.

    Not by floor(a + ½): the float below ½ and ½ add up to 1.
    """
    size = absolute(a)
    whole = floor(size)
    whole = whole + where(size - whole >= 0.5, 1.0, 0.0)
    return where(a < 0.0, -whole, whole)


def erf(a: Any) -> Any:
    """Return the error function, 2/√π ∫₀ᵃ exp(−t²) dt."""
    return math.erf(a) if _is_number(a) else _casadi().erf(a)


def erfinv(a: Any) -> Any:
    """Return the inverse of the error function for −1 < a < 1.

    Three polynomials in w = −log(1 − a²), by M. Giles, "Approximating the erfinv function" (GPU
    Computing Gems, 2011), right to three units of round-off. CasADi's own is not: it errs by 1e-11
    at one half and by 1e-6 near 1.
    """
    w = -log((1.0 - a) * (1.0 + a))
    if _is_number(a):
        if w < 6.25:
            return _polynomial(_CENTRE, w - 3.125) * a
        root = math.sqrt(w)
        return (_polynomial(_TAIL, root - 3.25) if w < 16.0 else _polynomial(_END, root - 5.0)) * a
    root = sqrt(w)
    tail = where(w < 16.0, _polynomial(_TAIL, root - 3.25), _polynomial(_END, root - 5.0))
    return where(w < 6.25, _polynomial(_CENTRE, w - 3.125), tail) * a


def _polynomial(coefficients: tuple[float, ...], t: Any) -> Any:
    total: Any = coefficients[0]
    for c in coefficients[1:]:
        total = c + total * t
    return total


# erfinv's coefficients, of the highest power first: for w below 6.25, below 16, and up to 36.
_CENTRE = (
    -3.6444120640178196996e-21, -1.685059138182016589e-19, 1.2858480715256400167e-18,
    1.115787767802518096e-17, -1.333171662854620906e-16, 2.0972767875968561637e-17,
    6.6376381343583238325e-15, -4.0545662729752068639e-14, -8.1519341976054721522e-14,
    2.6335093153082322977e-12, -1.2975133253453532498e-11, -5.4154120542946279317e-11,
    1.051212273321532285e-09, -4.1126339803469836976e-09, -2.9070369957882005086e-08,
    4.2347877827932403518e-07, -1.3654692000834678645e-06, -1.3882523362786468719e-05,
    0.0001867342080340571352, -0.00074070253416626697512, -0.0060336708714301490533,
    0.24015818242558961693, 1.6536545626831027356,
)  # fmt: skip
_TAIL = (
    2.2137376921775787049e-09, 9.0756561938885390979e-08, -2.7517406297064545428e-07,
    1.8239629214389227755e-08, 1.5027403968909827627e-06, -4.013867526981545969e-06,
    2.9234449089955446044e-06, 1.2475304481671778723e-05, -4.7318229009055733981e-05,
    6.8284851459573175448e-05, 2.4031110387097893999e-05, -0.0003550375203628474796,
    0.00095328937973738049703, -0.0016882755560235047313, 0.0024914420961078508066,
    -0.0037512085075692412107, 0.005370914553590063617, 1.0052589676941592334,
    3.0838856104922207635,
)  # fmt: skip
_END = (
    -2.7109920616438573243e-11, -2.5556418169965252055e-10, 1.5076572693500548083e-09,
    -3.7894654401267369937e-09, 7.6157012080783393804e-09, -1.4960026627149240478e-08,
    2.9147953450901080826e-08, -6.7711997758452339498e-08, 2.2900482228026654717e-07,
    -9.9298272942317002539e-07, 4.5260625972231537039e-06, -1.9681778105531670567e-05,
    7.5995277030017761139e-05, -0.00021503011930044477347, -0.00013871931833623122026,
    1.0103004648645343977, 4.8499064014085844221,
)  # fmt: skip


def finite(a: Any) -> bool:
    """Return whether `a` is a finite number; symbols pass."""
    return is_symbol(a) or (isinstance(a, int | float) and math.isfinite(a))
