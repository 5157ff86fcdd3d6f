"""Tell the person who waits, on standard error, what is going on and for how long."""

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import TextIO


@contextmanager
def announced(doing: str, done: str) -> Iterator[None]:
    """Say that something slow is `doing` while the body runs, and `done` with its seconds after.

    On a terminal the first is a live line with the time that has passed, else one plain line.
    A body that raises is not called done. Several threads may have something announced at once.
    """
    stream = sys.stderr
    if stream is None:  # a Windows program without a console has none
        yield
        return
    start = time.monotonic()
    if stream.isatty():
        with _ticking(doing, stream):
            yield
    else:
        _say(f"{doing} ...", stream)
        yield
    _say(f"{done} in {time.monotonic() - start:.0f} s", stream)


def _say(text: str, stream: TextIO) -> None:
    """Write one whole line, above the live lines that other threads may have."""
    from tqdm import tqdm

    tqdm.write(text, file=stream)
    stream.flush()


@contextmanager
def _ticking(doing: str, stream: TextIO) -> Iterator[None]:
    from tqdm import tqdm

    ended = Event()
    form = "{elapsed} {desc}"  # the time first: a narrow terminal cuts the rest
    size = shutil.get_terminal_size()  # 80 by 24 where a terminal says 0 by 0
    with tqdm(
        desc=doing, bar_format=form, file=stream, leave=False,
        ncols=size.columns - 1, nrows=size.lines,
    ) as line:  # fmt: skip

        def tick() -> None:
            while not ended.wait(0.5):
                line.refresh()

        ticker = Thread(target=tick, daemon=True)
        ticker.start()
        try:
            yield
        finally:
            ended.set()
            ticker.join()
