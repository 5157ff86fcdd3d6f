"""What is identified, and what is taken as known."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...base.errors import ParameterError, listing, suggest
from ...base.railway import KILOMETRES_PER_HOUR

DENOMINATOR = 0.01191  # K2, which goes with K1 = 100 K2 K; the precise braking paper, table 1


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter: the paper's symbol, its name in the plant, unit, bounds and start of a search.

    A start far from the paper's values, and so no help; our choice, as the bounds are.
    """

    symbol: str
    name: str
    unit: str
    low: float
    high: float
    start: float
    meaning: str


PRECISE = (
    Parameter(symbol="T1", name="electric_delay", unit="s", low=0.0, high=3.0, start=0.5,
              meaning="transmission delay, electric"),
    Parameter(symbol="T2", name="electric_lag", unit="s", low=0.05, high=3.0, start=0.5,
              meaning="response lag, electric"),
    Parameter(symbol="P1", name="electric_coefficient", unit="1", low=0.3, high=1.5, start=1.0,
              meaning="electric brake over command"),
    Parameter(symbol="T3", name="air_delay", unit="s", low=0.0, high=3.0, start=0.5,
              meaning="transmission delay, air"),
    Parameter(symbol="T4", name="air_lag", unit="s", low=0.1, high=6.0, start=1.0,
              meaning="response lag, air"),
    Parameter(symbol="K", name="air_gain", unit="m/s2", low=0.1, high=3.0, start=1.0,
              meaning="full air brake, K1/K2"),
)  # fmt: skip
CHANGEOVER = Parameter(
    symbol="V_sw", name="changeover_speed", unit="m/s", low=0.5, high=8.0, start=3.0,
    meaning="speed of the changeover",
)  # fmt: skip
COARSE = (
    Parameter(symbol="T", name="delay", unit="s", low=0.0, high=3.0, start=0.5,
              meaning="input delay"),
    Parameter(symbol="τ", name="lag", unit="s", low=0.05, high=6.0, start=0.5,
              meaning="time constant of the brake"),
)  # fmt: skip
# The paper's (section 3.1), with which existing models are used
COARSE_PUBLISHED = {"delay": 0.3, "lag": 0.65}
PAPER = {
    "electric_delay": 0.9, "electric_lag": 0.83, "electric_coefficient": 0.85,
    "air_delay": 0.8, "air_lag": 1.741, "air_gain": 1.0142 / 0.01191 / 100.0,
}  # fmt: skip
# Taken as known unless given otherwise: as in the plants
CONSTANTS = {
    "mass_ratio": 1.0,
    "fade_rate": 0.3,
    "fade_reference": 0.7,
    "changeover_speed": 12.0 / KILOMETRES_PER_HOUR,
    "davis_a": 2.031,
    "davis_b": 0.0622,
    "davis_c": 0.001807,
    "largest_deceleration": 1.0,
}
_SYMBOLS = {"mu": "mass_ratio", "μ": "mass_ratio", "k_bra": "fade_rate", "a_ref": "fade_reference"}
_NON_NEGATIVE = ("davis_a", "davis_b", "davis_c", "electric_delay", "air_delay", "delay")


def canonical(fixed: Mapping[str, float]) -> dict[str, float]:
    """Return values by the plant's names, for names or symbols (T1 … K, V_sw, k_bra, mu).

    Raise ParameterError for an unknown name or an impossible value.
    """
    known = {p.symbol: p.name for p in (*PRECISE, CHANGEOVER, *COARSE)}
    known |= {p.name: p.name for p in (*PRECISE, CHANGEOVER, *COARSE)}
    known |= {name: name for name in CONSTANTS} | _SYMBOLS
    found: dict[str, float] = {}
    for name, value in fixed.items():
        if name not in known:
            raise ParameterError(
                f"nothing to fix named '{name}'; there are: {listing(known, 40)}"
                f"{suggest(name, known)}"
            )
        plain = known[name]
        if plain in found:
            raise ParameterError(f"'{plain}' is fixed twice")
        least = 0.0 if plain in _NON_NEGATIVE else 1e-3
        if not isinstance(value, int | float) or not least <= value < 1e6:
            raise ParameterError(f"{name} must be a number from {least:g} up, not {value!r}")
        found[plain] = float(value)
    return found
