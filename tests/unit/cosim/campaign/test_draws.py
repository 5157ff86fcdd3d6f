"""Draws: the distributions they come from, seeds, sweeps, and what is no draw."""

import numpy as np
import pytest
from scipy import stats

from railcosim.cosim.campaign import Campaign, CampaignError
from railcosim.cosim.campaign.draws import generator_of, make_plan

DRAWS = {
    "a.b": stats.norm(3.0, 0.5),
    "c": stats.uniform(-1.0, 4.0),
    "d": stats.weibull_min(1.7, scale=2.0),
}


def columns(sampling: str, runs: int = 1000, seed: int = 5) -> dict[str, np.ndarray]:
    plan = make_plan(DRAWS, runs=runs, seed=seed, sampling=sampling)
    points = [plan.drawn(n) or {} for n in range(plan.count)]
    return {name: np.array([point[name] for point in points]) for name in DRAWS}


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_marginals_and_independence(sampling: str) -> None:
    found = columns(sampling)
    for name, values in found.items():
        assert stats.kstest(values, DRAWS[name].cdf).pvalue > 0.01, name
    assert np.abs(np.corrcoef(list(found.values())) - np.eye(3)).max() < 0.08


def test_a_latin_hypercube_has_one_run_in_each_layer() -> None:
    for name, values in columns("latin_hypercube", runs=100).items():
        layers = np.floor(100 * DRAWS[name].cdf(values))
        assert sorted(layers) == list(range(100))


def test_sobol_is_nearer_than_chance_for_any_number_of_runs() -> None:
    def distance(sampling: str) -> float:
        return stats.kstest(columns(sampling, runs=700)["c"], DRAWS["c"].cdf).statistic

    assert distance("sobol") < 0.3 * distance("random")


def test_seeds() -> None:
    one, same, other = (columns("random", seed=s)["c"] for s in (5, 5, 6))
    assert one.tobytes() == same.tobytes()
    assert not set(one) & set(other)
    streams = [generator_of(5, n).random(4) for n in range(200)]
    assert len(set(np.concatenate(streams))) == 800
    assert streams[7].tolist() == np.random.default_rng([5, 7]).random(4).tolist()


def test_sweeps_take_every_combination() -> None:
    plan = make_plan(
        {"a": [1, 2], "b": ("x", "y"), "c": DRAWS["c"]}, runs=3, seed=0, sampling="random"
    )
    points = plan.points or []
    assert plan.count == 12
    assert [(p["a"], p["b"]) for p in points[::3]] == [(1, "x"), (1, "y"), (2, "x"), (2, "y")]
    assert len({p["c"] for p in points}) == 12
    assert list(points[0]) == ["a", "b", "c"]
    assert make_plan({}, runs=4, seed=0, sampling="random").count == 4


def test_points_and_whole_numbers() -> None:
    points = [{"a": 1, "b": 2}, {"a": 3, "b": 4}]
    assert make_plan(points, runs=None, seed=0, sampling="random").points == points
    dice = make_plan({"n": stats.randint(1, 7)}, runs=200, seed=0, sampling="sobol").points or []
    assert {p["n"] for p in dice} == {1, 2, 3, 4, 5, 6}
    assert all(isinstance(p["n"], int) for p in dice)


@pytest.mark.parametrize(
    ("draws", "sampling", "words"),
    [
        ({"a": 3.0}, "random", "'a' is drawn from a frozen distribution"),
        ({"a": []}, "random", "'a' is swept over an empty list"),
        ({"a": [1.0]}, "sobol", "needs at least one distribution"),
        ({"a": stats.uniform()}, "sobbol", "did you mean 'sobol'"),
        ({"a": stats.uniform(np.nan, 1.0)}, "random", "'a' gives no finite number"),
        ({"seed": [1.0]}, "random", "'seed' cannot be drawn"),
        ([{"run": 1}], "random", "'run' cannot be drawn"),
        ([1.0, 2.0], "random", "draws are a mapping"),
        (lambda generator: {}, "latin_hypercube", "needs draws by name"),
    ],
)
def test_what_is_no_draw(draws: object, sampling: str, words: str) -> None:
    with pytest.raises(CampaignError, match=words):
        make_plan(draws, runs=8, seed=0, sampling=sampling)  # type: ignore[arg-type]  # pyright: ignore


@pytest.mark.parametrize(
    "options", [{"runs": 0}, {"seed": -1}, {"timeout": 0.0}, {"traces": "all"}, {"work": 3}]
)
def test_what_is_no_campaign(options: dict) -> None:
    with pytest.raises(CampaignError, match=f"campaign 'c': {next(iter(options))} is"):
        Campaign(**({"name": "c", "work": print} | options))
