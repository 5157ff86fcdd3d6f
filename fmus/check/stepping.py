"""Runs by co-simulation: one communication point after another."""

import numpy as np

from .excitation import Excitation
from .instance import CO_SIMULATION
from .subject import Subject


class Stepper:
    """An instance driven by an excitation; a row holds everything watched at one point."""

    def __init__(
        self, subject: Subject, excitation: Excitation, name: str = "check", every: int = 1
    ) -> None:
        self.excitation, self.every = excitation, every
        self.instance = subject.instance(CO_SIMULATION, name)
        self.names = list(subject.inputs)
        self.rows: list[tuple[float, ...]] = []
        self.place = 0

    def begin(self) -> None:
        """Initialize; the first row is what stands at the first point."""
        instance, times = self.instance, self.excitation.times
        self.place = 0
        instance.enter_initialization(float(times[0]), float(times[-1]))
        self.put()
        instance.exit_initialization()
        instance.fetch()
        self.rows = [instance.outputs()]

    def put(self) -> None:
        """Set the inputs of the present point."""
        self.instance.inputs(self.excitation.row(self.place, self.names))
        self.instance.put()

    def step(self) -> bool:
        """Advance by `every` points; return False at the end."""
        times = self.excitation.times
        if self.place + self.every >= len(times):
            return False
        now, then = float(times[self.place]), float(times[self.place + self.every])
        self.instance.inputs(self.excitation.row(self.place, self.names))
        self.instance.advance(now, then - now)
        self.place += self.every
        self.rows.append(self.instance.outputs())
        return True

    def finish(self) -> np.ndarray:
        """Run to the end and return all rows."""
        while self.step():
            pass
        return np.array(self.rows)

    def close(self) -> None:
        """Free the instance."""
        self.instance.close()


def trajectory(subject: Subject, excitation: Excitation, every: int = 1) -> np.ndarray:
    """Return what is watched at the excitation's points (at every `every`-th), afresh."""
    stepper = Stepper(subject, excitation, "check", every)
    try:
        stepper.begin()
        return stepper.finish()
    finally:
        stepper.close()


def signal_size(values: np.ndarray) -> float:
    """Return the largest magnitude, at least 1e-6: a signal at rest may stir by rounding."""
    return max(float(np.max(np.abs(values), initial=0.0)), 1e-6)


def differing(a: np.ndarray, b: np.ndarray, names: list[str]) -> list[str]:
    """Say which signals of two runs differ in any bit, and by how much."""
    problems = []
    for i, name in enumerate(names):
        if not np.array_equal(a[:, i], b[:, i], equal_nan=True):
            gap = float(np.max(np.abs(a[:, i] - b[:, i])))
            by = f"by up to {gap:.3g}" if np.isfinite(gap) else "in what is no finite number"
            problems.append(f"{name} differs {by}")
    return problems


def changes(rows: np.ndarray, columns: list[int]) -> np.ndarray:
    """Return for each step whether any of the columns changes in it."""
    return (np.diff(rows[:, columns], axis=0) != 0).any(axis=1)


def together(a: np.ndarray, b: np.ndarray, markers: list[int]) -> np.ndarray:
    """Return where two runs stand on the same side of every event, by the marking columns."""
    return (a[:, markers] == b[:, markers]).all(axis=1)


def longest_apart(same: np.ndarray) -> int:
    """Return how many points in a row are not the same, at most."""
    longest = count = 0
    for one in same.tolist():
        count = 0 if one else count + 1
        longest = max(longest, count)
    return longest
