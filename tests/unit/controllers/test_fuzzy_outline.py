"""Centroid, bisector and mean of maxima against brute force over a million points, and by hand."""

import math
import random
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.fuzzy import (
    Gaussians,
    Triangles,
    bisector,
    centroid,
    mean_of_maxima,
    outline_centroid,
    sampled_centroid,
)
from railcosim.controllers.fuzzy.sets import UniformSets

SEVEN = tuple("abcdefg")
THREE = tuple("abc")
SETS: dict[str, UniformSets] = {
    "triangles": Triangles(-6.0, 6.0, SEVEN),
    "triangles 0 to 3": Triangles(0.0, 3.0, ("a", "b", "c", "d")),
    "gaussians": Gaussians(-6.0, 6.0, SEVEN),
    "heavy haul": Gaussians(-6.0, 6.0, SEVEN, 0.85),
    "narrow": Gaussians(-6.0, 6.0, SEVEN, 0.3),
    "wide": Gaussians(0.0, 1.0, THREE, 2.0),
}
SAMPLES = 1_000_000
EXACT: tuple[Callable[..., float], ...] = (outline_centroid, bisector, mean_of_maxima)


def degrees(sets: UniformSets, y: np.ndarray) -> np.ndarray:
    """Membership by its definition: a row for each set."""
    peaks = np.linspace(sets.low, sets.high, len(sets.labels))
    width, x = peaks[1] - peaks[0], y[None, :] - peaks[:, None]
    if isinstance(sets, Triangles):
        return np.maximum(0.0, 1.0 - np.abs(x) / width)
    assert isinstance(sets, Gaussians)
    # Neighbours cross at one half: exp(−(width/2)²/(2σ²)) = 1/2
    sigma = sets.sigma or math.sqrt((width / 2) ** 2 / (2 * math.log(2)))
    return np.exp(-(x**2) / (2 * sigma**2))


def brute_force(sets: UniformSets, heights: Sequence[float]) -> tuple[float, float, float]:
    """Centroid, bisector and mean of maxima from the midpoints of a million cells."""
    edges = np.linspace(sets.low, sets.high, SAMPLES + 1)
    y = 0.5 * (edges[1:] + edges[:-1])
    outline = np.max(np.minimum(degrees(sets, y), np.asarray(heights)[:, None]), axis=0)
    area = np.concatenate([[0.0], np.cumsum(outline)])
    half = float(np.interp(0.5 * area[-1], area, edges))
    # An interval is highest where its middle is; its ends lie half a cell beyond on average.
    highest = outline >= max(heights) * (1.0 - 1e-15)
    top = float(y[highest].mean()) if highest.any() else math.nan
    return float((y * outline).sum() / outline.sum()), half, top


def random_heights(generator: random.Random, count: int) -> list[float]:
    """Heights of a kind drawn at random: any, with ties, with gaps, one alone, tiny, full."""
    kind = generator.randrange(6)
    if kind == 1:
        return [generator.choice([0.2, 0.6, 0.6, 1.0]) for _ in range(count)]
    if kind == 2:
        heights = [generator.random() if generator.random() < 0.5 else 0.0 for _ in range(count)]
        return heights if any(heights) else random_heights(generator, count)
    if kind == 3:
        alone = generator.randrange(count)
        return [generator.random() if k == alone else 0.0 for k in range(count)]
    scale = {4: 1e-3, 5: 1e-5}.get(kind, 1.0)
    return [scale * generator.random() for _ in range(count)]


@pytest.mark.parametrize("name", SETS)
def test_centroid_and_bisector_are_those_of_a_million_points(name: str) -> None:
    sets, generator = SETS[name], random.Random(7)
    for _ in range(12):
        heights = random_heights(generator, len(sets.labels))
        middle, half, _ = brute_force(sets, heights)
        assert outline_centroid(sets, heights) == pytest.approx(middle, abs=1e-6), heights
        assert bisector(sets, heights) == pytest.approx(half, abs=1e-6), heights


@pytest.mark.parametrize("name", SETS)
def test_the_mean_of_maxima_is_that_of_a_million_points(name: str) -> None:
    """Each plateau's length is known to a cell (1e-6 of the universe), hence the bound."""
    sets, generator = SETS[name], random.Random(8)
    span, count = sets.high - sets.low, len(sets.labels)
    cell = span / SAMPLES
    compared = 0
    while compared < 12:
        heights = [
            generator.choice([0.1, 0.3, 0.55, 0.8, generator.random()]) for _ in range(count)
        ]
        found = brute_force(sets, heights)[2]
        if math.isnan(found):  # a plateau shorter than a cell
            continue
        compared += 1
        bound = cell
        if heights.count(max(heights)) > 1:  # the plateaus' weights are known to a cell each
            bound += 2.0 * count * cell * span / _plateau(sets, max(heights))
        assert mean_of_maxima(sets, heights) == pytest.approx(found, abs=bound), heights


def _plateau(sets: UniformSets, height: float) -> float:
    """Half the length of a set's plateau, from its definition."""
    width = (sets.high - sets.low) / (len(sets.labels) - 1)
    if isinstance(sets, Triangles):
        return width * (1.0 - height)
    assert isinstance(sets, Gaussians)
    sigma = sets.sigma or width / 2.0 / math.sqrt(2.0 * math.log(2.0))
    return min(sigma * math.sqrt(-2.0 * math.log(height)), sets.high - sets.low)


@pytest.mark.parametrize("name", SETS)
def test_mirrored_heights_give_the_mirrored_result(name: str) -> None:
    sets, generator = SETS[name], random.Random(9)
    centre, span = 0.5 * (sets.low + sets.high), sets.high - sets.low
    for _ in range(500):
        heights = random_heights(generator, len(sets.labels))
        for defuzzify in EXACT:
            offset = defuzzify(sets, heights) - centre
            mirrored = defuzzify(sets, heights[::-1]) - centre
            assert offset == pytest.approx(-mirrored, abs=1e-14 * span), (defuzzify, heights)


@pytest.mark.parametrize("name", SETS)
def test_symmetric_heights_give_the_middle(name: str) -> None:
    sets, generator = SETS[name], random.Random(10)
    for _ in range(200):
        heights = random_heights(generator, len(sets.labels))
        heights = [max(pair) for pair in zip(heights, heights[::-1], strict=True)]
        for defuzzify in EXACT:
            middle = pytest.approx(0.5 * (sets.low + sets.high), abs=1e-14)
            assert defuzzify(sets, heights) == middle, (defuzzify, heights)


def test_the_closed_form_of_triangles_is_that_of_the_outline() -> None:
    generator = random.Random(11)
    for name in ("triangles", "triangles 0 to 3"):
        sets = SETS[name]
        assert isinstance(sets, Triangles)
        for _ in range(500):
            heights = random_heights(generator, len(sets.labels))
            expected = pytest.approx(outline_centroid(sets, heights), abs=1e-12)
            assert centroid(sets, heights) == expected, heights


# By hand

UNIT = Triangles(0.0, 2.0, THREE)


def test_one_full_end_triangle() -> None:
    """A right triangle with legs 1: a third from its upright side; the bisector at 1 − 1/√2."""
    heights = [1.0, 0.0, 0.0]
    assert outline_centroid(UNIT, heights) == pytest.approx(1.0 / 3.0, abs=1e-15)
    assert bisector(UNIT, heights) == pytest.approx(1.0 - math.sqrt(0.5), abs=1e-15)
    assert mean_of_maxima(UNIT, heights) == 0.0


def test_one_end_triangle_clipped_at_one_half() -> None:
    """Plateau 0 to 1/2 of area 1/4 at 1/4, flank of area 1/8 at 2/3: half of 3/8 lies at 3/8."""
    heights = [0.5, 0.0, 0.0]
    assert bisector(UNIT, heights) == pytest.approx(0.375, abs=1e-15)
    assert mean_of_maxima(UNIT, heights) == pytest.approx(0.25, abs=1e-15)
    assert outline_centroid(UNIT, heights) == pytest.approx(7.0 / 18.0, abs=1e-15)


def test_a_flank_holds_the_half() -> None:
    """Up to x = 3/4 the outline is 1 − x, then 1/4 until 7/4, then 2 − x: 15/32 + 8/32 + 1/32.

    Half of 3/4 is where x − x²/2 = 3/8, at x = 1/2.
    """
    assert bisector(UNIT, [1.0, 0.25, 0.0]) == pytest.approx(0.5, abs=1e-15)


def test_one_full_gaussian_at_an_end() -> None:
    """Half a normal distribution: mean σ √(2/π), median at the quartile .6744897501960817 σ."""
    sets = Gaussians(0.0, 100.0, THREE, 2.0)
    heights = [1.0, 0.0, 0.0]
    assert outline_centroid(sets, heights) == pytest.approx(2 * math.sqrt(2 / math.pi), abs=1e-12)
    assert bisector(sets, heights) == pytest.approx(2 * 0.6744897501960817, abs=1e-12)
    assert mean_of_maxima(sets, heights) == 0.0


def test_a_gap_with_half_the_area_on_either_side_gives_its_middle() -> None:
    """Two half triangles at the ends of [0, 3]: nothing between 1 and 2."""
    sets = Triangles(0.0, 3.0, ("a", "b", "c", "d"))
    assert bisector(sets, [1.0, 0.0, 0.0, 1.0]) == pytest.approx(1.5, abs=1e-15)


def test_plateaus_of_one_height_count_by_length() -> None:
    """At 0.8: [0, .2] of a and [1.8, 2.2] of c, so (.2·.1 + .4·2)/.6."""
    sets = Triangles(0.0, 4.0, tuple("abcde"))
    found = mean_of_maxima(sets, [0.8, 0.1, 0.8, 0.2, 0.0])
    assert found == pytest.approx((0.2 * 0.1 + 0.4 * 2.0) / 0.6, abs=1e-15)
    # Points have no length and count alike.
    assert mean_of_maxima(sets, [1.0, 0.1, 0.2, 1.0, 0.0]) == 1.5


def test_plateaus_that_overlap_count_once() -> None:
    """At 0.3 a reaches to .7 and b from .3 to 1.7: together [0, 1.7]."""
    assert mean_of_maxima(UNIT, [0.3, 0.3, 0.1]) == pytest.approx(0.85, abs=1e-15)


def test_sampling_of_gaussians_is_the_definition_with_101_points() -> None:
    sets, heights = SETS["heavy haul"], [0.0, 0.3, 0.7, 0.1, 0.0, 0.9, 0.2]
    y = np.linspace(-6.0, 6.0, 101)
    outline = np.max(np.minimum(degrees(sets, y), np.array(heights)[:, None]), axis=0)
    expected = float(np.sum(y * outline) / np.sum(outline))
    assert sampled_centroid(sets, heights) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("defuzzify", [outline_centroid, bisector])
@pytest.mark.parametrize("name", ["triangles", "gaussians"])
def test_nothing_to_defuzzify(name: str, defuzzify: Callable[..., float]) -> None:
    with pytest.raises(ZeroDivisionError):
        defuzzify(SETS[name], [0.0] * 7)


def test_the_sets_degrees() -> None:
    sets = Gaussians(-6.0, 6.0, SEVEN)
    assert sets.degrees(sets.position(0.0))[3] == 1.0
    assert sets.degrees(sets.position(1.0))[3] == pytest.approx(0.5, abs=1e-15)
    assert sets.degrees(sets.position(99.0))[6] == 1.0  # clipped to the universe
    narrow = Gaussians(-6.0, 6.0, SEVEN, 0.85)
    assert narrow.degrees(narrow.position(2.85))[4] == pytest.approx(math.exp(-0.5), abs=1e-15)


@pytest.mark.parametrize("sigma", [0.0, -1.0, math.nan, math.inf, "1", 1e-9])
def test_a_wrong_sigma_is_refused(sigma: float) -> None:
    with pytest.raises(ParameterError, match="sigma"):
        Gaussians(0.0, 1.0, THREE, sigma)
