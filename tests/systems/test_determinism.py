"""The same diagram gives the same bits: twice, elsewhere, isolated, compiled, in pieces."""

from pathlib import Path

import pytest

from railcosim import Diagram, Run
from railcosim.cosim.algorithms import GaussSeidel, Jacobi, Newton, TwoPhase
from tests.coupled_diagrams import (
    ALGORITHMS,
    array,
    elsewhere,
    everything,
    names,
    oscillator,
    random_walk,
    same,
)

STOP = 0.4
QUICK = [a for a in ALGORITHMS if not names(a).startswith("StepDoublingIterated")]
ORDERLESS = [a for a in QUICK if not isinstance(a, GaussSeidel)]
_runs: dict[str, Run] = {}


def once(algorithm) -> Run:
    """Return the run that all others are compared with."""
    key = repr(algorithm)
    if key not in _runs:
        _runs[key] = everything().run(STOP, algorithm=algorithm, engine="python")
    return _runs[key]


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_twice(algorithm) -> None:
    diagram = everything()
    for _ in range(2):
        assert same(diagram.run(STOP, algorithm=algorithm, engine="python"), once(algorithm))


def test_in_another_process(tmp_path: Path) -> None:
    jobs = [
        {"diagram": "everything", "stop": STOP, "algorithm": repr(a), "engine": "python"}
        for a in ALGORITHMS
    ]
    for algorithm, run in zip(ALGORITHMS, elsewhere(tmp_path, jobs), strict=True):
        assert same(run, once(algorithm)), names(algorithm)


@pytest.mark.parametrize("algorithm", QUICK, ids=names)
def test_with_isolated_fmus(algorithm) -> None:
    run = everything(isolated=True).run(STOP, algorithm=algorithm, engine="python")
    assert same(run, once(algorithm))


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_with_the_compiled_stepper(algorithm) -> None:
    run = everything().run(STOP, algorithm=algorithm, engine="compiled")
    assert run.engine == "compiled"
    assert same(run, once(algorithm))


@pytest.mark.parametrize("algorithm", [TwoPhase(), GaussSeidel(extrapolation=1)], ids=names)
def test_with_the_compiled_stepper_and_isolated_fmus(algorithm) -> None:
    run = everything(isolated=True).run(STOP, algorithm=algorithm, engine="compiled")
    assert same(run, once(algorithm))


@pytest.mark.parametrize("engine", ["python", "compiled"])
def test_a_long_run_of_a_simple_loop(engine: str) -> None:
    """Chunks of ticks leave no trace."""
    diagram = oscillator(0.001)
    plain = diagram.run(10.0, engine="python")
    assert same(diagram.run(10.0, engine=engine), plain)
    with diagram.simulation(engine=engine) as simulation:
        for until in (0.001, 0.002, 0.5, 3.217, 9.999, 10.0):
            simulation.advance(until)
        assert same(simulation.result(), plain)


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_in_pieces_and_looked_at(algorithm) -> None:
    """Reading values and taking checkpoints on the way changes nothing."""
    with everything().simulation(algorithm=algorithm, engine="python") as simulation:
        for tick in (1, 2, 7, 12, 13, 20, 30, 31, 40):
            simulation.advance(tick / 100)
            assert simulation.time == tick / 100
            assert simulation["one.x"] == once(algorithm)["one.x"][tick]
            assert simulation["slow.x"] == once(algorithm)["slow.x"][tick]
            simulation.checkpoint()
        assert same(simulation.result(), once(algorithm))


@pytest.mark.parametrize("algorithm", QUICK, ids=names)
def test_a_longer_run_begins_like_a_shorter_one(algorithm) -> None:
    longer = everything().run(STOP + 0.1, algorithm=algorithm, engine="python")
    assert array(longer)[: len(once(algorithm).time)].tobytes() == array(once(algorithm)).tobytes()


def test_what_is_recorded_changes_nothing() -> None:
    ports = ["two.force", "lag.y"]
    run = everything().run(STOP, record=ports)
    assert list(run.frame.columns) == ports
    for port in ports:
        assert run[port].tobytes() == once(TwoPhase())[port].tobytes()


def test_python_blocks_with_a_solved_loop(tmp_path: Path) -> None:
    algorithm = TwoPhase(loops=Newton())
    plain = random_walk().run(STOP, algorithm=algorithm, engine="python")
    assert same(random_walk().run(STOP, algorithm=algorithm, engine="python"), plain)
    job = {"diagram": "random_walk", "stop": STOP, "algorithm": repr(algorithm)}
    assert same(elsewhere(tmp_path, [job])[0], plain)


@pytest.mark.parametrize(
    "algorithm", [a for a in QUICK if not isinstance(a, GaussSeidel)], ids=names
)
def test_in_whatever_order_blocks_are_added_and_connected(algorithm) -> None:
    """Columns follow the order, their values do not, where it is not the order of the steps."""
    plain = everything()
    turned = Diagram("turned", step=plain.step)
    for name, block in reversed(list(plain.blocks.items())):
        turned.add(name, block)
    for target, source in reversed(list(plain.connections.items())):
        turned.connect(str(source), str(target))
    run = turned.run(STOP, algorithm=algorithm, engine="python")
    assert list(run.frame.columns) != list(once(algorithm).frame.columns)
    for column in once(algorithm).frame:
        if isinstance(algorithm, TwoPhase | Jacobi):
            assert run[column].tobytes() == once(algorithm)[column].tobytes(), column
        else:  # what is solved for comes in another order, and its last digits with it
            assert run[column] == pytest.approx(once(algorithm)[column], rel=1e-6, abs=1e-6)
