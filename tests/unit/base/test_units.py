import pytest

from railcosim.base.errors import UnitError
from railcosim.base.units import compatible, parse


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", {}),
        ("m/s2", {"m": 1, "s": -2}),
        ("N.m", {"kg": 1, "m": 2, "s": -2}),
        ("1/s", {"s": -1}),
        ("rad/s", {"rad": 1, "s": -1}),
        ("kN", {"kg": 1, "m": 1, "s": -2, "factor": 1e3}),
        ("km/h", {"m": 1, "s": -1, "factor": 1e3 / 3600.0}),
        ("N/(m.s)", {"kg": 1, "s": -3}),
        ("degC", {"K": 1, "offset": 273.15}),
        ("m2", {"m": 2}),
        ("mm", {"m": 1, "factor": 1e-3}),
        ("min", {"s": 1, "factor": 60.0}),
    ],
)
def test_means_what_si_says(text: str, expected: dict[str, float]) -> None:
    assert parse(text).base_unit() == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    "text", ["", " m", "furlong", "m/s/s", "m//s", "degC/s", "m^2", "2", "m/", "/s", "m/()"]
)
def test_refuses_what_is_no_unit(text: str) -> None:
    with pytest.raises(UnitError):
        parse(text)


def test_names_the_nearest_unit() -> None:
    with pytest.raises(UnitError, match="did you mean 'rad'"):
        parse("rads")


def test_same_number_in_other_words_is_compatible() -> None:
    assert compatible("N", "kg.m/s2")
    assert not compatible("m/s", "km/h")
    assert not compatible("rad/s", "1/s")
