"""A plant's variables, and what is checked when one is declared."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real
from typing import Literal

import casadi as ca

from ..base.errors import DeclarationError

Kind = Literal["input", "parameter", "dependent", "state", "mode", "memory", "output"]
Variability = Literal["continuous", "discrete", "fixed", "tunable"]
KINDS: tuple[Kind, ...] = (
    "input", "parameter", "dependent", "state", "mode", "memory", "output"
)  # fmt: skip
Number = float | Iterable[float]

# FMI's structured naming convention, without quoted names. Array indices come from the size; an
# empty pair of brackets says where they go if not at the end.
_PART = r"[A-Za-z_]\w*(\[\])?"
_NAME = re.compile(rf"{_PART}(\.{_PART})*", re.ASCII)
RESERVED = "solver."


@dataclass(frozen=True)
class Variable:
    """A declared variable: `size` None means a scalar, a number a vector of that length.

    `start`, `minimum`, `maximum` and `nominal` hold one number for each element (or are None).
    `exposed` says that a state, mode or memory is an output as well.
    """

    name: str
    kind: Kind
    unit: str
    description: str
    size: int | None
    start: tuple[float, ...] | None
    minimum: tuple[float, ...] | None
    maximum: tuple[float, ...] | None
    nominal: tuple[float, ...] | None
    variability: Variability
    symbol: ca.MX
    exposed: bool = False

    @property
    def length(self) -> int:
        """Number of elements."""
        return 1 if self.size is None else self.size

    @property
    def element_names(self) -> tuple[str, ...]:
        """Scalar names: "speed"; "force[1]", "force[2]", …; "vehicle[1].v" for "vehicle[].v"."""
        if self.size is None:
            return (self.name,)
        pattern = self.name if "[]" in self.name else f"{self.name}[]"
        return tuple(pattern.replace("[]", f"[{i + 1}]") for i in range(self.size))


def check_name(name: str, where: str, size: int | None = None) -> None:
    """Raise DeclarationError for a name that FMI forbids or the solver uses."""
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name.count("[]") > 1:
        raise DeclarationError(
            f"{where}: FMI's structured names are letters, digits and _ with dots between, "
            "and do not start with a digit"
        )
    if "[]" in name and size is None:
        raise DeclarationError(f"{where}: '[]' in a name stands for an index; give a size")
    if f"{name}.".startswith(RESERVED):
        raise DeclarationError(f"{where}: names that begin with '{RESERVED}' are the solver's")


def elements(value: Number | None, size: int | None, where: str) -> tuple[float, ...] | None:
    """Return one number for each element; raise DeclarationError for anything else."""
    if value is None:
        return None
    try:
        if isinstance(value, str):
            raise TypeError
        # Real: Python's and numpy's numbers.
        many = (value,) if isinstance(value, Real | float | int) else value
        numbers = [float(v) for v in many]
    except (TypeError, ValueError):
        raise DeclarationError(f"{where}: {value!r} is not a number or a list of them") from None
    if len(numbers) == 1 and size is not None:
        numbers *= size
    if len(numbers) != (size or 1):
        raise DeclarationError(f"{where}: {len(numbers)} values given for {size or 1} elements")
    return tuple(numbers)


def check_bounds(
    where: str,
    start: tuple[float, ...] | None,
    low: tuple[float, ...] | None,
    high: tuple[float, ...] | None,
    nominal: tuple[float, ...] | None,
) -> None:
    """Raise DeclarationError for values that are not finite, or do not fit each other."""
    for numbers in (start, low, high, nominal):
        if numbers and not all(math.isfinite(n) for n in numbers):
            raise DeclarationError(f"{where}: values and bounds must be finite")
    if low and high and any(a > b for a, b in zip(low, high, strict=True)):
        raise DeclarationError(f"{where}: minimum lies above maximum")
    if nominal and any(n <= 0.0 for n in nominal):
        raise DeclarationError(f"{where}: nominal must be positive")
    for i, value in enumerate(start or ()):
        a = low[i] if low else -math.inf
        b = high[i] if high else math.inf
        if not a <= value <= b:
            raise DeclarationError(f"{where}: start {value:g} lies outside [{a:g}, {b:g}]")
