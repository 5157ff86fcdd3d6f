"""Waiting for the other process's bytes: poll(milliseconds), then read(buffers)."""

import os
import select
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from time import sleep
from typing import Any

Poll = Callable[[float | None], Any]
Read = Callable[[list[Any]], int]

_LOOKS = 50  # some 40 µs: to sleep and be woken on another processor takes as long
_PATIENCE = 10
_BUFFER = 1 << 16


def waiting(file: int) -> tuple[Poll, Read]:
    """Return functions that wait for a pipe with a time limit, and that read from it."""
    return _threaded(file) if sys.platform == "win32" else _watched(file)


def _watched(file: int) -> tuple[Poll, Read]:
    """Look for a moment before sleeping, as long as that mostly pays."""
    poller = select.poll()
    poller.register(file, select.POLLIN)
    look, looks = poller.poll, range(_LOOKS)
    give_way = getattr(os, "sched_yield", partial(sleep, 0.0))
    misses = skipped = 0

    def poll(milliseconds: float | None) -> Any:
        nonlocal misses, skipped
        if skipped:
            skipped -= 1
        else:
            for _ in looks:
                if look(0):
                    misses = 0
                    return True
                give_way()
            misses = min(misses + 1, _PATIENCE)
            skipped = (1 << misses) - 1
        return look(milliseconds)

    return poll, partial(os.readv, file)


def _threaded(file: int) -> tuple[Poll, Read]:
    """Where the system cannot poll a pipe, a thread reads it.

    It reads from a duplicate of its own: the number of a file that others close may soon be that
    of another pipe.
    """
    own = os.dup(file)
    chunks: SimpleQueue[bytes] = SimpleQueue()
    held: list[bytes] = []

    def listen() -> None:
        data = b"begin"
        while data:
            try:
                data = os.read(own, _BUFFER)
            except OSError:
                data = b""
            chunks.put(data)
        os.close(own)

    def poll(milliseconds: float | None) -> bool:
        if not held:
            with suppress(Empty):
                timeout = None if milliseconds is None else 1e-3 * milliseconds
                held.append(chunks.get(timeout=timeout))
        return bool(held)

    def read(buffers: list[Any]) -> int:
        (buffer,), data = buffers, held.pop()
        size = min(len(buffer), len(data))
        buffer[:size] = data[:size]
        if data[size:]:
            held.append(data[size:])
        return size

    Thread(target=listen, daemon=True, name="railcosim-fmu").start()
    return poll, read
