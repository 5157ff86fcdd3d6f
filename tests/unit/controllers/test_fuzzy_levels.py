"""Fuzzy sets over levels, and the relation against max-min written out loop by loop."""

import csv
import random
from pathlib import Path

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import Levels, Relation
from railcosim.controllers.fuzzy import write_table
from railcosim.controllers.stop_rules import E_LEVELS, EC_LEVELS, STOP_RELATION, U_LEVELS

# The sheet's memberships and rules, typed anew: degrees from the lowest level to the highest.
E_POSITIVE = {
    "PO": [0, 0, 0, 0, 0, 0, 0, 1, 0.6, 0.1, 0, 0, 0, 0],
    "PS": [0, 0, 0, 0, 0, 0, 0, 0.3, 0.8, 1, 0.5, 0.1, 0, 0],
    "PM": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0.2, 0.7, 1, 0.7, 0.2],
    "PL": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0.4, 0.8, 1],
}
EC_POSITIVE = {
    "PS": [0, 0, 0, 0, 0, 0, 0, 0.9, 1, 0.7, 0.2, 0, 0],
    "PM": [0, 0, 0, 0, 0, 0, 0, 0, 0.2, 0.7, 1, 0.7, 0.2],
    "PL": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0.4, 0.8, 1],
}
E_SETS = [row[::-1] for row in list(E_POSITIVE.values())[::-1]] + list(E_POSITIVE.values())
EC_ZERO = [0, 0, 0, 0, 0, 0.5, 1, 0.5, 0, 0, 0, 0, 0]
EC_SETS = [row[::-1] for row in list(EC_POSITIVE.values())[::-1]]
EC_SETS += [EC_ZERO, *EC_POSITIVE.values()]
U_SETS = [[max(0.0, 1.0 - abs(u - peak) / 2) for u in range(-6, 7)] for peak in range(-6, 7, 2)]
RULES = [
    [-3, -3, -3, -3, -2, -1, 0], [-3, -3, -3, -2, -2, 0, 0], [-3, -3, -2, -1, 0, 1, 2],
    [-2, -2, -1, 0, 0, 1, 2], [-2, -1, 0, 0, 1, 2, 2], [-2, -1, 0, 1, 2, 3, 3],
    [0, 0, 2, 2, 3, 3, 3], [0, 1, 2, 3, 3, 3, 3],
]  # fmt: skip


def relation_by_loops() -> list[list[list[float]]]:
    return [
        [
            [
                max(
                    min(E_SETS[i][e], EC_SETS[j][ec], U_SETS[RULES[i][j] + 3][u])
                    for i in range(8)
                    for j in range(7)
                )
                for u in range(13)
            ]
            for ec in range(13)
        ]
        for e in range(14)
    ]


def test_the_memberships_are_those_of_the_sheet() -> None:
    for levels, sets in ((E_LEVELS, E_SETS), (EC_LEVELS, EC_SETS), (U_LEVELS, U_SETS)):
        assert [list(row) for row in levels.memberships] == sets
    assert E_LEVELS.names[5:9] == ("-1", "-0", "+0", "+1")
    assert EC_LEVELS.names[5:8] == ("-1", "0", "+1")


def test_the_relation_is_max_min_loop_by_loop() -> None:
    assert STOP_RELATION.array.shape == (14, 13, 13)
    assert STOP_RELATION.array.tolist() == relation_by_loops()


def test_the_composition_of_fuzzy_inputs_loop_by_loop() -> None:
    relation, generator = relation_by_loops(), random.Random(3)
    for _ in range(20):
        e = [generator.choice([0.0, generator.random()]) for _ in range(14)]
        ec = [generator.choice([0.0, generator.random()]) for _ in range(13)]
        expected = [
            max(min(e[i], ec[j], relation[i][j][u]) for i in range(14) for j in range(13))
            for u in range(13)
        ]
        assert STOP_RELATION.compose(e, ec) == expected


def test_every_cell_fires() -> None:
    least = min(max(degrees) for plane in relation_by_loops() for degrees in plane)
    assert STOP_RELATION.array.max(axis=2).min() == least == 0.7


def test_the_tables_by_their_definitions() -> None:
    centroids, maxima = STOP_RELATION.table(), STOP_RELATION.table("mean_of_maxima")
    levels = np.arange(-6.0, 7.0)
    for e, plane in enumerate(relation_by_loops()):
        for ec, degrees in enumerate(np.array(plane)):
            centre = (degrees * levels).sum() / degrees.sum()
            assert centroids[e][ec] == pytest.approx(centre, abs=1e-14)
            middle = levels[degrees == degrees.max()].mean()
            assert maxima[e][ec] == pytest.approx(middle, abs=1e-14)


@pytest.mark.parametrize("how", ["centroid", "mean_of_maxima"])
def test_the_tables_are_antisymmetric_to_the_bit(how) -> None:
    table = np.array(STOP_RELATION.table(how))
    assert (table == -table[::-1, ::-1]).all()


def test_monotone_with_the_mean_of_maxima_and_not_with_the_centroid() -> None:
    maxima = np.array(STOP_RELATION.table("mean_of_maxima"))
    assert (np.diff(maxima, axis=0) >= 0).all()
    assert (np.diff(maxima, axis=1) >= 0).all()
    centroids = np.array(STOP_RELATION.table())
    assert (np.diff(centroids, axis=0) < 0).any()
    assert (np.diff(centroids, axis=1) < 0).any()


def test_the_table_as_a_file(tmp_path: Path) -> None:
    table = STOP_RELATION.table()
    path = write_table(tmp_path / "table.csv", table, E_LEVELS, EC_LEVELS)
    with path.open(encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    assert head == ["", *[f"{k:+d}" if k else "0" for k in range(-6, 7)]]
    assert [row[0] for row in rows][5:9] == ["-1", "-0", "+0", "+1"]
    assert tuple(tuple(float(cell) for cell in row[1:]) for row in rows) == table
    with pytest.raises(ParameterError, match="14 rows of 13"):
        write_table(tmp_path / "wrong.csv", table[:3], E_LEVELS, EC_LEVELS)


TWO = {"low": {"a": 1.0}, "high": {"b": 1.0}}
PLACES = {"a": 0.0, "b": 1.0}


@pytest.mark.parametrize(
    ("sets", "levels", "words"),
    [
        ({"low": {"a": 1.0}}, PLACES, "level b belongs to no set"),
        ({"low": {"a": 1.0, "c": 1.0}}, PLACES, "no level 'c'"),
        ({"low": {"a": 1.5, "b": 1.0}}, PLACES, "from 0 to 1"),
        ({"low": {"a": 1.0, "b": 1.0}, "high": {}}, PLACES, "'high' applies nowhere"),
        (TWO, {"a": 1.0, "b": 0.0}, "rising order"),
        (TWO, {"a": 0.0, "b": float("inf")}, "finite"),
    ],
)
def test_wrong_levels_are_refused(sets, levels, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Levels.of(sets, levels)


def test_wrong_relations_are_refused() -> None:
    two = Levels.of(TWO, PLACES)
    with pytest.raises(ParameterError, match="2 rows of 2"):
        Relation(rows=two, columns=two, output=two, rules=((0, 1),))
    with pytest.raises(ParameterError, match="does not exist"):
        Relation(rows=two, columns=two, output=two, rules=((0, 1), (1, 2)))
    good = Relation(rows=two, columns=two, output=two, rules=((0, 1), (1, 1)))
    assert good.table() == ((0.0, 1.0), (1.0, 1.0))
    with pytest.raises(ParameterError, match="needs 2 degrees"):
        good.compose([1.0], [0.0, 1.0])
    with pytest.raises(ParameterError, match="places go from 0 to 1"):
        good.infer(2, 0)
    with pytest.raises(ParameterError, match="'centroid' or 'mean_of_maxima'"):
        good.table("mean")  # type: ignore[arg-type]  # pyright: ignore
