"""Adaptive fuzzy control of train speed: variable universe and self-tuned scaling.

The study of "Adaptive fuzzy control for the speed regulation of an automatic train operation
system" (in Chinese). Its figures 1 and 4 to 6, run on the identified plant and on the physical one
that it comes from; ours are the variants of the output, the handle with whole notches, and the
controller that runs away under ATP.
"""

from ..registry import Study
from .claims import judge
from .experiments import cases
from .figures import figures

STUDY = Study(
    name="adaptive-fuzzy",
    title="adaptive fuzzy speed regulation with a variable universe, under ATP",
    source="Adaptive fuzzy control for the speed regulation of an automatic train operation system",
    cases=cases,
    judge=judge,
    figures=figures,
)
