"""Memory shared by both processes: what must be known of an FMU even after it crashed.

It holds the FMI function that is running and the last lines that the FMU logged, in a ring: however
much an FMU logs, it takes no more memory, no disk and no reader.
"""

import mmap
import os
import secrets
import struct
import tempfile
from contextlib import suppress

LINES, LENGTH = 20, 4096  # bytes: a line of 1000 characters, four bytes each, and its status
_MARK = 64
_COUNT = struct.Struct("=Q")
_SIZE = struct.Struct("=I")
_LINE = _SIZE.size + LENGTH
_FIRST = _MARK + _COUNT.size
_WHOLE = _FIRST + LINES * _LINE
NOTHING = bytes(_MARK)


class Page:
    """One page: its process writes, the other reads."""

    def __init__(self, memory: mmap.mmap) -> None:
        self.memory = memory

    @classmethod
    def create(cls) -> "tuple[Page, str, tuple[int, ...]]":
        """Return a page, how the other process finds it, and file descriptors it inherits for it.

        The caller closes these descriptors.
        """
        if os.name == "nt":
            name = f"railcosim-{os.getpid()}-{secrets.token_hex(8)}"
            return cls(_named(name)), name, ()
        memory = getattr(os, "memfd_create", None)
        if memory is not None:
            file = memory("railcosim")
        else:
            with tempfile.TemporaryFile() as nameless:
                file = os.dup(nameless.fileno())
        os.ftruncate(file, _WHOLE)
        return cls(mmap.mmap(file, _WHOLE)), str(file), (file,)

    @classmethod
    def attach(cls, where: str) -> "Page":
        """Return the page that the other process created."""
        if os.name == "nt":
            return cls(_named(where))
        page = cls(mmap.mmap(int(where), _WHOLE))
        os.close(int(where))
        return page

    def close(self) -> None:
        """Let go of the memory; it is gone when both have."""
        with suppress(BufferError):
            self.memory.close()

    # What runs

    def mark(self, what: str) -> None:
        """Say what runs from now on; "" is nothing."""
        self.memory[:_MARK] = marking(what)

    def running(self) -> str:
        """Return what runs."""
        return self.memory[:_MARK].rstrip(b"\0").decode(errors="replace")

    # What was logged

    def log(self, line: str) -> None:
        """Append a line, in place of the oldest one."""
        data = line.encode(errors="replace")[:LENGTH]
        (count,) = _COUNT.unpack_from(self.memory, _MARK)
        place = _FIRST + count % LINES * _LINE
        _SIZE.pack_into(self.memory, place, len(data))
        place += _SIZE.size
        self.memory[place : place + len(data)] = data
        _COUNT.pack_into(self.memory, _MARK, count + 1)

    def lines(self) -> list[str]:
        """Return the last lines."""
        (count,) = _COUNT.unpack_from(self.memory, _MARK)
        return [self._line(i) for i in range(max(0, count - LINES), count)]

    def _line(self, number: int) -> str:
        place = _FIRST + number % LINES * _LINE
        (size,) = _SIZE.unpack_from(self.memory, place)
        place += _SIZE.size
        return self.memory[place : place + min(size, LENGTH)].decode(errors="replace")


def marking(what: str) -> bytes:
    """Return a mark as bytes, to be written where it costs the least."""
    return what.encode()[:_MARK].ljust(_MARK, b"\0")


def _named(name: str) -> mmap.mmap:
    return mmap.mmap(-1, _WHOLE, tagname=name)  # pyright: ignore[reportCallIssue]
