"""Every rule base traced on symbols equals itself on floats: at random and on all edges."""

import itertools
import math
import random

import casadi as ca
import numpy as np
import pytest

from railcosim.controllers import Gaussians, Mamdani, Sugeno, Triangles
from railcosim.controllers.fuzzy import bisector, mean_of_maxima, outline_centroid
from railcosim.controllers.fuzzy.mamdani import Defuzzifier
from railcosim.controllers.fuzzy.sets import UniformSets
from railcosim.controllers.rules import FIVE, SEVEN, SIX, SPEED_RULES, SWITCHING_RULES
from railcosim.models.expressions import exact_expressions

SHAPES = {
    "triangles": (Triangles(-3.0, 3.0, SEVEN), Triangles(-0.6, 0.6, SEVEN)),
    "gaussians": (Gaussians(-3.0, 3.0, SEVEN), Gaussians(-0.6, 0.6, SEVEN, 0.07)),
    "mixed": (Gaussians(-3.0, 3.0, SEVEN), Triangles(-0.6, 0.6, SEVEN)),
}
OUTPUTS = {
    "triangles": Triangles(-10.0, 10.0, SEVEN),
    "gaussians": Gaussians(-10.0, 10.0, SEVEN),
    "narrow": Gaussians(-10.0, 10.0, SEVEN, 0.4),
}
DEFUZZIFIERS: tuple[Defuzzifier, ...] = ("centroid", "bisector", "mean_of_maxima", "sampled")
TOLERANCE = 1e-12


def mamdani(inputs: str, output: str, defuzzify: Defuzzifier) -> Mamdani:
    rows, columns = SHAPES[inputs]
    return Mamdani(rows, columns, OUTPUTS[output], SPEED_RULES.rules, defuzzify)


def edges(sets: UniformSets) -> list[float]:
    """Peaks, crossings of neighbours, ends and beyond, and one ulp either side of each."""
    found = []
    for k in range(2 * len(sets.labels) - 1):
        place = sets.low + 0.5 * k * sets.width
        found += [place, math.nextafter(place, -math.inf), math.nextafter(place, math.inf)]
    return [*found, sets.low - 1.0, sets.high + 1.0]


def largest_difference(base: Mamdani | Sugeno, points: list[tuple[float, float]]) -> float:
    with exact_expressions():
        row, column = ca.SX.sym("row"), ca.SX.sym("column")
        function = ca.Function("f", [row, column], [base(row, column)])
    a, b = np.array(points).T
    traced = np.array(function.map(len(points))(a[None, :], b[None, :])).ravel()
    return float(np.abs(traced - [base(*point) for point in points]).max())


def some_points(base: Mamdani | Sugeno, count: int) -> list[tuple[float, float]]:
    generator = random.Random(13)
    ends = [(1.1 * sets.low, 1.1 * sets.high) for sets in (base.rows, base.columns)]
    inside = [(generator.uniform(*ends[0]), generator.uniform(*ends[1])) for _ in range(count)]
    return [*inside, *itertools.product(edges(base.rows), edges(base.columns))]


@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("inputs", SHAPES)
def test_mamdani(inputs: str, output: str, defuzzify: Defuzzifier) -> None:
    base = mamdani(inputs, output, defuzzify)
    assert largest_difference(base, some_points(base, 10_000)) <= TOLERANCE


@pytest.mark.parametrize("conjunction", ["min", "prod"])
@pytest.mark.parametrize("shape", [Triangles, Gaussians])
def test_sugeno(shape: type, conjunction: str) -> None:
    rows, columns = shape(-1.0, 1.0, SIX), shape(-1.0, 1.0, FIVE)
    base = Sugeno(rows, columns, SWITCHING_RULES.rules, conjunction)  # pyright: ignore
    assert largest_difference(base, some_points(base, 10_000)) <= TOLERANCE


@pytest.mark.parametrize("output", OUTPUTS)
def test_heights_that_tie_or_vanish(output: str) -> None:
    """What no rule base need give: the defuzzifiers alone, on heights with ties and gaps."""
    sets, generator = OUTPUTS[output], random.Random(14)
    with exact_expressions():
        x = ca.SX.sym("x", 7)
        heights = ca.vertsplit(x)
        found = [f(sets, heights) for f in (outline_centroid, bisector, mean_of_maxima)]
        function = ca.Function("f", [x], found)
    choices = (0.0, 0.25, 0.5, math.nextafter(0.5, 1.0), math.nextafter(1.0, 0.0), 1.0)
    for _ in range(2000):
        values = [generator.choice((*choices, generator.random())) for _ in range(7)]
        values[generator.randrange(7)] = generator.choice(choices[1:])
        traced = [float(v) for v in function(values)]
        for a, f in zip(traced, (outline_centroid, bisector, mean_of_maxima), strict=True):
            assert a == pytest.approx(f(sets, values), abs=TOLERANCE), (f, values)


@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize("output", OUTPUTS)
def test_output_sets_that_no_rule_names(output: str, defuzzify: Defuzzifier) -> None:
    rows, columns = SHAPES["mixed"]
    rules = tuple(tuple(min(max(k, 1), 4) for k in row) for row in SPEED_RULES.rules)
    base = Mamdani(rows, columns, OUTPUTS[output], rules, defuzzify)
    assert largest_difference(base, some_points(base, 500)) <= TOLERANCE


@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize("output", OUTPUTS)
def test_a_constant_symbol_and_a_float_give_the_same(output: str, defuzzify: Defuzzifier) -> None:
    base = mamdani("mixed", output, defuzzify)
    found = float(ca.DM(base(ca.SX(0.7), ca.SX(0.2))))
    assert found == pytest.approx(base(0.7, 0.2), abs=TOLERANCE)
