"""Stopping at a platform mark by a fuzzy query table computed off line.

The study of "Fuzzy control in the braking of trains that call at a station" (in Chinese). The
paper's memberships, rules, table and results are lost: the table, the trains and the experiments
are reconstructions of ours, labelled so. A quieter variant of ours stands beside them.
"""

from ..registry import Study
from .claims import judge
from .experiments import cases
from .figures import figures
from .tables import tables

STUDY = Study(
    name="station-stop",
    title="stopping at a platform mark by an offline fuzzy query table",
    source="Fuzzy control in the braking of trains that call at a station",
    cases=cases,
    judge=judge,
    figures=figures,
    tables=tables,
)
