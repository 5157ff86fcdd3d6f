"""One process at a time in a campaign's folder."""

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from .errors import CampaignError
from .files import guarded

NAME = ".lock"

# A POSIX lock is the process's: it does not keep a second thread of the same process out.
_held: set[Path] = set()
_guard = threading.Lock()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; raise CampaignError if another holds it.

    The lock is the operating system's, which frees it when its holder ends, however that comes:
    the file that stays behind says nothing.
    """
    path = (folder / NAME).resolve()
    with _guard:
        if path in _held:
            raise CampaignError(f"{folder} is in use by another campaign of this process")
        _held.add(path)
    try:
        with guarded(path), path.open("a+b") as stream:
            if not _take(stream):
                raise CampaignError(
                    f"{folder} is in use by {_holder(stream)}; wait for it, or take another folder"
                )
            stream.truncate(0)
            stream.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
            stream.flush()
            yield
    finally:
        with _guard:
            _held.discard(path)


def _take(stream: IO[bytes]) -> bool:
    try:
        if os.name == "nt":
            import msvcrt

            stream.seek(_BYTE)
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)  # pyright: ignore
        else:
            import fcntl

            # Not flock: that one is inherited, and a forked worker may outlive its master.
            fcntl.lockf(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


_BYTE = 1 << 20  # beyond the text: on Windows nobody else can read what is locked


def _holder(stream: IO[bytes]) -> str:
    with suppress(OSError, UnicodeDecodeError):
        stream.seek(0)
        return stream.read(200).decode() or "another process"
    return "another process"
