"""Inference against brute force: sampled outlines, and outlines integrated piece by piece."""

import random

import casadi as ca
import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import Gaussians, Mamdani, Sugeno, Triangles
from railcosim.controllers.fuzzy import centroid, rule_table, sampled_centroid
from railcosim.controllers.fuzzy.sets import UniformSets
from railcosim.controllers.rules import GAIN_RULES, SEVEN, SPEED_RULES, SWITCHING_RULES


def triangle(y: np.ndarray, peak: float | np.ndarray, width: float) -> np.ndarray:
    return np.maximum(0.0, 1.0 - np.abs(y - peak) / width)


def brute_force(base: Mamdani, row: float, column: float, samples: int = 200_001) -> float:
    """Min-max inference by its definition, over a sampled outline (trapezoidal rule)."""

    def degrees(sets: UniformSets, value: float) -> np.ndarray:
        value = min(max(value, sets.low), sets.high)
        peaks = np.linspace(sets.low, sets.high, len(sets.labels))
        return triangle(np.asarray(value), peaks, peaks[1] - peaks[0])

    peaks = np.linspace(base.output.low, base.output.high, len(base.output.labels))
    y = np.linspace(base.output.low, base.output.high, samples)
    outline = np.zeros(samples)
    for i, a in enumerate(degrees(base.rows, row)):
        for j, b in enumerate(degrees(base.columns, column)):
            if min(a, b) > 0.0:
                shape = triangle(y, peaks[base.rules[i][j]], peaks[1] - peaks[0])
                outline = np.maximum(outline, np.minimum(shape, min(a, b)))
    return float(np.trapezoid(y * outline, y) / np.trapezoid(outline, y))


@pytest.mark.parametrize("base", [SPEED_RULES, GAIN_RULES])
def test_the_exact_centroid_is_the_limit_of_sampling(base: Mamdani) -> None:
    generator = random.Random(3)
    for _ in range(60):
        row = generator.uniform(1.2 * base.rows.low, 1.2 * base.rows.high)
        column = generator.uniform(1.2 * base.columns.low, 1.2 * base.columns.high)
        # 2e5 points on a universe of 20: the trapezoidal rule errs by about 1e-8 here
        assert base(row, column) == pytest.approx(brute_force(base, row, column), abs=2e-7)


def test_the_centroid_of_shapes_that_can_be_written_down() -> None:
    sets = Triangles(0.0, 2.0, ("a", "b", "c"))
    assert centroid(sets, [0.0, 1.0, 0.0]) == pytest.approx(1.0, abs=1e-15)
    # A full end set is half a triangle, centre of gravity at a third of its width.
    assert centroid(sets, [1.0, 0.0, 0.0]) == pytest.approx(1.0 / 3.0, abs=1e-15)
    # All sets full: peaks at 0, 1, 2 and valleys of one half between; symmetric about 1.
    assert centroid(sets, [1.0, 1.0, 1.0]) == pytest.approx(1.0, abs=1e-15)


def test_sampling_is_the_definition_with_101_points() -> None:
    sets = Triangles(-10.0, 10.0, SEVEN)
    heights = [0.0, 0.3, 0.7, 0.1, 0.0, 0.0, 0.2]
    y = np.linspace(-10.0, 10.0, 101)
    outline = np.zeros(101)
    for peak, height in zip(np.linspace(-10, 10, 7), heights, strict=True):
        outline = np.maximum(outline, np.minimum(triangle(y, peak, 20 / 6), height))
    expected = float(np.sum(y * outline) / np.sum(outline))
    assert sampled_centroid(sets, heights) == pytest.approx(expected, abs=1e-12)


def test_takagi_sugeno_by_its_definition() -> None:
    generator = random.Random(5)
    e_peaks, ec_peaks = np.linspace(-1, 1, 6), np.linspace(-1, 1, 5)
    numbers = np.array(SWITCHING_RULES.rules)
    product = Sugeno(SWITCHING_RULES.rows, SWITCHING_RULES.columns, SWITCHING_RULES.rules, "prod")
    for _ in range(500):
        e, ec = generator.uniform(-1.3, 1.3), generator.uniform(-1.3, 1.3)
        a = triangle(np.clip(np.asarray(e), -1, 1), e_peaks, 0.4)
        b = triangle(np.clip(np.asarray(ec), -1, 1), ec_peaks, 0.5)
        w = np.minimum.outer(a, b)
        assert SWITCHING_RULES(e, ec) == pytest.approx((w * numbers).sum() / w.sum(), abs=1e-13)
        w = np.outer(a, b)
        assert product(e, ec) == pytest.approx((w * numbers).sum() / w.sum(), abs=1e-13)


@pytest.mark.parametrize("conjunction", ["min", "prod"])
def test_takagi_sugeno_of_gaussians_by_its_definition(conjunction) -> None:
    rows = Gaussians(-1.0, 1.0, SWITCHING_RULES.rows.labels, 0.2)
    columns = Gaussians(-1.0, 1.0, SWITCHING_RULES.columns.labels)  # cross at one half
    base = Sugeno(rows, columns, SWITCHING_RULES.rules, conjunction)
    numbers, combine = np.array(base.rules), np.minimum if conjunction == "min" else np.multiply
    generator = random.Random(6)
    for _ in range(500):
        e, ec = generator.uniform(-1.3, 1.3), generator.uniform(-1.3, 1.3)
        a = np.exp(-((np.clip(e, -1, 1) - np.linspace(-1, 1, 6)) ** 2) / (2 * 0.2**2))
        b = 0.5 ** (((np.clip(ec, -1, 1) - np.linspace(-1, 1, 5)) / 0.25) ** 2)
        w = combine.outer(a, b)
        assert base(e, ec) == pytest.approx((w * numbers).sum() / w.sum(), abs=1e-13)


# The tables as the paper's text prints them, line by line behind the row's label.
TABLE_1 = """NB NB NB NM NM NS NS ZO NM NB NM NM NS NS ZO PS NS NM NM NS NS ZO PS PS ZO NM NS NS ZO
PS PS PM PS NS NS ZO PS PS PM PM PM NS ZO PS PS PM PM PB PB ZO PS PS PM PM PB PB"""
TABLE_2 = """NB PB PB PM PM PS PS ZO NM PB PM PM PS PS ZO NS NS PB PM PS PS ZO ZO NS ZO PM PM PS ZO
ZO NS NM PS PS PS ZO ZO NS NM NM PM PS ZO NS NS NM NM NB PB ZO NS NS NM NM NB NB"""
TABLE_3 = """NB F F F F N NM F F F N N NS F N N N N PS N N N N F PM N N N F F PB N F F F F"""


def printed(text: str, columns: int) -> list[list[str]]:
    words = text.split()
    return [words[i + 1 : i + columns + 1] for i in range(0, len(words), columns + 1)]


def test_the_tables_are_as_printed() -> None:
    for base, text in ((SPEED_RULES, TABLE_1), (GAIN_RULES, TABLE_2)):
        assert [[SEVEN[k] for k in row] for row in base.rules] == printed(text, 7)
    modes = [["F" if number == 1.0 else "N" for number in row] for row in SWITCHING_RULES.rules]
    assert modes == printed(TABLE_3, 5)


def test_the_tables_symmetries_are_as_the_sheet_says() -> None:
    speed = np.array(SPEED_RULES.rules) - 3
    assert (speed == speed.T).all()
    assert (speed == -speed[::-1, ::-1]).all()
    assert (np.diff(speed) >= 0).all()
    gain = np.array(GAIN_RULES.rules) - 3
    assert (gain != -gain[::-1, ::-1]).sum() / 2 == 5
    switching = np.array(SWITCHING_RULES.rules)
    assert (switching != switching[::-1, ::-1]).sum() / 2 == 1  # (NM, ZO) against (PM, ZO)


def test_near_the_set_point_the_fuzzy_weight_is_exactly_zero() -> None:
    for e in (-0.2, -0.1, 0.0, 0.1, 0.2):
        for ec in (-0.5, -0.2, 0.0, 0.3, 0.5):
            assert SWITCHING_RULES(e, ec) == 0.0


def test_a_rule_fires_everywhere() -> None:
    for row in np.linspace(-4, 4, 81):
        for column in np.linspace(-1, 1, 81):
            assert np.isfinite(SPEED_RULES(float(row), float(column)))


def test_mistakes_in_a_rule_base_are_found_when_it_is_built() -> None:
    sets = Triangles(-1.0, 1.0, ("N", "P"))
    with pytest.raises(ParameterError, match="2 rows of 2"):
        rule_table("N P", 2, 2, sets.labels)
    with pytest.raises(ParameterError, match="no set 'Q'"):
        rule_table("N P\nP Q", 2, 2, sets.labels)
    with pytest.raises(ParameterError, match="none might fire"):
        Mamdani(sets, sets, sets, ((0, 1),))
    with pytest.raises(ParameterError, match="does not exist"):
        Mamdani(sets, sets, sets, ((0, 1), (1, 2)))
    with pytest.raises(ParameterError, match="'centroid', 'bisector'"):
        Mamdani(sets, sets, sets, ((0, 1), (1, 1)), "mean")  # type: ignore[arg-type]  # pyright: ignore
    with pytest.raises(ParameterError, match="'min' or 'prod'"):
        Sugeno(sets, sets, ((0.0, 1.0), (1.0, 1.0)), "max")  # type: ignore[arg-type]  # pyright: ignore
    narrow = Gaussians(-1.0, 1.0, ("N", "P"), 0.2)  # exp(−12.5) midway between the peaks
    with pytest.raises(ParameterError, match="sets of the columns leave gaps.*widen sigma"):
        Mamdani(sets, narrow, sets, ((0, 1), (1, 1)))
    with pytest.raises(ParameterError, match="sets of the rows leave gaps"):
        Sugeno(narrow, sets, ((0.0, 1.0), (1.0, 1.0)))
    Mamdani(sets, sets, narrow, ((0, 1), (1, 1)))  # as an output's they may be
    with pytest.raises(ParameterError, match="low must lie below"):
        Triangles(1.0, 1.0, ("N", "P"))
    with pytest.raises(ParameterError, match="two or more sets"):
        Triangles(0.0, 1.0, ("N",))


def test_a_constant_symbol_and_a_float_give_the_same() -> None:
    assert float(ca.DM(SPEED_RULES(ca.SX(0.7), ca.SX(0.2)))) == SPEED_RULES(0.7, 0.2)
