"""Units in Modelica's notation ("m/s2", "N.m", "1/s", "km/h") as FMI 2.0 base-unit exponents.

FMI and Modelica share this notation and FMI counts the radian as a base unit, which general
unit libraries do not; hence a table and a parser of our own.
"""

import re
from dataclasses import dataclass
from functools import lru_cache

from .errors import UnitError, suggest

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Unit:
    """A unit: SI value = factor · value + offset, with exponents of FMI's eight base units."""

    exponents: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0

    def base_unit(self) -> dict[str, int | float]:
        """Return the non-default attributes of FMI 2.0's <BaseUnit> element."""
        attributes: dict[str, int | float] = {
            name: power for name, power in zip(BASE, self.exponents, strict=True) if power
        }
        if self.factor != 1.0:
            attributes["factor"] = self.factor
        if self.offset != 0.0:
            attributes["offset"] = self.offset
        return attributes


def _unit(factor: float = 1.0, offset: float = 0.0, **powers: int) -> Unit:
    return Unit(tuple(powers.get(name, 0) for name in BASE), factor, offset)


_PREFIXES = {
    "G": 1e9, "M": 1e6, "k": 1e3, "h": 1e2, "d": 1e-1,
    "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9, "p": 1e-12,
}  # fmt: skip
_PREFIXED = {
    "g": _unit(1e-3, kg=1),
    "m": _unit(m=1),
    "s": _unit(s=1),
    "A": _unit(A=1),
    "K": _unit(K=1),
    "mol": _unit(mol=1),
    "cd": _unit(cd=1),
    "rad": _unit(rad=1),
    "Hz": _unit(s=-1),
    "N": _unit(kg=1, m=1, s=-2),
    "Pa": _unit(kg=1, m=-1, s=-2),
    "bar": _unit(1e5, kg=1, m=-1, s=-2),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    "C": _unit(A=1, s=1),
    "V": _unit(kg=1, m=2, s=-3, A=-1),
    "Ohm": _unit(kg=1, m=2, s=-3, A=-2),
    "F": _unit(kg=-1, m=-2, s=4, A=2),
    "H": _unit(kg=1, m=2, s=-2, A=-2),
    "Wb": _unit(kg=1, m=2, s=-2, A=-1),
    "T": _unit(kg=1, s=-2, A=-1),
}
_PLAIN = {
    "1": _unit(),
    "%": _unit(1e-2),
    "‰": _unit(1e-3),
    "deg": _unit(0.017453292519943295, rad=1),
    "min": _unit(60.0, s=1),
    "h": _unit(3600.0, s=1),
    "d": _unit(86400.0, s=1),
    "t": _unit(1e3, kg=1),
    "l": _unit(1e-3, m=3),
    "degC": _unit(1.0, 273.15, K=1),
}
_FACTOR = re.compile(r"([^\d.+\-]+|1)([+-]?\d+)?")


def _symbol(symbol: str, text: str) -> Unit:
    if symbol in _PLAIN:
        return _PLAIN[symbol]
    if symbol in _PREFIXED:
        return _PREFIXED[symbol]
    scale, rest = _PREFIXES.get(symbol[:1]), _PREFIXED.get(symbol[1:])
    if scale is None or rest is None:
        hint = suggest(symbol, [*_PLAIN, *_PREFIXED])
        if symbol.lower() in ("kph", "kmh", "kmph"):
            hint = "; write 'km/h'"
        elif symbol.endswith("^"):
            hint = "; powers follow without a sign: 'm/s2'"
        raise UnitError(f"unknown unit '{symbol}' in '{text}' (notation: m/s2, N.m, 1/s){hint}")
    return Unit(rest.exponents, scale * rest.factor)


@lru_cache
def parse(text: str) -> Unit:
    """Return the meaning of a unit such as "m/s2"; raise UnitError for one that is unknown."""
    if not text or text.strip() != text:
        raise UnitError(f"'{text}' is not a unit; write \"1\" for a dimensionless quantity")
    numerator, slash, denominator = text.partition("/")
    if not numerator or (slash and not denominator):
        raise UnitError(f"'{text}' is not a unit (notation: m/s2, N.m, 1/s)")
    if denominator.startswith("(") and denominator.endswith(")"):
        denominator = denominator[1:-1] or "()"
    powers, factor, offset = [0] * len(BASE), 1.0, 0.0
    for part, sign in ((numerator, 1), (denominator, -1)):
        for piece in part.split(".") if part else []:
            match = _FACTOR.fullmatch(piece)
            if not match:
                raise UnitError(f"'{text}' is not a unit (notation: m/s2, N.m, 1/s)")
            unit = _symbol(match[1], text)
            power = sign * int(match[2] or 1)
            powers = [p + power * q for p, q in zip(powers, unit.exponents, strict=True)]
            factor *= unit.factor**power
            if unit.offset:
                if piece != text:
                    raise UnitError(f"'{text}': {match[1]} has an offset and cannot be combined")
                offset = unit.offset
    return Unit(tuple(powers), factor, offset)


def compatible(a: str, b: str) -> bool:
    """Return whether a value in unit `a` is the same number in unit `b` ("N" and "kg.m/s2")."""
    return a == b or parse(a) == parse(b)
