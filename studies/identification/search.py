"""What a search without derivatives finds."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Found:
    """The best point and its value, and (evaluations so far, best value) on the way."""

    point: np.ndarray
    value: float
    evaluations: int
    history: tuple[tuple[int, float], ...] = ()
