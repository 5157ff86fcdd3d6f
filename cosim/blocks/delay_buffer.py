"""Samples in order, as a value: appending gives a new buffer and leaves the old one as it was.

A buffer is a pair (chunks, tail): full chunks of CHUNK samples, the oldest first, and the latest
samples. Old and new share their chunks. So a step copies a tail and not all samples, and keeping
an old state for a rollback or a checkpoint costs a reference. A sample is a tuple whose first
numbers give its place in the order and whose last two are its time (s) and its value.
"""

from bisect import bisect_right
from typing import Any

CHUNK = 64

Sample = tuple[Any, ...]
Buffer = tuple[tuple[tuple[Sample, ...], ...], tuple[Sample, ...]]


def append(buffer: Buffer, sample: Sample, oldest: float) -> Buffer:
    """Return the buffer with one sample more, without what is not needed from time `oldest` (s) on.

    The last sample not after `oldest` stays, and before that no more than 2 · CHUNK.
    """
    chunks, tail = buffer
    if len(tail) < CHUNK:
        return chunks, (*tail, sample)
    chunks, first = (*chunks, tail), 0
    while first + 1 < len(chunks) and chunks[first + 1][0][-2] <= oldest:
        first += 1
    return chunks[first:], (sample,)


def around(buffer: Buffer, probe: Sample) -> tuple[Sample | None, Sample | None]:
    """Return the last sample not after `probe` and the one that follows; None for one missing."""
    chunks, tail = buffer
    if not chunks or tail[0] <= probe:
        i = bisect_right(tail, probe)
        return tail[i - 1] if i else None, tail[i] if i < len(tail) else None
    c = bisect_right(chunks, (probe,))  # tuples compare by their first sample
    if not c:
        return None, chunks[0][0]
    chunk = chunks[c - 1]
    i = bisect_right(chunk, probe)
    if i < CHUNK:
        return chunk[i - 1], chunk[i]
    return chunk[-1], chunks[c][0] if c < len(chunks) else tail[0]
