"""The rule bases of the soft-switching paper, as printed (tables 1 to 3).

They are kept as they are: in table 2 five pairs of opposite cells are not each other's negative, in
table 3 one pair differs ((NM, ZO) = F against (PM, ZO) = N).
"""

from .fuzzy import Mamdani, Sugeno, Triangles, rule_table

SEVEN = ("NB", "NM", "NS", "ZO", "PS", "PM", "PB")
SIX = ("NB", "NM", "NS", "PS", "PM", "PB")
FIVE = ("NB", "NS", "ZO", "PS", "PB")


def _seven(low: float, high: float) -> Triangles:
    return Triangles(low, high, SEVEN)


# Table 1. Rows EC, columns E, both NB … PB; universes E ±0.6, EC ±3, U ±10.
SPEED_RULES = Mamdani(
    rows=_seven(-3.0, 3.0),
    columns=_seven(-0.6, 0.6),
    output=_seven(-10.0, 10.0),
    rules=rule_table(
        """
        NB NB NM NM NS NS ZO
        NB NM NM NS NS ZO PS
        NM NM NS NS ZO PS PS
        NM NS NS ZO PS PS PM
        NS NS ZO PS PS PM PM
        NS ZO PS PS PM PM PB
        ZO PS PS PM PM PB PB
        """,
        7,
        7,
        SEVEN,
    ),
)

# Table 2. Rows EC, columns E on ±1; output K, NB … PB uniform on [0, 3] (our reading).
GAIN_RULES = Mamdani(
    rows=_seven(-1.0, 1.0),
    columns=_seven(-1.0, 1.0),
    output=_seven(0.0, 3.0),
    rules=rule_table(
        """
        PB PB PM PM PS PS ZO
        PB PM PM PS PS ZO NS
        PB PM PS PS ZO ZO NS
        PM PM PS ZO ZO NS NM
        PS PS ZO ZO NS NM NM
        PS ZO NS NS NM NM NB
        ZO NS NS NM NM NB NB
        """,
        7,
        7,
        SEVEN,
    ),
)

# Table 3. Rows E, columns EC on ±1; F (1) is fuzzy control, N (0) the single neuron. The six
# sets of E peak at ±0.2, ±0.6, ±1 (our reading).
SWITCHING_RULES = Sugeno(
    rows=Triangles(-1.0, 1.0, SIX),
    columns=Triangles(-1.0, 1.0, FIVE),
    rules=tuple(
        tuple(1.0 - mode for mode in row)
        for row in rule_table(
            """
            F F F F N
            F F F N N
            F N N N N
            N N N N F
            N N N F F
            N F F F F
            """,
            6,
            5,
            ("F", "N"),
        )
    ),
)
