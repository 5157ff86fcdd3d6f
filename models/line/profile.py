"""What holds along a line in steps: (position where it begins, value) pairs, rising positions."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

Steps = tuple[tuple[float, float], ...]
"""A stepwise profile: each value holds from its position (m) to the next one."""


class Misfit(ValueError):  # noqa: N818, it becomes an error with the name of what was read
    """Data that cannot be: what is wrong, and at which index path, as (3, 0) for `[3][0]`."""

    def __init__(self, path: tuple[int | str, ...], text: str):
        super().__init__(text)
        self.path = path

    def __str__(self) -> str:
        return f"{place(*self.path)}: {self.args[0]}" if self.path else self.args[0]


def place(*path: int | str) -> str:
    """Return a path as people write it: `gradients.values[3][1]`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".")


def check_steps(
    steps: Sequence[tuple[float, float]],
    *,
    end: float,
    lowest: float,
    highest: float,
    unit: str,
    scale: float = 1.0,
) -> None:
    """Raise Misfit unless the steps begin at 0 m and rise strictly to below `end` (m).

    The values must be finite and lie within `lowest` and `highest`. The message shows a value times
    `scale` with `unit`.
    """
    if not steps:
        raise Misfit((), "no [position, value] pair; at least one, at position 0, is needed")
    if steps[0][0] != 0.0:
        raise Misfit((0, 0), f"the first position must be 0, not {steps[0][0]:g} m")
    check_rising([position for position, _ in steps], paired=True)
    for index, (position, value) in enumerate(steps):
        if position >= end:
            raise Misfit((index, 0), f"{position:g} m is not before the end at {end:g} m")
        if not lowest <= value <= highest:
            raise Misfit(
                (index, 1),
                f"{scale * value:g} {unit} is not within {scale * lowest:g} to {scale * highest:g}",
            )


def check_rising(positions: Sequence[float], *, paired: bool = False) -> None:
    """Raise Misfit unless the positions (m) are finite and rise strictly.

    `paired`: each is the first item of a pair, and its path ends in [0].
    """
    tail = (0,) if paired else ()
    for index, position in enumerate(positions):
        if not math.isfinite(position):
            raise Misfit((index, *tail), f"position {position} is not finite")
        if index > 0 and position <= positions[index - 1]:
            raise Misfit(
                (index, *tail),
                f"{position:g} m does not lie after the {positions[index - 1]:g} m before it",
            )


def value_at(steps: Steps, position: float) -> float:
    """Return the value that holds at a position (m); where it changes, the one that begins.

    Before the first position the first value holds, beyond the end the last.
    """
    return steps[max(bisect_right(steps, position, key=lambda step: step[0]) - 1, 0)][1]


def integral(steps: Steps, position: float) -> float:
    """Return the integral of the profile from 0 to a position (m)."""
    if position <= 0.0:
        return steps[0][1] * position
    total = 0.0
    for (begin, value), (end, _) in pairwise((*steps, (math.inf, 0.0))):
        if begin >= position:
            break
        total += value * (min(end, position) - begin)
    return total


def merged(steps: Sequence[tuple[float, float]]) -> Steps:
    """Return the steps without those at which nothing changes.

    Of steps at one position, as rounding may leave them, the last one counts.
    """
    kept: list[tuple[float, float]] = []
    for position, value in steps:
        if kept and position <= kept[-1][0]:
            kept.pop()
        if not kept or kept[-1][1] != value:
            kept.append((position, value))
    return tuple(kept)


def cut(steps: Steps, begin: float, end: float) -> Steps:
    """Return the profile between two positions (m), with `begin` as the new 0."""
    shifted = [(position - begin, value) for position, value in steps]
    inside = [(position, value) for position, value in shifted if 0.0 < position < end - begin]
    return merged([(0.0, value_at(steps, begin)), *inside])


def mirrored(steps: Steps, length: float, *, sign: float = 1.0) -> Steps:
    """Return the profile as met from the other end, its values times `sign`."""
    ends = [position for position, _ in steps[1:]] + [length]
    turned = zip(reversed(ends), reversed(steps), strict=True)
    return merged([(length - end, sign * value + 0.0) for end, (_, value) in turned])


def lowest_over(steps: Steps, span: float) -> Steps:
    """Return the lowest value within the last `span` metres, as a profile of the span's front.

    Before position 0 the first value holds.
    """
    begins = {position for position, _ in steps}
    breaks = sorted(begins | {position + span for position in begins if position > 0.0})
    return merged([(front, _lowest(steps, front - span, front)) for front in breaks])


def _lowest(steps: Steps, rear: float, front: float) -> float:
    inside = [value for position, value in steps if rear < position <= front]
    return min([value_at(steps, rear), *inside])
