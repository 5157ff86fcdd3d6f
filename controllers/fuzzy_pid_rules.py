"""The rule bases of the heavy-haul paper's fuzzy adaptive PID (its tables 1 to 3).

Rows e, columns ec, both NB … PB; universes ±6, triangles in and Gaussians out, equal area (the
paper); σ is 0.85 (ours). All three tables are odd: the cell opposite of each is its negative.
Which table belongs to which gain rests on the order of tables and captions in the text alone.

The paper's outputs are NB … PB, and NB and PB appear in no table; NL and PL do instead, and are
nowhere explained. Read as "large" they are NB and PB (±6), the only way for the gains to reach the
ends of their ranges; then up to 24 of 84 neighbouring pairs in ΔKp and 30 in ΔKi are three sets
apart. Read as "little" they are NS and PS (±2); then no neighbours in ΔKp and ΔKi are more than
one set apart, but two labels name one set.
"""

from functools import lru_cache

from ..base.errors import ParameterError
from .fuzzy import Gaussians, Mamdani, Triangles, rule_table
from .rules import SEVEN

END = 6.0  # universes go from −6 to 6
INPUT = Triangles(-END, END, SEVEN)
OUTPUT = Gaussians(-END, END, SEVEN, sigma=0.85)

# Table 2.
KP_RULES = """
NM NS NM NM NM NL ZO
NL NM NL NL NL ZO PL
NL NM NL NL ZO PL PM
NL NM NL ZO PL PM PL
NM NL ZO PL PL PM PL
NL ZO PL PL PL PM PL
ZO PL PM PM PM PS PM
"""

# Table 3.
KI_RULES = """
ZO NS NM NL NS NL ZO
ZO NS NL NL NL ZO PL
ZO ZO NL NL ZO PL PS
ZO ZO NL ZO PL ZO ZO
NS NL ZO PL PL ZO ZO
NL ZO PL PL PL PS ZO
ZO PL PS PL PM PS ZO
"""

# Table 1.
KD_RULES = """
NS NM ZO ZO NM NS ZO
NM NM NS ZO NS ZO PS
NL NL NS NS ZO PS PM
NL NL NS ZO PS PL PL
NM NS ZO PS PS PL PL
NS ZO PS ZO PS PM PM
ZO PS PM ZO ZO PM PS
"""

_SETS = {6.0: {"NL": "NB", "PL": "PB"}, 2.0: {"NL": "NS", "PL": "PS"}}


@lru_cache
def gain_rules(extreme: float) -> tuple[Mamdani, Mamdani, Mamdani]:
    """Return the rules of (ΔKp, ΔKi, ΔKd), all on ±6, with NL and PL at ∓`extreme`: 6 or 2.

    Raise ParameterError for another `extreme`.
    """
    if extreme not in _SETS:
        raise ParameterError(f"extreme is where NL and PL peak, 6.0 or 2.0, not {extreme!r}")

    def rules(text: str) -> Mamdani:
        for label, name in _SETS[extreme].items():
            text = text.replace(label, name)
        return Mamdani(INPUT, INPUT, OUTPUT, rule_table(text, 7, 7, SEVEN), "bisector")

    return rules(KP_RULES), rules(KI_RULES), rules(KD_RULES)
