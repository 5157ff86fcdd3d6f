"""The query table's quantiser, look-up, on-line inference and interpolation; traced, too."""

import itertools
import math
import random
from dataclasses import replace
from decimal import ROUND_HALF_UP, Decimal

import casadi as ca
import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import QueryTable
from railcosim.controllers.stop_rules import STOP_RELATION
from railcosim.cosim.block import Block
from railcosim.fmus import trace

TABLE = np.array(STOP_RELATION.table())
# Periods and ranges so that a level is one unit and rates are differences: nothing is rounded.
UNIT = QueryTable(e_range=(-6.0, 6.0), ec_range=(-6.0, 6.0), period=1.0)
BLOCKS: dict[str, QueryTable] = {
    "centroid": QueryTable(),
    "mean_of_maxima": QueryTable(defuzzify="mean_of_maxima", ec_range=(-20.0, 20.0)),
    "on_line": replace(UNIT, on_line=True),
    "on_line_maxima": QueryTable(defuzzify="mean_of_maxima", on_line=True),
    "interpolate": QueryTable(interpolate=True),
    "unit": UNIT,
    "unit_interpolate": replace(UNIT, interpolate=True),
    "skewed": QueryTable(e_range=(-4.0, 8.0), ec_range=(-1.0, 3.0), u_range=(10.0, 20.0)),
}


def level(block: QueryTable, e: float, ec: float) -> float:
    """U at an error (cm) and rate (cm/s) of the unit block, where both are exact."""
    (_, found), _ = block.step((e - ec, 0.0), e)
    return found


def place(x: float) -> int:
    """|x| rounded half up in decimal arithmetic, which is exact for every float."""
    return int(Decimal(abs(x)).quantize(Decimal(1), rounding=ROUND_HALF_UP))


def cell(e: float, ec: float) -> float:
    """The table's cell by the sheet's words: half away from zero, e ≥ 0 that rounds to 0 is +0."""
    e, ec = min(max(e, -6.0), 6.0), min(max(ec, -6.0), 6.0)
    row = 7 + place(e) if e >= 0.0 else 6 - place(e)
    return float(TABLE[row, 6 + int(math.copysign(place(ec), ec))])


def ties() -> list[float]:
    """Halves, whole numbers and ends, and one ulp either side of each."""
    found = []
    for k in range(-14, 15):
        x = 0.5 * k
        found += [x, math.nextafter(x, -math.inf), math.nextafter(x, math.inf)]
    return [*found, -0.0, 0.49999999999999994, -0.49999999999999994, 1e-300, -1e-300, 99.0, -99.0]


def test_the_quantiser_at_its_ties() -> None:
    for e in ties():
        assert level(UNIT, e, 0.0) == cell(e, 0.0), e
    for ec in ties():
        (_, found), _ = UNIT.step((0.0 - ec, 0.0), 0.0)
        assert found == cell(0.0, 0.0 - (0.0 - ec)), ec
    assert level(UNIT, 0.49999999999999994, 0.0) == TABLE[7, 6]
    assert level(UNIT, 0.5, 0.0) == TABLE[8, 6]
    assert level(UNIT, -0.0, 0.0) == TABLE[7, 6]
    assert level(UNIT, -1e-300, 0.0) == TABLE[6, 6]


def test_the_ranges_are_mapped_to_levels() -> None:
    """±10 cm and ±10 cm/s: a level is 5/3, so 4 cm is level 2.4 and rounds to 2."""
    block = QueryTable()
    (u, found), state = block.step(block.start(), 4.0)
    assert found == TABLE[9, 6]
    assert u == pytest.approx(180.0 + 30.0 * TABLE[9, 6], abs=1e-12)
    assert state == (4.0, 0.0)
    (_, found), _ = block.step((4.5, 0.0), 4.0)  # −0.5 cm in 0.1 s: −5 cm/s, level −3
    assert found == TABLE[9, 3]
    (_, found), _ = QueryTable(e_range=(-4.0, 8.0)).step((0.0, 1.0), 5.0)  # 3 above the middle
    assert found == TABLE[10, 6]


def test_the_first_sample_has_no_rate() -> None:
    block = QueryTable()
    (_, found), _ = block.step(block.start(), 10.0)
    assert found == TABLE[13, 6]


@pytest.mark.parametrize("how", ["centroid", "mean_of_maxima"])
def test_the_look_up_equals_on_line_inference_to_the_bit(how) -> None:
    table = replace(UNIT, defuzzify=how)
    on_line = replace(table, on_line=True)
    for e, ec in itertools.product((*range(-6, 7), -0.25), range(-6, 7)):
        x = (float(e - ec), 0.0)
        assert table.step(x, float(e)) == on_line.step(x, float(e))
    for e, ec in itertools.product(ties()[::3], ties()[::5]):  # and between the grid's points
        assert level(table, e, ec) == level(on_line, e, ec)


def test_u_is_antisymmetric_about_its_middle() -> None:
    for block in (UNIT, replace(UNIT, interpolate=True)):
        generator = random.Random(4)
        for _ in range(500):
            e, last = generator.uniform(-7.0, 7.0), generator.uniform(-7.0, 7.0)
            (u, _), _ = block.step((last, 0.0), e)
            (mirrored, _), _ = block.step((-last, 0.0), -e)
            assert u - 180.0 == pytest.approx(180.0 - mirrored, abs=1e-11)


# Interpolation


def test_interpolation_meets_the_cells_and_their_mean_at_zero() -> None:
    block = replace(UNIT, interpolate=True)
    for e, ec in itertools.product(range(-6, 7), range(-6, 7)):
        row = e + 7 if e > 0 else e + 6
        expected = TABLE[row, ec + 6]
        if e == 0:
            expected = 0.5 * (TABLE[6, ec + 6] + TABLE[7, ec + 6])
        assert level(block, float(e), float(ec)) == pytest.approx(expected, abs=1e-14)


def test_interpolation_is_bilinear_and_continuous() -> None:
    block = replace(UNIT, interpolate=True)
    corners = [level(block, e, ec) for e in (2.0, 3.0) for ec in (-1.0, 0.0)]
    weights = [0.75 * 0.5, 0.75 * 0.5, 0.25 * 0.5, 0.25 * 0.5]
    assert level(block, 2.25, -0.5) == pytest.approx(np.dot(weights, corners), abs=1e-14)
    for x in ties():
        for y in (-3.2, 0.0, 0.7):
            for a, b in ((x, y), (y, x)):
                near = level(block, a + 1e-9, b)
                assert near == pytest.approx(level(block, a, b), abs=1e-7)


# On symbols


def all_points(block: QueryTable) -> tuple[list[tuple[float, float]], list[float]]:
    """Random states and errors, a first sample now and then, and ties in both inputs."""
    generator, states, errors = random.Random(5), [], []
    low, high = block.e_range
    for _ in range(10_000):
        e, rate = generator.uniform(1.2 * low, 1.2 * high), generator.uniform(-12.0, 12.0)
        states.append((e - rate * block.period, float(generator.random() < 0.05)))
        errors.append(e)
    unit = (high - low) / 12.0
    for e, ec in itertools.product(ties()[::2], ties()[::3]):
        error = unit * e + 0.5 * (low + high)
        states.append((error - ec * block.period, 0.0))
        errors.append(error)
    return states, errors


@pytest.mark.parametrize("name", BLOCKS)
def test_traced_to_the_bit(name: str) -> None:
    block = BLOCKS[name]
    states, errors = all_points(block)
    mapped = trace(block).map(len(errors))
    y, following = mapped(np.array(states).T, np.array(errors)[None, :], ca.DM(0, len(errors)))
    expected = [block.step(x, e) for x, e in zip(states, errors, strict=True)]
    assert np.array_equal(np.array(y).T, np.array([outputs for outputs, _ in expected]))
    assert np.array_equal(np.array(following).T, np.array([state for _, state in expected]))


# Parameters


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"e_range": (1.0, 1.0)}, "e_range must be a pair"),
        ({"period": 0.0}, "period"),
        ({"defuzzify": "bisector"}, "'centroid' or 'mean_of_maxima'"),
        ({"on_line": True, "interpolate": True}, "choose one"),
        ({"on_line": True, "table": STOP_RELATION.table()}, "leave out the table"),
        ({"table": STOP_RELATION.table()[:5]}, "14 rows of 13"),
        ({"table": ((math.nan,) * 13,) * 14}, "finite"),
        ({"relation": replace(STOP_RELATION, rows=STOP_RELATION.columns,
                              rules=STOP_RELATION.rules[:7])}, "14 and 13 levels"),
    ],
)  # fmt: skip
def test_wrong_parameters_are_refused(options, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        QueryTable(**options)


def test_parameters_can_be_changed_by_name() -> None:
    block: Block = QueryTable()
    changed = block.with_parameter("defuzzify", "mean_of_maxima")
    (_, found), _ = changed.step(changed.start(), 10.0)
    assert found == STOP_RELATION.table("mean_of_maxima")[13][6]
    own = tuple((float(row),) * 13 for row in range(14))
    (_, found), _ = QueryTable(table=own).step((0.0, 1.0), -0.1)
    assert found == 6.0
