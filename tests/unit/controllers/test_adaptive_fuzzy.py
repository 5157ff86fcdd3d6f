"""The adaptive fuzzy controller: its tables as printed, its factors, its forms; traced, too."""

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import AdaptiveFuzzy
from railcosim.controllers.adaptive_rules import ADAPTIVE_RULES, GAMMA_RULES
from tests.tracing import largest_difference

# The tables as the paper's text prints them, line by line behind the row's label.
TABLE_1 = """NB NB NB NM NM NS NS ZO NM NB NM NM NS NS ZO PS NS NM NM NS NS ZO PS PS ZO NM NS NS ZO
PS PS PM PS NS NS ZO PS PS PM PM PM NS ZO PS PS PM PM PB PB ZO PS PS PM PM PB PB"""
TABLE_2 = """NB VB VB B M M M B NM VB VB B M M B B NS VB B B S M B VB ZO VB B M VS M B VB
PS VB B M M B B VB PM B B M M B VB VB PB B M M M B VB VB"""

FORMS = {
    "conventional": AdaptiveFuzzy.conventional(),
    "variable_universe": AdaptiveFuzzy.variable_universe(),
    "scaled": AdaptiveFuzzy.scaled(),
    "adaptive": AdaptiveFuzzy(),
    "absolute": AdaptiveFuzzy(base_gain=0.0, ku=30.0),
}


def test_the_tables_are_as_printed() -> None:
    for base, text in ((ADAPTIVE_RULES, TABLE_1), (GAMMA_RULES, TABLE_2)):
        words = text.split()
        printed = [words[i + 1 : i + 8] for i in range(0, 56, 8)]
        assert [[base.output.labels[k] for k in row] for row in base.rules] == printed


def test_ke_is_what_the_sheet_lists() -> None:
    block = AdaptiveFuzzy()
    listed = {0.0: 4.0, 0.25: 2.96, 0.5: 1.83, 1.0: 1.11, 2.0: 1.0}
    for e, ke in listed.items():
        assert block.factors(e, 1.0)[0] == pytest.approx(ke, abs=5e-3)
        assert block.factors(-e, 1.0)[0] == block.factors(e, 1.0)[0]
    for e in (3.5, 10.0, 300.0):
        assert block.factors(e, e)[0] * e == pytest.approx(3.0, abs=1e-15)
    # Continuous where the universe ends: 1/α(3) differs from 1 by 1e-8.
    assert abs(block.factors(3.0, 1.0)[0] - block.factors(3.0 + 1e-9, 1.0)[0]) < 2e-8


def test_kec_rises_near_the_target_and_after_overshoot() -> None:
    block = AdaptiveFuzzy()
    assert block.factors(1.0, 3.0)[1] == 4.0
    assert block.factors(0.29, 3.0)[1] == 5.0
    assert block.factors(0.3, 3.0)[1] == 4.0
    assert block.factors(-1.0, 3.0)[1] == 5.0
    assert AdaptiveFuzzy.scaled().factors(-1.0, 3.0) == (1.0, 4.0)


def test_overshoot_is_counted_from_the_references_last_change() -> None:
    block = AdaptiveFuzzy()
    x = block.start()
    kecs = []
    for reference, speed in ((7.0, 10.0), (7.0, 6.0), (5.0, 6.0), (5.0, 6.0), (5.0, 4.0)):
        y, x = block.step(x, reference, speed)
        kecs.append(y[2])
    assert kecs == [4.0, 5.0, 4.0, 4.0, 5.0]


def test_the_forms_leave_out_what_they_say() -> None:
    x = (0.4, 7.0, 2.0, 0.0)  # e was 0.4 m/s
    found = {name: block.step(x, 7.0, 6.5)[0] for name, block in FORMS.items()}
    assert found["conventional"][1:4] == (1.0, 4.0, 1.0)
    assert found["variable_universe"][1] > 1.8
    assert found["variable_universe"][3] == 1.0
    assert found["scaled"][1] == 1.0
    assert 0.0 < found["scaled"][3] < 1.0
    assert found["adaptive"][1] == found["variable_universe"][1]
    for _, _, _, gamma, scale in found.values():
        assert scale == pytest.approx(gamma * (30.0 if scale > 10.0 else 10.0))


def test_it_is_antisymmetric_but_for_table_2s_break() -> None:
    """u(−e, −ec) = −u(e, ec) without γ; with it wherever (NS, ZO) and (PS, ZO) do not apply."""
    generator = random.Random(8)
    for _ in range(500):
        e, before = generator.uniform(-4.0, 4.0), generator.uniform(-4.0, 4.0)
        for name in ("conventional", "variable_universe"):
            block = replace(FORMS[name], base_gain=0.0)
            u = [block.step((s * before, 0.0, s, 0.0), 0.0, -s * e)[0][0] for s in (1.0, -1.0)]
            assert u[0] == pytest.approx(-u[1], abs=1e-12)


def test_the_base_notch_holds_the_reference() -> None:
    y, _ = AdaptiveFuzzy().step((0.0, 7.0, 1.0, 0.0), 7.0, 7.0)
    assert y[0] == pytest.approx(7.0 / 2.2)


def test_wrong_parameters() -> None:
    for options, words in (
        ({"m": 1.0}, "m must lie in"),
        ({"k": -1.0}, "k must not be negative"),
        ({"small_error": -0.1}, "small_error must not be negative"),
        ({"ku": 0.0}, "ku must be a positive number"),
        ({"limits": (1.0, -1.0)}, "low < high"),
        ({"base_gain": math.nan}, "base_gain must be a finite number"),
    ):
        with pytest.raises(ParameterError, match=words):
            AdaptiveFuzzy(**options)  # pyright: ignore[reportArgumentType]


def state(generator: random.Random, reference: float) -> tuple[Any, ...]:
    last = generator.choice((reference, generator.uniform(-10.0, 10.0)))
    first = float(generator.random() < 0.1)
    return (generator.uniform(-4.0, 4.0), last, generator.uniform(-3.0, 3.0), first)


@pytest.mark.parametrize("name", FORMS)
def test_traced_at_random_points(name: str) -> None:
    generator = random.Random(12)
    states, inputs = [], []
    for _ in range(10_000):
        reference = generator.uniform(-10.0, 10.0)
        states.append(state(generator, reference))
        inputs.append((reference, reference - generator.uniform(-5.0, 5.0)))
    assert largest_difference(FORMS[name], states, inputs) <= 1e-12


@pytest.mark.parametrize("name", FORMS)
def test_traced_on_the_edges(name: str) -> None:
    """Errors at the bounds 0, 0.3 and 3, at set peaks, and rates at set peaks, each ± 1 ulp."""
    peaks = [k * 0.5 for k in range(-8, 9)] + [-0.3, 0.3]
    # e with Ke(e)·e on a set's peak, found by bisection of the factor itself.
    block = AdaptiveFuzzy()
    grid = np.linspace(0.0, 3.0, 3001)
    values = np.array([block.factors(float(e), 1.0)[0] * e for e in grid])
    peaks += [float(grid[np.argmin(np.abs(values - target))]) for target in (1.0, 2.0)]
    errors = [
        value
        for p in peaks
        for value in (p, math.nextafter(p, -math.inf), math.nextafter(p, math.inf))
    ]
    rates = [kec_ec / kec for kec_ec in range(-7, 8) for kec in (4.0, 5.0)]
    states, inputs = [], []
    for e in errors:
        for rate in rates:
            for at_change in (1.0, -1.0, 0.0):
                states.append((e - rate * 0.02, 0.0, at_change, 0.0))
                inputs.append((0.0, -e))
    assert len(states) > 5000
    assert largest_difference(FORMS[name], states, inputs) <= 1e-12
