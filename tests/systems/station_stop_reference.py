"""The stop once more, from the study sheet alone: table by loops, train by exact formulas.

Nothing of railcosim is imported. Between samples the brake follows its demand as an exponential, so
that speed and place are closed forms; the standstill is found by bisection.
"""

import math
from functools import cache

import numpy as np
from scipy.optimize import brentq

# Degrees of the positive sets; the negative ones mirror them.
E_SETS = {
    4: {7: 1, 8: 0.6, 9: 0.1}, 5: {7: 0.3, 8: 0.8, 9: 1, 10: 0.5, 11: 0.1},
    6: {9: 0.2, 10: 0.7, 11: 1, 12: 0.7, 13: 0.2}, 7: {10: 0.1, 11: 0.4, 12: 0.8, 13: 1},
}  # fmt: skip
EC_SETS = {
    3: {5: 0.5, 6: 1, 7: 0.5}, 4: {7: 0.9, 8: 1, 9: 0.7, 10: 0.2},
    5: {8: 0.2, 9: 0.7, 10: 1, 11: 0.7, 12: 0.2}, 6: {9: 0.1, 10: 0.4, 11: 0.8, 12: 1},
}  # fmt: skip
RULES = [[-3,-3,-3,-3,-2,-1,0],[-3,-3,-3,-2,-2,0,0],[-3,-3,-2,-1,0,1,2],[-2,-2,-1,0,0,1,2],
         [-2,-1,0,0,1,2,2],[-2,-1,0,1,2,3,3],[0,0,2,2,3,3,3],[0,1,2,3,3,3,3]]  # fmt: skip


@cache
def table(maxima: bool) -> list[list[float]]:
    """Return the 14 by 13 table, each cell by max-min over all rules and levels."""
    e_sets = {7 - s: {13 - k: d for k, d in row.items()} for s, row in E_SETS.items()} | E_SETS
    ec_sets = {6 - s: {12 - k: d for k, d in row.items()} for s, row in EC_SETS.items()} | EC_SETS
    found = []
    for i in range(14):
        row = []
        for j in range(13):
            degrees = []
            for level in range(-6, 7):
                best = 0.0
                for a in range(8):
                    for b in range(7):
                        u = max(0.0, 1.0 - abs(level - 2 * RULES[a][b]) / 2.0)
                        best = max(best, min(e_sets[a].get(i, 0), ec_sets[b].get(j, 0), u))
                degrees.append(best)
            levels = range(-6, 7)
            if maxima:
                top = [k for k, d in zip(levels, degrees, strict=True) if d == max(degrees)]
                row.append(sum(top) / len(top))
            else:
                moment = sum(k * d for k, d in zip(levels, degrees, strict=True))
                row.append(moment / sum(degrees))
        found.append(row)
    return found


def nearest(x: float) -> int:
    """Return the nearest whole number, halves away from zero."""
    whole = math.floor(abs(x))
    return int(math.copysign(whole + (abs(x) - whole >= 0.5), x))


def bounded(x: float) -> float:
    return min(max(x, -6.0), 6.0)


def looked_up(cells: list[list[float]], e: float, ec: float, e_range: float, ec_range: float):
    x, y = bounded(6.0 / e_range * e), bounded(6.0 / ec_range * ec)
    row = 7 + nearest(x) if e >= 0.0 else 6 + nearest(x)
    return cells[row][6 + nearest(y)]


def between(cells: list[list[float]], e: float, ec: float, e_range: float, ec_range: float):
    """Bilinear, the rows −0 and +0 merged into their mean at e = 0."""
    zero = [0.5 * (a + b) for a, b in zip(cells[6], cells[7], strict=True)]
    rows = np.array([*cells[:6], zero, *cells[8:]])
    x, y = bounded(6.0 / e_range * e) + 6.0, bounded(6.0 / ec_range * ec) + 6.0
    column = [np.interp(y, np.arange(13), row) for row in rows]
    return float(np.interp(x, np.arange(13), column))


def stop(name: str, speed: float, place: float, lag: float, effectiveness: float) -> float:
    """Return the place of standstill in cm of one stop."""
    cells = table(name in ("mean_of_maxima", "smooth"))
    x, v, b, last = place, speed, 0.8, None
    while True:
        e = -100.0 * (x + v * v / 1.6)
        ec = 0.0 if last is None else (e - last) / 0.1
        last = e
        if name == "open_loop":
            level = 0.0
        elif name == "smooth":
            level = between(cells, e, ec, 10.0 + 5.0 * v, 10.0 + 50.0 * v)
        else:
            level = looked_up(cells, e, ec, 10.0, 20.0 if name == "centroid_ec20" else 10.0)
        demand = 0.8 - 0.4 * level / 6.0

        def brake_integrals(t: float, d: float = demand, start: float = b) -> tuple[float, float]:
            """Return ∫ b and ∫∫ b from the sample to t after it."""
            decay = 1.0 - math.exp(-t / lag)
            once = d * t + (start - d) * lag * decay
            twice = 0.5 * d * t * t + (start - d) * lag * (t - lag * decay)
            return once, twice

        def speed_at(t: float, v: float = v) -> float:
            return v - effectiveness * brake_integrals(t)[0]

        end = 0.1
        if speed_at(0.1) <= 0.0:
            end = float(brentq(speed_at, 0.0, 0.1, xtol=1e-15))  # pyright: ignore[reportArgumentType]
        once, twice = brake_integrals(end)
        x += v * end - effectiveness * twice
        if end < 0.1:
            return 100.0 * x
        v -= effectiveness * once
        b = demand + (b - demand) * math.exp(-0.1 / lag)
