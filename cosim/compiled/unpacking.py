"""What a block returns, taken apart where it is no plain tuple."""

import linecache
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..schedule.operations import Registers


@lru_cache(maxsize=256)
def unpacker(results: Registers) -> Callable[[Any], tuple[Any, ...]]:
    """Return the function that takes a block's result apart as a Python statement does.

    If that fails nothing is stored, as with a statement whose first target is the nested tuple.
    """
    target, flat = _target(results), ", ".join(_names(results))
    text = f"def unpack(result):\n    {target} = result\n    return ({flat},)\n"
    filename = f"<railcosim results {target}>"
    linecache.cache[filename] = (len(text), None, text.splitlines(keepends=True), filename)
    names: dict[str, Any] = {}
    exec(compile(text, filename, "exec"), names)
    return names["unpack"]


def _target(results: Registers) -> str:
    inner = ", ".join(r if isinstance(r, str) else _target(r) for r in results)
    return f"({inner},)" if results else "()"


def _names(results: Registers) -> list[str]:
    return [n for r in results for n in ([r] if isinstance(r, str) else _names(r))]
