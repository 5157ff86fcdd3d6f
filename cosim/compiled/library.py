"""The compiled stepper's library: built once on a machine, kept in the user's cache, loaded."""

import ctypes
import hashlib
import importlib.util
import os
import shlex
import shutil
import sys
import sysconfig
import tempfile
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from ...base.cache import cache_folder, write_atomically
from ...base.compilers import (
    FLAGS,
    KIND_FLAGS,
    SUFFIXES,
    Compiler,
    host_platform,
    machine,
    native_compiler,
)
from ...base.errors import RailcosimError
from . import structures as s

_SOURCE = "stepper.c"


class EngineError(RailcosimError):
    """A run wants the compiled engine, and it cannot be had."""


class Library:
    """The functions of a stepper that is loaded into this process.

    `run` returns the values of the registers that live, `values` those of a state after a failure,
    and `release` lets go of what a state holds.
    """

    def __init__(self, path: Path) -> None:
        library = ctypes.PyDLL(str(path))
        size = library.stepper_size
        size.restype, size.argtypes = ctypes.c_size_t, (ctypes.c_int,)
        found = [size(i) for i in range(len(s.ALL) + 1)]
        if found != [*(ctypes.sizeof(one) for one in s.ALL), 0]:
            raise EngineError(f"{path} has structures of other sizes: {found}")
        library.stepper_open(ctypes.byref(_python()))
        self.run = library.stepper_run
        self.run.restype = ctypes.py_object
        self.run.argtypes = (ctypes.c_void_p, ctypes.py_object)
        self.values = library.stepper_values
        self.values.restype, self.values.argtypes = ctypes.py_object, (ctypes.c_void_p,)
        self.release = library.stepper_release
        self.release.restype, self.release.argtypes = None, (ctypes.c_void_p,)


def load_library(*, again: bool = False) -> Library:
    """Return the library, built if it is not in the cache; raise EngineError if it cannot be had.

    What went wrong once is remembered, as building takes its time; `again` tries it nevertheless.
    """
    found = _loaded()
    if again and isinstance(found, str):
        _loaded.cache_clear()
        found = _loaded()
    if isinstance(found, str):
        raise EngineError(found)
    return found


@lru_cache(maxsize=1)
def _loaded() -> Library | str:
    try:
        _require_python()
        path = cache_folder("stepper") / f"stepper-{_key()}{SUFFIXES[host_platform()]}"
        if path.exists():
            try:
                return Library(path)
            except (OSError, AttributeError, EngineError):  # damaged: build it anew
                path.unlink()
        write_atomically(path, _built(path.name), content_named=True)
        return Library(path)
    except Exception as error:
        # Whatever a compiler, a cache or a loader may come up with: a run goes on without.
        return f"the compiled stepper cannot be had: {error or type(error).__name__}"


def _require_python() -> None:
    """Raise EngineError for a Python other than those whose C API is as stepper.c has it."""
    if sys.implementation.name != "cpython":
        raise EngineError(f"it is for CPython, not for {sys.implementation.name}")
    if sysconfig.get_config_var("Py_GIL_DISABLED"):
        raise EngineError("it is for CPython with a global interpreter lock")


def _key() -> str:
    """Return what tells one library from another: source, flags, machine and compilers."""
    key = hashlib.sha256(_source())
    key.update(repr((FLAGS, KIND_FLAGS, machine(), _compilers())).encode())
    return key.hexdigest()[:32]


def _source() -> bytes:
    return resources.files(__package__ or "").joinpath(_SOURCE).read_bytes()


def _compilers() -> list[Any]:
    """Return what there is to build with, by files: to ask each its version takes too long."""
    named = os.environ.get("CC")
    names = [named] if named else ["cc", "gcc", "clang"]
    found: list[Any] = []
    for name in names:
        command = shlex.split(name, posix=os.name != "nt")
        path = shutil.which(command[0]) if command else None
        found.append((command, _identity(path)))
    zig = importlib.util.find_spec("ziglang")
    return [*found, _identity(None if zig is None else zig.origin)]


def _identity(path: str | None) -> Any:
    if path is None:
        return None
    status = Path(path).stat()
    return path, status.st_size, status.st_mtime_ns


def _built(name: str) -> bytes:
    with tempfile.TemporaryDirectory(prefix="railcosim-") as folder:
        source, library = Path(folder, _SOURCE), Path(folder, name)
        source.write_bytes(_source())
        _compiler().shared_library(source, library)
        return library.read_bytes()


def _compiler() -> Compiler:
    """Return a compiler; zig without its runtime, which takes long to build and is not needed."""
    compiler = native_compiler()
    if compiler.runtime is None or host_platform() != "linux64":
        return compiler
    return replace(compiler, runtime=None, library_flags=(*compiler.library_flags, "-nostdlib"))


@lru_cache(maxsize=1)
def _python() -> Any:
    """Return Python's C API as stepper.c calls it."""
    functions = [ctypes.cast(getattr(ctypes.pythonapi, f), ctypes.c_void_p) for f in s.FUNCTIONS]
    # An object begins with its reference count and ends, if it has nothing more, with its type.
    offset = object.__basicsize__ - ctypes.sizeof(ctypes.c_void_p)
    for one in (1.5, 10**9, (), [], object(), float):
        if ctypes.c_void_p.from_address(id(one) + offset).value != id(type(one)):
            raise EngineError("objects of this Python are not laid out as it knows them")
    return s.Python(*functions, *(id(one) for one in s.TYPES), offset)
