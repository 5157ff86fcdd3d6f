"""The numbers of each run: distributions, sweeps, tables of points, or a function that draws."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...base.errors import listing, suggest
from .errors import CampaignError
from .work import RESERVED, Drawn

# A distribution is a frozen one of scipy.stats; anything with `ppf` will do.
Draws = (
    Mapping[str, Any]  # name -> distribution, or the values of a sweep
    | Sequence[Mapping[str, Any]]  # the points themselves
    | Callable[[np.random.Generator], Drawn]
)

SAMPLINGS = ("random", "latin_hypercube", "sobol")
_TINY = 2.0**-54  # keeps 0 and 1 out of unbounded distributions


@dataclass(frozen=True)
class Plan:
    """How many runs there are, and the numbers of each; `function` draws what is not known yet."""

    count: int
    points: Sequence[dict[str, Any]] | None
    function: Callable[[np.random.Generator], Drawn] | None = None

    def drawn(self, number: int) -> dict[str, Any] | None:
        """Return a run's numbers; None if they are drawn where it runs."""
        return None if self.points is None else self.points[number]


def generator_of(seed: int, number: int) -> np.random.Generator:
    """Return a run's own generator: NumPy's default one, seeded with [seed, number]."""
    return np.random.default_rng([seed, number])


def make_plan(draws: Draws, *, runs: int | None, seed: int, sampling: str) -> Plan:
    """Return the plan of all runs; raise CampaignError for draws that are none.

    The numbers of all runs are computed here, in one go and in one place, so that they have the
    same bits whichever worker gets them.
    """
    if sampling not in SAMPLINGS:
        hint = suggest(sampling, SAMPLINGS)
        raise CampaignError(f"no sampling '{sampling}'; there are: {listing(SAMPLINGS)}{hint}")
    if isinstance(draws, Mapping):
        _check_names(draws)
        return _of_mapping(draws, 1 if runs is None else runs, seed, sampling)
    if sampling != "random":
        raise CampaignError(f"sampling '{sampling}' needs draws by name, each a distribution")
    if callable(draws):
        return Plan(1 if runs is None else runs, None, draws)
    if not isinstance(draws, Sequence) or not all(isinstance(p, Mapping) for p in draws):
        raise CampaignError(
            "draws are a mapping of names to distributions or lists, a list of points, "
            f"or a function of a generator, not {draws!r}"
        )
    for point in draws:
        _check_names(point)
    points = [dict(point) for point in draws for _ in range(1 if runs is None else runs)]
    return Plan(len(points), points)


def _check_names(names: Mapping[str, Any]) -> None:
    for name in names:
        if name in RESERVED:
            raise CampaignError(f"'{name}' cannot be drawn: the table has a column of that name")


def _of_mapping(draws: Mapping[str, Any], runs: int, seed: int, sampling: str) -> Plan:
    """Every combination of the swept values, `runs` times; distributions are drawn for each."""
    sweeps = {name: _values(name, d) for name, d in draws.items() if _inverse(d) is None}
    inverses = {name: _inverse(d) for name, d in draws.items() if name not in sweeps}
    if sampling != "random" and not inverses:
        raise CampaignError(f"sampling '{sampling}' needs at least one distribution to draw from")
    count = runs * math.prod(len(values) for values in sweeps.values())
    shares = _shares(count, len(inverses), seed, sampling)
    columns = {
        name: _column(name, inverse, share)
        for (name, inverse), share in zip(inverses.items(), shares.T, strict=True)
    }
    points: list[dict[str, Any]] = []
    for combination in product(*sweeps.values()):
        swept = dict(zip(sweeps, combination, strict=True))
        for _ in range(runs):
            i = len(points)
            points.append({n: swept[n] if n in swept else columns[n][i] for n in draws})
    return Plan(count, points)


def _inverse(given: Any) -> Callable[[np.ndarray], Any] | None:
    """Return a distribution's inverse cumulative function; None for what is no distribution."""
    return getattr(given, "ppf", None) or getattr(given, "icdf", None)


def _values(name: str, given: Any) -> list[Any]:
    values = given.tolist() if isinstance(given, np.ndarray) else given
    if isinstance(values, str) or not isinstance(values, Sequence | range):
        raise CampaignError(
            f"'{name}' is drawn from a frozen distribution of scipy.stats, "
            f"or swept over a list of values; {given!r} is neither"
        )
    if len(values) == 0:
        raise CampaignError(f"'{name}' is swept over an empty list")
    return list(values)


def _shares(count: int, dimension: int, seed: int, sampling: str) -> np.ndarray:
    """Return points of the unit cube, one row a run."""
    # A stream beside those of the runs, which are seeded with [seed, number].
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
    if dimension == 0:
        return np.empty((count, 0))
    if sampling == "random":
        shares = generator.random((count, dimension))
    else:
        from scipy.stats import qmc

        if sampling == "latin_hypercube":
            shares = qmc.LatinHypercube(dimension, rng=generator).random(count)
        else:  # the sequence is balanced at powers of two: its first `count` points
            power = max(count - 1, 0).bit_length()
            shares = qmc.Sobol(dimension, rng=generator).random_base2(power)[:count]
    return np.clip(shares, _TINY, 1.0 - 2.0 * _TINY)


def _column(name: str, inverse: Any, shares: np.ndarray) -> list[Any]:
    values = np.asarray(inverse(shares))
    if values.shape != shares.shape or not np.all(np.isfinite(values)):
        raise CampaignError(f"the distribution of '{name}' gives no finite number for each run")
    # scipy's discrete distributions give whole numbers as floats.
    owner = getattr(getattr(inverse, "__self__", None), "dist", None)
    return (values.astype(np.int64) if hasattr(owner, "_pmf") else values).tolist()
