"""Random networks of FMUs, blocks and delays against an interpreter of what is documented."""

from typing import Any

import numpy as np
import pytest

from railcosim.cosim.algorithms import (
    GaussSeidel,
    Iterated,
    Jacobi,
    Newton,
    StepDoubling,
    TwoPhase,
)
from tests.coupled_diagrams import array, names, same
from tests.systems.network_interpreter import Interpreter, Scheme
from tests.systems.random_networks import COUNT, Maker, diagram

SOLVER = Newton(tolerance=1e-13)
FIRM = {
    "two_phase": lambda p, order: TwoPhase(extrapolation=p),
    "jacobi": lambda p, order: Jacobi(extrapolation=p),
    "gauss_seidel": lambda p, order: GaussSeidel(order=order, extrapolation=p),
    "iterated": lambda p, order: Iterated(solver=SOLVER, extrapolation=p),
}


def compare(seed: int, kind: str, p: int, *, events: bool, short: bool = False) -> None:
    maker = Maker(seed, events=events, slow=True, short=short)
    nodes = maker.network()
    fast = [i for i, node in enumerate(nodes) if node.is_fast]
    order = [int(i) for i in maker.rng.permutation(fast)]
    t0 = maker.h * int(maker.rng.choice([0, 0, 7, -9]))
    expected = Interpreter(nodes, maker.h, Scheme(kind, p, order), t0).run(COUNT)
    algorithm: Any = FIRM[kind](p, tuple(f"n{i}" for i in order))
    made = diagram(nodes, maker.h)
    found = made.run(t0 + COUNT * maker.h, start=t0, algorithm=algorithm)
    signals = [f"n{i}.{port}" for i in range(len(nodes)) for port in made.blocks[f"n{i}"].outputs]
    rows = np.column_stack([found[name] for name in signals])
    assert rows.shape == expected.shape
    size = max(1.0, float(np.abs(expected).max()))
    different = np.abs(rows - expected) > 1e-9 * size
    if different.any():
        k = int(np.argwhere(different.any(axis=1))[0, 0])
        which = [signals[j] for j in np.flatnonzero(different[k])]
        raise AssertionError(
            f"seed {seed}, {kind}, extrapolation {p}: first differing at tick {k} "
            f"(t = {float(k * maker.h):g}): {which}, by {np.abs(rows - expected)[k].max():.3g}"
        )
    assert array(found).shape == rows.shape


EVERY = [(kind, p) for kind in FIRM for p in (0, 1)]


@pytest.mark.parametrize(("kind", "p"), EVERY)
@pytest.mark.parametrize("seed", range(6))
def test_on_ticks(seed: int, kind: str, p: int) -> None:
    compare(seed, kind, p, events=False)


@pytest.mark.parametrize(("kind", "p"), EVERY)
@pytest.mark.parametrize("seed", range(100, 106))
def test_with_jumps_between_ticks(seed: int, kind: str, p: int) -> None:
    compare(seed, kind, p, events=True)


def same_everywhere(seed: int, algorithm: Any, stop_at: int) -> None:
    """Both engines, and a break at a tick, give the same bits."""
    maker = Maker(seed, events=True, slow=True)
    made, stop = diagram(maker.network(), maker.h), COUNT * maker.h
    whole = made.run(stop, algorithm=algorithm, engine="python")
    assert same(made.run(stop, algorithm=algorithm, engine="compiled"), whole), seed
    with made.simulation(algorithm=algorithm) as simulation:
        checkpoint = simulation.advance(stop_at * maker.h).checkpoint()
    rest = made.run(stop, algorithm=algorithm, resume=checkpoint)
    assert array(rest).tobytes() == array(whole)[stop_at:].tobytes(), seed


ALGORITHMS = [
    *(FIRM[kind](p, None) for kind, p in EVERY),
    StepDoubling(tolerance=1e-5),
    StepDoubling(inner=TwoPhase(), tolerance=1e-3),
]


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
@pytest.mark.parametrize("seed", [201, 202])
def test_engines_and_breaks(seed: int, algorithm: Any) -> None:
    same_everywhere(seed, algorithm, stop_at=(7 * seed) % COUNT)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_engines_and_breaks_of_many(algorithm: Any) -> None:
    for seed in range(2000, 2040):
        same_everywhere(seed, algorithm, stop_at=(7 * seed) % COUNT)


@pytest.mark.parametrize("seed", range(300, 306))
def test_step_size_control_comes_to_the_repeated_steps_solution(seed: int) -> None:
    """On ticks nothing jumps within a step: a tight tolerance gives the coupled solution."""
    maker = Maker(seed, events=False, slow=False)
    nodes = maker.network()
    made = diagram(nodes, maker.h)
    stop = COUNT * maker.h
    tight = made.run(stop, algorithm=StepDoubling(tolerance=1e-8))
    loose = made.run(stop, algorithm=StepDoubling(tolerance=1e-5))
    other = made.run(
        stop,
        algorithm=StepDoubling(inner=Iterated(solver=SOLVER, extrapolation=1), tolerance=1e-8),
    )
    size = max(1.0, float(np.abs(array(other)).max()))
    assert array(tight) == pytest.approx(array(other), abs=3e-6 * size)
    assert array(loose) == pytest.approx(array(other), abs=1e-3 * size)


@pytest.mark.parametrize(("kind", "p"), EVERY)
@pytest.mark.parametrize("seed", range(400, 404))
def test_with_delays_below_a_step(seed: int, kind: str, p: int) -> None:
    compare(seed, kind, p, events=seed % 2 == 1, short=True)


@pytest.mark.slow
@pytest.mark.parametrize("events", [False, True])
@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize(("kind", "p"), EVERY)
def test_many(kind: str, p: int, events: bool, short: bool) -> None:
    failures = []
    for seed in range(1000, 1100):
        try:
            compare(seed, kind, p, events=events, short=short)
        except AssertionError as error:
            failures.append(str(error))
    assert not failures, "\n".join(failures[:10])
