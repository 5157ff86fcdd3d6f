"""How far two solutions of one problem lie apart, and what that says."""

from dataclasses import dataclass

import numpy as np

from .report import Result, Unchecked
from .stepping import longest_apart, signal_size, together
from .subject import Subject

SMOOTH, HYBRID = 1e-6, 1e-4  # of the signal's size, without and with events
SMALL = 0.01  # of the nominal value: a signal's least size, as a solver's tolerance knows it
BEYOND = 0.1  # of the signal's size: more than a coarse solver explains


@dataclass
class Gap:
    """The largest difference of outputs so far, in parts of the signal's size, and where it is.

    Points at which the runs stand on either side of an event do not count, if only one at a time:
    an event that falls on a communication point may come just before or just after it.
    """

    worst: float = 0.0
    where: str = ""
    apart: int = 0

    def add(
        self,
        subject: Subject,
        expected: np.ndarray,
        before: np.ndarray,
        after: np.ndarray,
        note: str = "",
        *,
        only_real: bool = False,
    ) -> None:
        """Add a run: what it shows before or after an instant's events counts, the nearer one.

        With `only_real`, whole numbers and truth values do not count.
        """
        markers = [] if only_real else subject.columns(subject.markers)
        same = together(expected, before, markers) | together(expected, after, markers)
        self.apart += int((~same).sum())
        if longest_apart(same) > 1:
            share = float((~same).mean())
            self._note(share, f"discrete variables differ at {share:.2g} of the points{note}")
        for i, name in enumerate(subject.outputs):
            if only_real and subject.variables[name].type != "Real":
                continue
            gap = np.fmin(*(np.abs(rows[:, i] - expected[:, i]) for rows in (before, after)))
            gap = np.nan_to_num(gap, nan=np.inf)[same]
            size = max(signal_size(expected[:, i]), SMALL * subject.size(name))
            error = float(np.max(gap, initial=0.0)) / size
            self._note(error, f"{name} differs by {error:.2g} of its size{note}")

    def _note(self, size: float, where: str) -> None:
        if size > self.worst:
            self.worst, self.where = size, where

    @staticmethod
    def allowed(subject: Subject, tolerance: float | None) -> float:
        """Return the tolerance: by whether events are about, or the user's if that is wider."""
        return max(tolerance or 0.0, HYBRID if subject.is_hybrid else SMOOTH)

    def judge(self, good: str, subject: Subject, tolerance: float | None) -> Result:
        """Up to a tolerance the solutions agree.

        Beyond it a coarse solver may be why, which is no error and no proof either (then
        Unchecked is raised); far beyond it is one. A tolerance given by the user decides alone.
        """
        allowed = self.allowed(subject, tolerance)
        text = f"{good} to {self.worst:.1g} of the signal's size (allowed {allowed:g})"
        if self.apart:
            text += f", but for {self.apart} points on an event"
        if self.worst <= allowed:
            return [], text
        if tolerance is None and self.worst <= BEYOND:
            raise Unchecked(
                f"{self.where}, more than {allowed:g}; a coarse solver in the FMU would explain it "
                "(--tolerance decides)"
            )
        return [f"{self.where}; allowed is {allowed:g}"], text
