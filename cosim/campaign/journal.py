"""The journal: one line for each run that is done, appended and on the disk before it counts.

A line is the CRC-32 of its text, in hexadecimal, and the text, a JSON object. A line that was cut
off by a kill is recognised by that, and taken off. JSON gives a float back to the same bits.
"""

import json
import os
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from .files import guarded

Record = dict[str, Any]  # run, drawn, rows, error; seconds, worker, traceback

NAME = "journal.jsonl"


class Journal:
    """The runs done so far, in the order in which they ended."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / NAME
        self.done: set[int] = set()
        self.failed = 0
        length = 0
        for record, end in _lines(self.path):
            self.done.add(record["run"])
            self.failed += record["error"] is not None
            length = end
        with guarded(self.path):
            self._stream = self.path.open("ab")
            if self.path.stat().st_size > length:
                self._stream.truncate(length)

    def append(self, records: Iterable[Record]) -> int:
        """Add runs that are not there yet and return how many; they last when this returns."""
        lines = []
        for record in records:
            if record["run"] not in self.done:
                self.done.add(record["run"])
                self.failed += record["error"] is not None
                lines.append(_line(record))
        with guarded(self.path):
            self._stream.write(b"".join(lines))
            self._stream.flush()
            os.fsync(self._stream.fileno())
        return len(lines)

    def records(self) -> dict[int, Record]:
        """Return all runs done, in their order."""
        found = {record["run"]: record for record, _ in _lines(self.path)}
        return {number: found[number] for number in sorted(found)}

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _line(record: Record) -> bytes:
    text = json.dumps(record, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _lines(path: Path) -> Iterator[tuple[Record, int]]:
    """Return the lines, each with where it ends, up to the first that is not whole."""
    if not path.exists():
        return
    end = 0
    with guarded(path), path.open("rb") as stream:
        for line in stream:
            check, _, text = line.partition(b" ")
            if not line.endswith(b"\n") or check != b"%08x" % zlib.crc32(text[:-1]):
                return
            end += len(line)
            yield json.loads(text), end
