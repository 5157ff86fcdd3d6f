"""FMPy's class for a co-simulation FMU, without what it does anew for each instance."""

from functools import lru_cache
from typing import Any

Signature = tuple[
    str, Any, Any, Any
]  # function, names and types of its arguments, type of its result


@lru_cache(maxsize=1)
def slave_class() -> Any:
    """Return FMPy's FMU2Slave, which works its functions' signatures out once for a process.

    FMPy does so for each instance, with `inspect`: 2 to 3 ms, where loading a library takes 0.1.
    """
    from fmpy.fmi2 import FMU2Slave

    known: list[Signature] = []

    class FMU2Known(FMU2Slave):  # FMPy goes by a class' name: it must begin with FMU2
        def _loadFunctions(self) -> None:  # noqa: N802
            if not known:
                super()._loadFunctions()
                functions: dict[str, Any] = self._functions
                known.extend(
                    (name, f.argnames, f.argtypes, f.restype) for name, f in functions.items()
                )
                return
            for name, names, types, result in known:
                function = getattr(self.dll, name)
                function.argnames, function.argtypes, function.restype = names, types, result
                self._functions[name] = function

    return FMU2Known
