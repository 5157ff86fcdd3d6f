"""The FMI calls that are running, in a file that the FMU's process shares with the one watching it.

Each instance has a place there, for instances run in threads. While a call runs, its place holds a
number that no other call has: so one that hangs is told from one after another, whether or not it
keeps the interpreter's lock. That costs a call some 0.1 µs.
"""

import mmap
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

PLACES = 64  # more instances than that share places, which matters only if these run at once
_FUNCTIONS = 128  # the number of a call, modulo this, tells its function
_NAME, _PART, _LINE = 48, 16, 4000  # bytes
_SIZE = struct.Struct("=I")
_NAMES = 8 * PLACES  # one number for each place stands before
_LOGS = _NAMES + _FUNCTIONS * _NAME
_LOG = _PART + _SIZE.size + _LINE
_WHOLE = _LOGS + PLACES * _LOG


@dataclass(frozen=True)
class Running:
    """A call that has not returned; the line is what its instance logged last, "" if nothing."""

    place: int
    number: int
    function: str
    part: str
    line: str


class Heartbeat:
    """All places: one process writes, another reads."""

    def __init__(self, path: Path) -> None:
        """Open the file; raise OSError if there is none."""
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _WHOLE)
        self._numbers = memoryview(self._memory)[:_NAMES].cast("Q")
        self._places = count()
        self._codes = iter(range(_FUNCTIONS))
        self._calls: dict[str, Iterator[int]] = {}

    @classmethod
    def create(cls, path: Path) -> "Heartbeat":
        """Write a file in which nothing runs, and open it."""
        path.write_bytes(bytes(_WHOLE))
        return cls(path)

    def close(self) -> None:
        """Let go of the file."""
        self._numbers.release()
        self._memory.close()

    # The process that reads

    def numbers(self) -> list[tuple[int, int]]:
        """Return the place and the number of each call that is running."""
        return [(place, number) for place, number in enumerate(self._numbers) if number]

    def running(self, place: int, number: int) -> Running:
        """Return what is known of a call."""
        name = self._text(_NAMES + number % _FUNCTIONS * _NAME, _NAME)
        log = _LOGS + place * _LOG
        (size,) = _SIZE.unpack_from(self._memory, log + _PART)
        line = self._text(log + _PART + _SIZE.size, min(size, _LINE))
        return Running(place, number, name, self._text(log, _PART), line)

    def _text(self, start: int, size: int) -> str:
        return self._memory[start : start + size].rstrip(b"\0").decode(errors="replace")

    # The process that writes

    def place(self, part: str) -> "Place":
        """Return the next place, for calls that belong to a part of the report."""
        place = next(self._places) % PLACES
        log = _LOGS + place * _LOG
        self._write(log, part, _PART)
        _SIZE.pack_into(self._memory, log + _PART, 0)
        self._numbers[place] = 0
        return Place(self, self._numbers, place)

    def calls(self, function: str) -> Iterator[int]:
        """Return the numbers for the calls of a function, by whichever instance."""
        if function not in self._calls:
            code = next(self._codes)
            self._write(_NAMES + code * _NAME, function, _NAME)
            self._calls.setdefault(function, count(_FUNCTIONS + code, _FUNCTIONS))
        return self._calls[function]

    def log(self, place: int, line: str) -> None:
        """Keep the line that was logged last."""
        start = _LOGS + place * _LOG + _PART
        size = self._write(start + _SIZE.size, line, _LINE)
        _SIZE.pack_into(self._memory, start, size)

    def _write(self, start: int, text: str, size: int) -> int:
        data = text.encode(errors="replace")[:size]
        self._memory[start : start + size] = data.ljust(size, b"\0")
        return len(data)


class Place:
    """Where one instance says which call is running, and what it logged last."""

    def __init__(self, heartbeat: Heartbeat, numbers: "memoryview[int]", place: int) -> None:
        self.numbers, self.place = numbers, place  # where the number of a running call is written
        self._heartbeat = heartbeat

    def calls(self, function: str) -> Iterator[int]:
        """Return the numbers for the calls of a function."""
        return self._heartbeat.calls(function)

    def enter(self, function: str) -> None:
        """Say that a call is running from now on."""
        self.numbers[self.place] = next(self.calls(function))

    def marked(
        self, name: str, function: Callable[..., Any], *arguments: Any
    ) -> Callable[..., Any]:
        """Return a call with these arguments, prepared, that says of itself when it runs."""
        numbers, place, calls = self.numbers, self.place, self.calls(name)

        def call() -> Any:
            numbers[place] = next(calls)
            try:
                return function(*arguments)
            finally:
                numbers[place] = 0

        return call

    def log(self, line: str) -> None:
        """Keep the line that was logged last."""
        self._heartbeat.log(self.place, line)
