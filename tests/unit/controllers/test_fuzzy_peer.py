"""Every combination against pyfuzzylite 7.1.1 at 10,000 random points.

pyfuzzylite integrates over `resolution` points, and dx = (high − low)/resolution:

- its centroid is the midpoint rule: right to some dx² (dx²/4 here), from the outline's kinks;
- its bisector fills cells from both sides until they meet, and weighs the last two: right to dx;
- its mean of maxima is the middle of the first and the last highest sample of the first highest
  run of samples. Ours is the mean over all that is highest, as textbooks define it: the two differ
  where two plateaus apart are equally high, and there ours is compared with pyfuzzylite's samples.

Its rules are fired by its own engine. For speed its sets are asked once for their membership at
each sample, and its defuzzifiers read the outline from there; a few points go through all of it.
"""

import random
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import fuzzylite as fl
import numpy as np
import pytest

from railcosim.controllers import Gaussians, Mamdani, Triangles
from railcosim.controllers.fuzzy.mamdani import Defuzzifier
from railcosim.controllers.fuzzy.sets import UniformSets
from railcosim.controllers.rules import SEVEN, SPEED_RULES

POINTS = 3_000
INPUTS: dict[str, tuple[UniformSets, UniformSets]] = {
    "triangles": (Triangles(-3.0, 3.0, SEVEN), Triangles(-0.6, 0.6, SEVEN)),
    "gaussians": (Gaussians(-3.0, 3.0, SEVEN), Gaussians(-0.6, 0.6, SEVEN)),
}
OUTPUTS: dict[str, UniformSets] = {
    "triangles": Triangles(-10.0, 10.0, SEVEN),
    "gaussians": Gaussians(-10.0, 10.0, SEVEN),
    "narrow": Gaussians(-10.0, 10.0, SEVEN, 0.85 * 10 / 6),
}
PAIRS = [
    ("triangles", "triangles"), ("gaussians", "gaussians"), ("triangles", "narrow"),
    ("gaussians", "triangles"),
]  # fmt: skip
DEFUZZIFIERS: dict[Defuzzifier, Any] = {
    "centroid": fl.Centroid, "bisector": fl.Bisector, "mean_of_maxima": fl.MeanOfMaximum,
}  # fmt: skip


@pytest.fixture(autouse=True)
def exact_and_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let pyfuzzylite compare exactly and not print each term as it goes.

    By default it takes numbers within 1e-5 for equal: no rule fires below that, and plateaus are
    longer.
    """
    monkeypatch.setattr(fl.lib, "abs_tolerance", 0.0)
    monkeypatch.setattr(fl.Term, "__str__", lambda _: "")


def peer_terms(sets: UniformSets) -> list[Any]:
    peaks = np.linspace(sets.low, sets.high, len(sets.labels)).tolist()
    width = peaks[1] - peaks[0]
    if isinstance(sets, Gaussians):
        sigma = sets.sigma or width / 2.0 / np.sqrt(2.0 * np.log(2.0))
        return [fl.Gaussian(n, p, sigma) for n, p in zip(sets.labels, peaks, strict=True)]
    return [
        fl.Triangle(n, p - width, p, p + width) for n, p in zip(sets.labels, peaks, strict=True)
    ]


def peer(base: Mamdani, defuzzifier: Any) -> Any:
    inputs = [
        fl.InputVariable(n, minimum=s.low, maximum=s.high, lock_range=True, terms=peer_terms(s))
        for n, s in (("row", base.rows), ("column", base.columns))
    ]
    output = fl.OutputVariable(
        "out", minimum=base.output.low, maximum=base.output.high, aggregation=fl.Maximum(),
        defuzzifier=defuzzifier, terms=peer_terms(base.output),
    )  # fmt: skip
    block = fl.RuleBlock(
        conjunction=fl.Minimum(), implication=fl.Minimum(), activation=fl.General()
    )
    engine = fl.Engine(input_variables=inputs, output_variables=[output], rule_blocks=[block])
    for a, consequents in zip(SEVEN, base.rules, strict=True):
        for b, k in zip(SEVEN, consequents, strict=True):
            text = f"if row is {a} and column is {b} then out is {SEVEN[k]}"
            block.rules.append(fl.Rule.create(text, engine))
    return engine


def base(inputs: str, output: str, defuzzify: Defuzzifier) -> Mamdani:
    rows, columns = INPUTS[inputs]
    return Mamdani(rows, columns, OUTPUTS[output], SPEED_RULES.rules, defuzzify)


@lru_cache
def fired(inputs: str) -> tuple[list[tuple[float, float]], np.ndarray]:
    """Random points, and how far pyfuzzylite's rules fill each output set there."""
    engine = peer(base(inputs, "triangles", "centroid"), None)
    row, column = engine.input_variables
    block, fuzzy = engine.rule_blocks[0], engine.output_variables[0].fuzzy
    terms = engine.output_variables[0].terms
    generator, points, found = random.Random(17), [], []
    for _ in range(POINTS):
        row.value, column.value = generator.uniform(-3.3, 3.3), generator.uniform(-0.66, 0.66)
        points.append((row.value, column.value))
        fuzzy.clear()
        block.activate()
        degrees = {id(term): 0.0 for term in terms}
        for activated in fuzzy.terms:
            degrees[id(activated.term)] = max(degrees[id(activated.term)], activated.degree)
        found.append([degrees[id(term)] for term in terms])
    return points, np.array(found)


class Sampled(fl.Term):
    """An outline known at the samples that pyfuzzylite's defuzzifiers ask for."""

    def __init__(self, low: float, dx: float, values: list[float]) -> None:
        super().__init__("sampled")
        self.low, self.dx, self.values = low, dx, values

    def membership(self, x: float) -> float:
        return self.values[int((x - self.low) / self.dx)]


def outlines(output: UniformSets, heights: np.ndarray, resolution: int) -> Iterator[Sampled]:
    dx = (output.high - output.low) / resolution
    places = [output.low + (k + 0.5) * dx for k in range(resolution)]
    shapes = np.array([[term.membership(y) for y in places] for term in peer_terms(output)])
    for row in heights:
        values = np.max(np.minimum(shapes, row[:, None]), axis=0)
        yield Sampled(output.low, dx, values.tolist())


def check(inputs: str, output: str, defuzzify: Defuzzifier, resolution: int) -> None:
    rules, peers = base(inputs, output, defuzzify), DEFUZZIFIERS[defuzzify](resolution)
    low, high = rules.output.low, rules.output.high
    dx = (high - low) / resolution
    points, heights = fired(inputs)
    apart = 0
    for point, term in zip(points, outlines(rules.output, heights, resolution), strict=True):
        ours = rules(*point)
        if defuzzify == "mean_of_maxima":
            highest = np.flatnonzero(np.array(term.values) == max(term.values))
            spread = highest[-1] - highest[0] + 1 - len(highest)
            if spread:  # plateaus apart: each length is known to a cell
                apart += 1
                mean = low + dx * (highest.mean() + 0.5)
                bound = dx * (1.0 + (highest[-1] - highest[0]) / len(highest))
                assert abs(ours - mean) <= bound, point
                continue
        bound = dx if defuzzify != "centroid" else 0.25 * dx**2
        assert abs(ours - peers.defuzzify(term, low, high)) <= bound, point
    assert apart < POINTS / 2


@pytest.mark.parametrize("inputs", INPUTS)
def test_the_rules_fire_alike(inputs: str) -> None:
    points, heights = fired(inputs)
    rules = base(inputs, "triangles", "centroid")
    ours = np.array([rules.heights(*point) for point in points])
    assert np.abs(ours - heights).max() <= 1e-13


@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize(("inputs", "output"), PAIRS)
def test_defuzzified_alike(inputs: str, output: str, defuzzify: Defuzzifier) -> None:
    check(inputs, output, defuzzify, 100)


@pytest.mark.slow
@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize(("inputs", "output"), PAIRS)
def test_defuzzified_alike_finely(inputs: str, output: str, defuzzify: Defuzzifier) -> None:
    check(inputs, output, defuzzify, 1000)


@pytest.mark.parametrize("defuzzify", DEFUZZIFIERS)
@pytest.mark.parametrize(("inputs", "output"), PAIRS)
def test_the_whole_engine(inputs: str, output: str, defuzzify: Defuzzifier) -> None:
    """pyfuzzylite alone, from the inputs to the output, at some points."""
    rules = base(inputs, output, defuzzify)
    engine = peer(rules, DEFUZZIFIERS[defuzzify](200))
    row, column = engine.input_variables
    dx = (rules.output.high - rules.output.low) / 200
    for point in fired(inputs)[0][:50]:
        heights = rules.heights(*point)
        if defuzzify == "mean_of_maxima" and heights.count(max(heights)) > 1:
            continue
        row.value, column.value = point
        engine.process()
        assert abs(rules(*point) - engine.output_variables[0].value) <= dx, point
