"""Study `precise-braking`: stopping a metro train at the mark, with two brakes and their delays."""

from ..registry import Study
from .claims import judge
from .experiments import cases
from .figures import figures
from .line_cases import on_line, unmet
from .tables import tables

STUDY = Study(
    name="precise-braking",
    title="The metro stop with electric and air brake",
    source=(
        "Yu, Zhang, Zhang: Key Issues in Real-time Optimization of Braking Performance for Urban "
        "Rail Transit Trains, Urban Rapid Rail Transit 37 (2024) 4 (in Chinese)"
    ),
    cases=cases,
    judge=judge,
    figures=figures,
    tables=tables,
    on_line=on_line,
    unmet=unmet,
)
