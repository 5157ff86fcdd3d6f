"""Checks of what a user gives; each raises ParameterError with what is expected."""

import math
from numbers import Real
from typing import Any

from ...base.errors import ParameterError


def require_kind(owner: str, name: str, value: Any, kind: type, remedy: str) -> None:
    """Refuse what is not an instance of a kind."""
    if not isinstance(value, kind):
        raise ParameterError(
            f"{owner}: {name} must be {_a(kind.__name__)}, not {shown(value)}; {remedy}"
        )


def require_section(owner: str, value: Any) -> None:
    """Refuse what is not a line's section, or alike in what is needed of one."""
    needed = ("length", "gradients", "speed_limits", "limit_at")
    if not all(hasattr(value, name) for name in needed):
        raise ParameterError(
            f"{owner}: section must be a Section, as line.section('A', 'B') gives, "
            f"not {shown(value)}"
        )


def require_numbers(owner: str, **values: Any) -> None:
    """Refuse values that are not finite numbers."""
    for name, value in values.items():
        number = isinstance(value, Real) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise ParameterError(f"{owner}: {name} must be a number, not {value!r}")


def shown(value: Any) -> str:
    """Return a short text for a value: a text or number itself, else what it is."""
    if value is None or isinstance(value, str | bool | int | float):
        return repr(value)
    return _a(value.__name__ if isinstance(value, type) else type(value).__name__)


def _a(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
