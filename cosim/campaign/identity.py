"""What a campaign is: hashes of its parts, by which a folder tells whether it goes on with it."""

import hashlib
import json
import struct
import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from .parcel import digest_of, is_fmu

PACKAGES = ("railcosim", "casadi", "numpy", "scipy", "pyarrow")


def versions() -> dict[str, str]:
    """Return the versions that a table's bytes may depend on."""
    return {"python": sys.version.split()[0], **{name: version(name) for name in PACKAGES}}


def fingerprint(value: Any) -> str:
    """Return a hash of a value's content, the same in every process.

    Blocks, diagrams and other objects count by their fields, FMUs by the file's content, functions
    by their code, what they close over, and the functions and plain values of their own module
    that they name. (A pickle will not do: its bytes differ from process to process.)
    """
    walk = _Walk()
    walk.feed(value)
    return walk.hash.hexdigest()


class _Walk:
    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self.seen: dict[int, tuple[int, Any]] = {}  # kept, so that no id is used twice

    def feed(self, value: Any) -> None:
        if self._plain(value):
            return
        if id(value) in self.seen:
            self._tag("again", str(self.seen[id(value)][0]))
            return
        self.seen[id(value)] = (len(self.seen), value)
        if isinstance(value, tuple | list):
            self._tag("list", str(len(value)))
            for item in value:
                self.feed(item)
        elif isinstance(value, set | frozenset):
            self._tag("set", *sorted(fingerprint(item) for item in value))
        elif isinstance(value, Mapping):
            self._tag("mapping", str(len(value)))
            for key, item in value.items():
                self.feed(key)
                self.feed(item)
        elif isinstance(value, np.ndarray) and value.dtype != object:
            self._tag("array", str(value.dtype), str(value.shape))
            self.hash.update(np.ascontiguousarray(value).tobytes())
        else:
            self._object(value)

    def _plain(self, value: Any) -> bool:
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, float):
            self._tag("float")
            self.hash.update(struct.pack("<d", value))
        elif value is None or isinstance(value, bool | int | str | complex):
            self._tag(type(value).__name__, str(value))
        elif isinstance(value, bytes | bytearray):
            self._tag("bytes", str(len(value)))
            self.hash.update(value)
        elif is_fmu(value):
            self._tag("fmu", digest_of(value))
        elif isinstance(value, Path):
            self._tag("path", str(value))
        else:
            return False
        return True

    def _object(self, value: Any) -> None:
        if isinstance(value, FunctionType):
            self._function(value)
        elif isinstance(value, type | BuiltinFunctionType | ModuleType):
            self._tag("named", getattr(value, "__module__", None) or "", value.__name__)
        elif isinstance(value, CodeType):
            self._code(value)
        elif all(hasattr(value, name) for name in ("dist", "args", "kwds")):
            # scipy's frozen distributions also hold a global generator, whose state changes.
            self._tag("distribution", type(value.dist).__qualname__, str(value.dist.name))
            self.feed([value.args, value.kwds])
        elif is_dataclass(value):
            self._tag("dataclass", type(value).__module__, type(value).__qualname__)
            for f in fields(value):
                self.feed([f.name, getattr(value, f.name)])
        else:
            self._reduced(value)

    def _function(self, function: FunctionType) -> None:
        self._tag("function", function.__module__ or "", function.__qualname__)
        self._code(function.__code__)
        self.feed([function.__defaults__, function.__kwdefaults__])
        for cell in function.__closure__ or ():
            self.feed(cell.cell_contents)
        for name in sorted(_names(function.__code__)):
            found = function.__globals__.get(name)
            local = isinstance(found, FunctionType) and found.__module__ == function.__module__
            if local or isinstance(found, str | int | float | tuple | Path | np.ndarray):
                self.feed([name, found])

    def _code(self, code: CodeType) -> None:
        self._tag("code", code.co_name, *code.co_names, *code.co_varnames)
        self.feed(code.co_code)
        self.feed(code.co_consts)

    def _reduced(self, value: Any) -> None:
        """An object by what pickle would make it again from."""
        self._tag("object", type(value).__module__, type(value).__qualname__)
        try:
            parts = value.__reduce_ex__(4)
        except Exception:  # a lock, a handle of the system: known by its class
            return
        if isinstance(parts, str):
            self._tag("global", parts)
            return
        for part in parts[:3]:
            self.feed(_without_caches(value, part))
        for iterator in parts[3:5]:
            self.feed(None if iterator is None else list(iterator))

    def _tag(self, *words: str) -> None:
        for word in words:
            data = word.encode("utf-8", "surrogatepass")
            self.hash.update(b"%d:" % len(data))
            self.hash.update(data)


def _names(code: CodeType) -> set[str]:
    """Return the names that a function uses, its inner functions included."""
    inner = (_names(c) for c in code.co_consts if isinstance(c, CodeType))
    return set(code.co_names).union(*inner)


def _without_caches(value: Any, state: Any) -> Any:
    """Return an object's state less its cached properties, which may have been asked for or not."""
    if not isinstance(state, dict):
        return state
    kind = type(value)
    cached = {k for k in state if isinstance(getattr(kind, str(k), None), cached_property)}
    return {k: v for k, v in state.items() if k not in cached}


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return in words what differs between two campaigns' descriptions."""
    found = []
    for key in dict.fromkeys([*before, *now]):
        a, b = before.get(key), now.get(key)
        if a == b:
            continue
        if isinstance(a, dict) and isinstance(b, dict):
            found += differences(a, b)
        elif any(isinstance(v, str) and len(v) == 64 for v in (a, b)):
            found.append(f"its {key}")
        else:
            found.append(f"its {key} (there {json.dumps(a)}, here {json.dumps(b)})")
    return found
