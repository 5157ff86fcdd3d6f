"""The rules of the station-stop paper: error E and its rate EC to the control U, over levels.

The paper gives the levels of E and EC, the sets' names and where those of E peak. Its membership
tables 1 and 2, its rules and its query table are lost. The degrees, the rules and the levels of U
below are ours. The paper counts 8 sets of EC; 13 levels with one zero carry 7, which is our
reading.
"""

from .fuzzy.levels import Levels
from .fuzzy.relation import Relation

NAMES = ("NL", "NM", "NS", "NO", "PO", "PS", "PM", "PL")  # large, medium, small, zero
SEVEN_NAMES = ("NL", "NM", "NS", "O", "PS", "PM", "PL")

Degrees = dict[str, float]


def _mirrored(degrees: Degrees) -> Degrees:
    turned = str.maketrans("+-", "-+")
    return {name.translate(turned): degree for name, degree in degrees.items()}


# The positive sets, ours; the negative ones mirror them.
_ZERO = {"+0": 1.0, "+1": 0.6, "+2": 0.1}
_SMALL = {"+0": 0.3, "+1": 0.8, "+2": 1.0, "+3": 0.5, "+4": 0.1}
_MEDIUM = {"+2": 0.2, "+3": 0.7, "+4": 1.0, "+5": 0.7, "+6": 0.2}
_LARGE = {"+3": 0.1, "+4": 0.4, "+5": 0.8, "+6": 1.0}
_SMALL_RATE = {"+1": 0.9, "+2": 1.0, "+3": 0.7, "+4": 0.2}
_NO_RATE = {"-1": 0.5, "0": 1.0, "+1": 0.5}

_E_POSITIVE = (_ZERO, _SMALL, _MEDIUM, _LARGE)
_EC_POSITIVE = (_SMALL_RATE, _MEDIUM, _LARGE)

_E_LEVELS = {f"{k:+d}": float(k) for k in range(-6, 0)} | {"-0": 0.0, "+0": 0.0}
_E_LEVELS |= {f"{k:+d}": float(k) for k in range(1, 7)}
_LEVELS = {f"{k:+d}" if k else "0": float(k) for k in range(-6, 7)}

E_LEVELS = Levels.of(
    dict(zip(NAMES, (*map(_mirrored, reversed(_E_POSITIVE)), *_E_POSITIVE), strict=True)),
    _E_LEVELS,
)
EC_LEVELS = Levels.of(
    dict(
        zip(
            SEVEN_NAMES,
            (*map(_mirrored, reversed(_EC_POSITIVE)), _NO_RATE, *_EC_POSITIVE),
            strict=True,
        )
    ),
    _LEVELS,
)
# Seven uniform triangles that peak at −6, −4 … 6.
U_LEVELS = Levels.of(
    {
        label: {
            name: 1.0 - abs(value - peak) / 2.0
            for name, value in _LEVELS.items()
            if abs(value - peak) < 2.0
        }
        for label, peak in zip(SEVEN_NAMES, range(-6, 7, 2), strict=True)
    },
    _LEVELS,
)

# Rows E, NL … PL; columns EC, NL … PL. −3 … 3 are U's NL … PL.
_RULES = (
    (-3, -3, -3, -3, -2, -1, 0),
    (-3, -3, -3, -2, -2, 0, 0),
    (-3, -3, -2, -1, 0, 1, 2),
    (-2, -2, -1, 0, 0, 1, 2),
    (-2, -1, 0, 0, 1, 2, 2),
    (-2, -1, 0, 1, 2, 3, 3),
    (0, 0, 2, 2, 3, 3, 3),
    (0, 1, 2, 3, 3, 3, 3),
)

STOP_RELATION = Relation(
    rows=E_LEVELS,
    columns=EC_LEVELS,
    output=U_LEVELS,
    rules=tuple(tuple(k + 3 for k in row) for row in _RULES),
)
