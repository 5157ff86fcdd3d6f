"""Files that are there whole or not at all, also after a kill or a power failure."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from .errors import CampaignError


@contextmanager
def whole(path: Path) -> Iterator[IO[bytes]]:
    """Open a file that gets its name when all of it is on the disk."""
    with guarded(path):
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            Path(name).chmod(0o644)
            Path(name).replace(path)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink(missing_ok=True)
            raise
        _sync_folder(path.parent)


def remove_parts(folder: Path) -> None:
    """Remove what processes that were killed left half-written."""
    for pattern in (".*.part", "*.part"):
        for path in folder.glob(pattern):
            with suppress(OSError):
                path.unlink(missing_ok=True)


@contextmanager
def guarded(path: Path) -> Iterator[None]:
    """Turn errors of the system into CampaignError, which names the file."""
    try:
        yield
    except OSError as error:
        raise CampaignError(f"cannot write {path}: {error.strerror or error}") from error


def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file by a function of the open stream."""
    with whole(path) as stream:
        write(stream)


def _sync_folder(folder: Path) -> None:
    """Make a new name last; Windows does that by itself, and cannot open a folder."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # some network file systems refuse
            os.fsync(handle)
    finally:
        os.close(handle)
