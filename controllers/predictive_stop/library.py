"""The braking model's library: built once on a machine, kept in the user's cache, loaded."""

import ctypes
import hashlib
import os
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
    host_platform,
    machine,
    native_compiler,
)

_SOURCES = ("model.c", "motion.h")  # the first includes the others


@lru_cache(maxsize=1)
def load() -> Any:
    """Return the library of model.c; raise BuildError if there is no compiler that builds it."""
    sources = [resources.files(__package__ or "").joinpath(n).read_bytes() for n in _SOURCES]
    key = hashlib.sha256(b"".join(sources))
    key.update(repr((FLAGS, KIND_FLAGS, machine(), os.environ.get("CC"))).encode())
    name = f"predictive_stop-{key.hexdigest()[:32]}{SUFFIXES[host_platform()]}"
    path = cache_folder("predictive_stop") / name
    if path.exists():
        try:
            return ctypes.CDLL(str(path))
        except OSError:  # damaged: build it anew
            path.unlink()
    write_atomically(path, _built(sources, name), content_named=True)
    return ctypes.CDLL(str(path))


def _built(sources: list[bytes], name: str) -> bytes:
    # With the compiler's runtime, on Windows too: frames of more than a page need it.
    compiler = replace(native_compiler(), library_flags=())
    with tempfile.TemporaryDirectory(prefix="railcosim-") as folder:
        for file, content in zip(_SOURCES, sources, strict=True):
            Path(folder, file).write_bytes(content)
        library = Path(folder, name)
        compiler.shared_library(Path(folder, _SOURCES[0]), library)
        return library.read_bytes()
