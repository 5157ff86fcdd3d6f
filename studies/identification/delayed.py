"""Held commands after a delay, as means over steps: smooth in the delay."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

APART = 1e4  # s between the logs on the common time axis


class Line(NamedTuple):
    """The straight line with the command's mean and first moment over each step.

    `mean`, and the rise `tilt` from the middle to the end (m/s²), arrays (log, step); and how
    both change with the delay (per s).
    """

    mean: np.ndarray
    tilt: np.ndarray
    mean_change: np.ndarray
    tilt_change: np.ndarray


class HeldCommands:
    """The commands of several logs, each held from sample to sample.

    With U = ∫u and W = ∫U, the mean of u over a step h is ΔU/h and its first moment about the
    middle is h (U₀ + U₁)/2 − ΔW: closed forms for any delay.
    """

    def __init__(self, times: Sequence[np.ndarray], commands: Sequence[np.ndarray]) -> None:
        offsets = APART * np.arange(len(times))
        self._offset = offsets[:, None]
        # Long before its first sample each log had the same command.
        knots = [
            np.concatenate(([-0.25 * APART], t)) + o for t, o in zip(times, offsets, strict=True)
        ]
        held = [np.concatenate((u[:1], u)) for u in commands]
        self._knots, self._held = np.concatenate(knots), np.concatenate(held)
        first, second = [], []
        for t, c in zip(knots, held, strict=True):
            h = np.diff(t)
            area = np.concatenate(([0.0], np.cumsum(c[:-1] * h)))
            # counted from the first sample, for the digits' sake
            area = area - area[1]
            twice = np.cumsum(area[:-1] * h + 0.5 * c[:-1] * h * h)
            first.append(area)
            second.append(np.concatenate(([0.0], twice)) - twice[0])
        self._first, self._second = np.concatenate(first), np.concatenate(second)

    def delayed(self, delay: np.ndarray, start: np.ndarray, width: np.ndarray) -> Line:
        """Return the lines for steps (log, step) that begin at `start` and last `width` s.

        `delay` (s) has one value for each log. Steps of no width have the value at their
        beginning.
        """
        u0, area0, twice0 = self._at(start - delay[:, None])
        u1, area1, twice1 = self._at(start + width - delay[:, None])
        h = np.where(width > 0.0, width, 1.0)
        rise, jump = area1 - area0, u1 - u0
        moment = 0.5 * h * (area0 + area1) - (twice1 - twice0)
        moment_change = -(0.5 * h * (u0 + u1) - rise)
        scale = 6.0 / (h * h)  # the line's slope is 12 moment/h³, its tilt half a step of that
        mean = np.where(width > 0.0, rise / h, u0)
        none = np.zeros_like(mean)
        return Line(
            mean,
            np.where(width > 0.0, scale * moment, none),
            np.where(width > 0.0, -jump / h, none),
            np.where(width > 0.0, scale * moment_change, none),
        )

    def _at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return u, U and W at times (log, any)."""
        moved = time + self._offset
        i = np.searchsorted(self._knots, moved, side="right") - 1
        i = np.maximum(i, 0)
        t, u = moved - self._knots[i], self._held[i]
        return u, self._first[i] + u * t, self._second[i] + t * (self._first[i] + 0.5 * u * t)
