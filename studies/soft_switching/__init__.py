"""T-S fuzzy soft switching between fuzzy and single-neuron PID control of train speed.

The study of "Composite control method for train speed based on T-S fuzzy inference soft
switching" (in Chinese). Its figures 4 to 9, and two of ours: the equations as printed, and a
transport delay between controller and train.
"""

from ..registry import Study
from .claims import judge
from .experiments import cases
from .figures import figures

STUDY = Study(
    name="soft-switching",
    title="T-S fuzzy soft switching between fuzzy and single-neuron PID speed control",
    source="Composite control method for train speed based on T-S fuzzy inference soft switching",
    cases=cases,
    judge=judge,
    figures=figures,
)
