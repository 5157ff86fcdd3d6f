"""Checks that the parts of a consist share; each error knows the place of what is wrong."""

import math
from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import Any, NoReturn

from ...base.errors import ParameterError
from ..line.profile import place

Pairs = tuple[tuple[float, float], ...]
Path = tuple[int | str, ...]


class Unfit(ParameterError):  # noqa: N818, as Misfit, which a line's checks raise
    """A part that cannot be: whose it is, at which path in it, and what is wrong.

    A reader of a file shows `text` with the path in the file instead.
    """

    def __init__(self, owner: str, path: Path, text: str):
        super().__init__(f"{owner}: {place(*path)}: {text}" if path else f"{owner}: {text}")
        self.path = path
        self.text = text


class Check:
    """The checks of one thing, named `owner` in their errors; each raises Unfit.

    Limits are given in the unit that people use, of which `scale` make one SI unit.
    """

    def __init__(self, owner: str):
        self._owner = owner

    def fail(self, path: Path, text: str) -> NoReturn:
        """Raise Unfit for what lies at `path`."""
        raise Unfit(self._owner, path, text)

    def number(self, path: Path, value: Any) -> float:
        """Return the value as a float, unless it is not a finite number."""
        if isinstance(value, bool) or not isinstance(value, Real):
            self.fail(path, f"a number is needed, not {_shown(value)}")
        try:
            number = float(value)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if not math.isfinite(number):
            self.fail(path, f"a finite number is needed, not {number}")
        return number

    def within(
        self, path: Path, value: Any, low: float, high: float, unit: str, scale: float = 1.0
    ) -> None:
        """Refuse what is not a number from `low` to `high` in the unit."""
        shown = self.number(path, value) * scale
        slack = 1e-9 * (high - low)  # a limit itself is met in spite of the unit's rounding
        if not low - slack <= shown <= high + slack or (low == 0.0 and shown < 0.0):
            gap = f" {unit}" if unit else ""
            self.fail(path, f"{shown:g}{gap} is not within {low:g} to {high:g}{gap}")

    def whole(self, path: Path, value: Any, low: int, high: int) -> None:
        """Refuse what is not a whole number from `low` to `high`."""
        if isinstance(value, bool) or not isinstance(value, Integral):
            self.fail(path, f"a whole number is needed, not {_shown(value)}")
        self.within(path, value, low, high, "")

    def name(self, value: Any) -> None:
        """Refuse what is not a text with letters in it."""
        if not isinstance(value, str) or not value.strip():
            self.fail(("name",), f"a name is needed, not {_shown(value)}")

    def kind(self, path: Path, value: Any, *kinds: type) -> None:
        """Refuse what is not an instance of one of the kinds."""
        if not isinstance(value, kinds):
            names = " or ".join("None" if each is type(None) else each.__name__ for each in kinds)
            self.fail(path, f"{names} is needed, not {_shown(value)}")

    def sequence(self, path: Path, value: Any) -> tuple[Any, ...]:
        """Return what is in a list or tuple, as a tuple."""
        if isinstance(value, str | bytes) or not isinstance(value, Iterable):
            self.fail(path, f"a list is needed, not {_shown(value)}")
        return tuple(value)

    def pairs(self, path: Path, value: Any) -> Pairs:
        """Return a curve as a tuple of pairs of finite numbers; two pairs at least."""
        pairs: list[tuple[float, float]] = []
        for index, pair in enumerate(self.sequence(path, value)):
            numbers = self.sequence((*path, index), pair)
            if len(numbers) != 2:
                self.fail((*path, index), f"a pair is needed, not {len(numbers)} numbers")
            first, second = (
                self.number((*path, index, column), number) for column, number in enumerate(numbers)
            )
            pairs.append((first, second))
        if len(pairs) < 2:
            self.fail(path, f"a curve needs two points or more, not {len(pairs)}")
        return tuple(pairs)

    def rising(
        self, path: Path, values: Sequence[float], column: int, unit: str, scale: float = 1.0
    ) -> None:
        """Refuse values, each the `column` of its pair, that do not rise strictly."""
        for index in range(1, len(values)):
            if values[index] <= values[index - 1]:
                self.fail(
                    (*path, index, column),
                    f"{scale * values[index]:g} {unit} does not lie above the "
                    f"{scale * values[index - 1]:g} {unit} before it",
                )


def settle(part: Any, field: str, value: Any) -> None:
    """Give a frozen dataclass under construction its field in the type it should have."""
    object.__setattr__(part, field, value)


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return f"'{value}'"
    if value is None or isinstance(value, bool | int | float):
        return str(value)
    return f"a {type(value).__name__}"
