"""Coupler-force control of a 10,000 t train by fuzzy adaptive PID.

The study of "Study on Control Optimization for Heavy Haul Train Based on Fuzzy Adaptive PID
Control" (in Chinese). Its figures 3 to 5, 7 and 8; and ours: convergence, damping, the brake wave,
and an optimal handling on a rolling line.
"""

from ..registry import Study
from .claims import judge
from .experiments import cases
from .figures import figures

STUDY = Study(
    name="heavy-haul",
    title="Coupler-force control of a 10,000 t train by fuzzy adaptive PID",
    source="Study on Control Optimization for Heavy Haul Train Based on Fuzzy Adaptive PID Control",
    cases=cases,
    judge=judge,
    figures=figures,
)
