"""The rule bases of the adaptive fuzzy paper, as printed (its tables 1 and 2)."""

from .fuzzy import Mamdani, Triangles
from .fuzzy.tables import rule_table
from .rules import SEVEN, SPEED_RULES

GAMMA_SETS = ("VS", "S", "M", "B", "VB")

_EC = Triangles(-6.0, 6.0, SEVEN)
_E = Triangles(-3.0, 3.0, SEVEN)

# Table 1, which is the soft-switching paper's table 1. Rows EC, columns E; E ±3 and EC ±6 are the
# paper's, U ±6 is ours.
ADAPTIVE_RULES = Mamdani(
    rows=_EC,
    columns=_E,
    output=Triangles(-6.0, 6.0, SEVEN),
    rules=SPEED_RULES.rules,
)

# Table 2. Rows EC, columns E; γ from VS to VB uniform on [0, 1] (our reading of γ in (0, 1]: the
# centroid of VS alone is 1/12). Kept as printed: (NS, ZO) = S, but (PS, ZO) = M.
GAMMA_RULES = Mamdani(
    rows=_EC,
    columns=_E,
    output=Triangles(0.0, 1.0, GAMMA_SETS),
    rules=rule_table(
        """
        VB VB B M M M B
        VB VB B M M B B
        VB B  B S M B VB
        VB B  M VS M B VB
        VB B  M M B B VB
        B  B  M M B VB VB
        B  M  M M B VB VB
        """,
        7,
        7,
        GAMMA_SETS,
    ),
)
