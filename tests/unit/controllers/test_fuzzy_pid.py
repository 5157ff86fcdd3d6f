"""The fuzzy adaptive PID: its tables as printed, its gains by other numerics; traced, too."""

import itertools
import math
import random
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from railcosim.base.errors import BuildError, ParameterError
from railcosim.controllers import FuzzyPID, SamplePID
from railcosim.controllers.fuzzy_pid_rules import gain_rules
from railcosim.controllers.fuzzy_pid_table import COUNT, gain_table, looked_up
from railcosim.fmus import trace
from tests.tracing import largest_difference

SEVEN = ("NB", "NM", "NS", "ZO", "PS", "PM", "PB")
# As the paper's text prints its tables 2, 3 and 1: column by column (ec), headed by its label.
PRINTED = {
    "kp": """NB NM NL NL NL NM NL ZO NM NS NM NM NM NL ZO PL NS NM NL NL NL ZO PL PM
    ZO NM NL NL ZO PL PL PM PS NM NL ZO PL PL PL PM PM NL ZO PL PM PM PM PS
    PB ZO PL PM PL PL PL PM""",
    "ki": """NB ZO ZO ZO ZO NS NL ZO NM NS NS ZO ZO NL ZO PL NS NM NL NL NL ZO PL PS
    ZO NL NL NL ZO PL PL PL PS NS NL ZO PL PL PL PM PM NL ZO PL ZO ZO PS PS
    PB ZO PL PS ZO ZO ZO ZO""",
    "kd": """NB NS NM NL NL NM NS ZO NM NM NM NL NL NS ZO PS NS ZO NS NS NS ZO PS PM
    ZO ZO ZO NS ZO PS ZO ZO PS NM NS ZO PS PS PS ZO PM NS ZO PS PL PL PM PM
    PB ZO PS PM PL PL PM PS""",
}
READINGS = [(gain, extreme) for gain in PRINTED for extreme in (6.0, 2.0)]
WIDE = (1e6, -1e6)


def peaks(gain: str, extreme: float) -> np.ndarray:
    """Where the consequents peak, by row e and column ec, read from the text above."""
    numbers = {label: 2.0 * (k - 3) for k, label in enumerate(SEVEN)}
    numbers |= {"NL": -extreme, "PL": extreme}
    words = PRINTED[gain].split()
    assert tuple(words[::8]) == SEVEN
    return np.array([[numbers[w] for w in words[k : k + 7]] for k in range(1, 56, 8)]).T


def rules_of(gain: str, extreme: float) -> Any:
    return gain_rules(extreme)[list(PRINTED).index(gain)]


@pytest.mark.parametrize(("gain", "extreme"), READINGS)
def test_the_tables_are_as_printed_and_odd(gain: str, extreme: float) -> None:
    table = peaks(gain, extreme)
    assert (np.array(rules_of(gain, extreme).rules) * 2.0 - 6.0 == table).all()
    assert (table == -table[::-1, ::-1]).all()


Y = np.linspace(-6.0, 6.0, 20_001)
GRADES = {c: np.exp(-((Y - c) ** 2) / (2.0 * 0.85**2)) for c in np.linspace(-6.0, 6.0, 7)}


def left_share(table: np.ndarray, e: float, ec: float, place: float) -> float:
    """The share of the area left of a place, summed over points; sets and rules in numpy."""
    centres = np.linspace(-6.0, 6.0, 7)
    e_grades = np.maximum(0.0, 1.0 - np.abs(np.clip(e, -6.0, 6.0) - centres) / 2.0)
    ec_grades = np.maximum(0.0, 1.0 - np.abs(np.clip(ec, -6.0, 6.0) - centres) / 2.0)
    outline = np.zeros_like(Y)
    for i, j in itertools.product(range(7), range(7)):
        fires = min(e_grades[i], ec_grades[j])
        outline = np.maximum(outline, np.minimum(fires, GRADES[table[i, j]]))
    areas = np.concatenate([[0.0], np.cumsum(0.5 * (outline[1:] + outline[:-1]))])
    return float(np.interp(place, Y, areas) / areas[-1])


@pytest.mark.parametrize(("gain", "extreme"), READINGS)
def test_the_inference_halves_the_area(gain: str, extreme: float) -> None:
    generator, table = random.Random(6), peaks(gain, extreme)
    rules = rules_of(gain, extreme)
    for _ in range(100):
        e, ec = generator.uniform(-6.5, 6.5), generator.uniform(-6.5, 6.5)
        assert left_share(table, e, ec, rules(e, ec)) == pytest.approx(0.5, abs=1e-6)


def test_the_gains_are_scaled_from_the_universes() -> None:
    block = FuzzyPID(reading="literal", universe=50e3, change_universe=2e3)
    kp, ki, kd = (rules_of(gain, 6.0) for gain in PRINTED)
    found = block.gains(-20e3, 0.7e3)
    e, ec = -2.4, 2.1
    expected = (0.8 + kp(e, ec) / 6.0, 0.003 + 0.001 * ki(e, ec), 4.0 + kd(e, ec))
    assert found == pytest.approx(expected, abs=1e-12)
    assert block.gains(-80e3, 9e3) == block.gains(-50e3, 2e3)
    same = FuzzyPID(reading="literal", universe=50e3)
    assert same.gains(-20e3, 0.7e3) == pytest.approx(
        (0.8 + kp(e, 0.084) / 6.0, 0.003 + 0.001 * ki(e, 0.084), 4.0 + kd(e, 0.084)), abs=1e-12
    )


def test_gains_fall_below_zero_as_printed_but_not_where_folding_turns_them() -> None:
    literal, folded = FuzzyPID(reading="literal"), FuzzyPID()
    kp, ki, _ = literal.gains(-100e3, 0.0)
    assert ki < 0.0 < kp
    assert literal.gains(-66e3, 0.0)[0] < 0.0
    assert min(folded.gains(-66e3, 0.0)) > 0.0


@pytest.mark.parametrize("extreme", [6.0, 2.0])
def test_folded_is_the_tables_by_the_errors_sign(extreme: float) -> None:
    generator = random.Random(7)
    literal, folded = (FuzzyPID(reading=r, extreme=extreme) for r in ("literal", "folded"))  # pyright: ignore[reportArgumentType]
    for _ in range(200):
        e, change = generator.uniform(0.0, 120e3), generator.uniform(-120e3, 120e3)
        assert folded.gains(e, change) == literal.gains(e, change)
        assert folded.gains(-e, -change) == folded.gains(e, change)
        twice = (1.6, 0.006, 8.0)  # by oddness: the middles of both readings of −e
        sums = zip(folded.gains(-e, change), literal.gains(-e, change), strict=True)
        assert [a + b for a, b in sums] == pytest.approx(twice, abs=1e-11)
    assert folded.gains(0.0, 40e3) == pytest.approx((0.8, 0.003, 4.0), abs=1e-15)
    assert folded.gains(0.0, 40e3) == folded.gains(0.0, -40e3)


def response(block: FuzzyPID, sign: float) -> list[float]:
    """Return the forces for a wild run, mirrored for −1."""
    generator, x, found = random.Random(8), block.start(), []
    e = 0.0
    for k in range(600):
        e = 0.9 * e + generator.uniform(-20e3, 20e3) + (8e3 if k < 300 else -8e3)
        upper, lower = (120e3, -150e3) if sign > 0.0 else (150e3, -120e3)
        y, x = block.step(x, sign * e, 0.0, upper, lower, sign * 5e3)
        found.append(y[0])
    return found


@pytest.mark.parametrize("extreme", [6.0, 2.0])
def test_a_mirrored_error_gives_the_mirrored_force_if_folded(extreme: float) -> None:
    options: dict[str, Any] = {"extreme": extreme, "filter_time": 0.004, "feed_forward": True}
    block = FuzzyPID(rate=2e7, **options)
    assert response(block, 1.0) == [-f for f in response(block, -1.0)]
    literal = FuzzyPID(rate=2e7, reading="literal", **options)
    pairs = zip(response(literal, 1.0), response(literal, -1.0), strict=True)
    assert max(abs(a + b) for a, b in pairs) > 10e3


@pytest.mark.parametrize("integral", ["terms", "sum"])
def test_the_force_is_that_of_its_gains(integral: Any) -> None:
    block = FuzzyPID(integral=integral, rate=math.inf)
    generator, x, before = random.Random(9), block.start(), None
    errors, terms = [], []
    for _ in range(500):
        e = generator.uniform(-120e3, 120e3)
        (force, kp, ki, kd), x = block.step(x, e, 0.0, math.inf, -math.inf)
        errors.append(e)
        terms.append(ki * e)
        change = 0.0 if before is None else e - before
        assert (kp, ki, kd) == block.gains(e, change)
        total = sum(terms) if integral == "terms" else ki * sum(errors)
        assert force == pytest.approx(kp * e + total + kd * change, abs=1e-6)
        before = e


def test_without_changes_it_is_the_pid() -> None:
    """Errors far below the universe leave the gains where they are."""
    fuzzy, plain = FuzzyPID(universe=1e12), SamplePID()
    generator, x, z = random.Random(10), FuzzyPID().start(), SamplePID().start()
    for _ in range(300):
        e = generator.uniform(-20e3, 20e3)
        y, x = fuzzy.step(x, e, 0.0, *WIDE)
        force, z = plain.step(z, e, 0.0, *WIDE)
        assert y[0] == pytest.approx(force, abs=0.1)


def test_the_table_is_bilinear_in_the_exact_inference() -> None:
    axis, generator = np.linspace(-6.0, 6.0, COUNT), random.Random(11)
    cells = np.array(gain_table(6.0))
    for i, j in ((0, 0), (37, 101), (60, 60), (120, 5)):
        exact = [rules(float(axis[i]), float(axis[j])) for rules in gain_rules(6.0)]
        assert cells[i, j] == pytest.approx(exact, abs=1e-9)
    peer = RegularGridInterpolator((axis, axis), cells)
    points = [(generator.uniform(-6.0, 6.0), generator.uniform(-6.0, 6.0)) for _ in range(500)]
    points += [(6.0, 6.0), (-6.0, -6.0), (6.0, -6.0), (0.0, 6.0)]
    found = [looked_up(gain_table(6.0), *point) for point in points]
    np.testing.assert_allclose(found, peer(np.array(points)), rtol=0.0, atol=1e-11)


def test_the_tables_error_is_what_it_says() -> None:
    error = FuzzyPID().table_error(points=2000)
    assert list(error) == ["kp", "ki", "kd"]
    for rms, largest in error.values():
        assert 0.0 < rms < 0.2
        assert rms < largest
    tabled = FuzzyPID(inference="table", reading="literal")
    exact = FuzzyPID(reading="literal")
    off = [abs(a - b) for a, b in zip(tabled.gains(3e4, 2e4), exact.gains(3e4, 2e4), strict=True)]
    assert off[2] <= FuzzyPID().table_error(points=2000)["kd"][1]


def test_the_table_cannot_be_traced() -> None:
    with pytest.raises(BuildError, match=r"inference='table' is for floats; trace it with 'exact'"):
        trace(FuzzyPID(inference="table"))


def test_wrong_parameters() -> None:
    for options, words in (
        ({"universe": 0.0}, "universe must be a positive number"),
        ({"change_universe": -1.0}, "change_universe must be a positive number"),
        ({"kp_change": 0.0}, "kp_change must be a positive number"),
        ({"reading": "mirrored"}, "reading is 'literal' or 'folded', not 'mirrored'"),
        ({"integral": "none"}, "integral is 'terms' or 'sum', not 'none'"),
        ({"inference": "fast"}, "inference is 'exact' or 'table', not 'fast'"),
        ({"extreme": 4.0}, "extreme is 6.0 or 2.0, not 4.0"),
        ({"rate": -1.0}, "FuzzyPID: rate must be in N/s"),
    ):
        with pytest.raises(ParameterError, match=words):
            FuzzyPID(**options)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ParameterError, match=r"peak, 6\.0 or 2\.0, not 3\.0"):
        gain_rules(3.0)


def points(count: int) -> tuple[list[Any], list[tuple[float, ...]]]:
    generator, states, inputs = random.Random(13), [], []
    for _ in range(count):
        e, last = (generator.uniform(-120e3, 120e3) for _ in range(2))
        if generator.random() < 0.2:  # on the peaks of sets, and at e = 0
            e = generator.randrange(-3, 4) * 1e5 / 3.0
            last = e - generator.randrange(-3, 4) * 1e5 / 3.0
        total, force = generator.uniform(-1e5, 1e5), generator.uniform(-1e5, 1e5)
        states.append((total, generator.uniform(-1e3, 1e3), last, force, float(e < -1e5)))
        inputs.append((e, 0.0, generator.uniform(0.0, 3e5), generator.uniform(-3e5, 0.0)))
    return states, inputs


@pytest.mark.parametrize("extreme", [6.0, 2.0])
@pytest.mark.parametrize(("reading", "integral"), [("folded", "terms"), ("literal", "sum")])
def test_traced_at_random_points(reading: Any, integral: Any, extreme: float) -> None:
    block = FuzzyPID(reading=reading, integral=integral, extreme=extreme)
    assert largest_difference(block, *points(1500)) <= 1e-12
