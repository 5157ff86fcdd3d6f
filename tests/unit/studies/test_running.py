"""Cases side by side in worker processes: what comes out is that of one after the other."""

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from multiprocessing import parent_process
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import pandas as pd
import pytest

from railcosim import Diagram, Fmu, Gain, Noise, Run
from railcosim.cosim.campaign import Processes
from railcosim.fmus import build
from railcosim.studies import running
from railcosim.studies.case import Case
from railcosim.studies.computed import Computed, Rows
from railcosim.studies.ensemble import Ensemble
from railcosim.studies.metrics import Metrics
from railcosim.studies.results import Results
from railcosim.studies.running import run_all
from tests import plants


class Bar:
    """A progress bar that remembers."""

    def __init__(self) -> None:
        self.count = 0
        self.shown: list[str] = []

    def update(self, count: int) -> None:
        self.count += count

    def set_postfix_str(self, text: str) -> None:
        self.shown.append(text)


@pytest.fixture(scope="module")
def pool() -> Iterator[Processes]:
    with Processes(2) as made:
        yield made


def measure(run: Run) -> Metrics:
    """Return the last value, and whether a worker process measured it."""
    return {"end": float(run.values[-1, -1]), "away": float(parent_process() is not None)}


def case(name: str, **options: Any) -> Case:
    diagram = Diagram(name, step=0.1)
    diagram.add("noise", Noise(seed=len(name)))
    diagram.add("k", Gain(3.0))
    diagram.connect("noise.y", "k.u")
    made = Case("noise", name, diagram, 20.0, measure, seeds={"noise": len(name)}, long=True)
    return replace(made, **options)


def failing(name: str) -> Case:
    diagram = Diagram("blow", step=0.1)
    diagram.add("plant", Fmu(build(plants.blow_up())))
    return case(name, diagram=diagram, stop=2.0)


def compute() -> Rows:
    return {"one": ({"end": 1.0}, None), "two": ({"end": 2.0}, Run("two", np.arange(3.0)))}


def total(samples: pd.DataFrame) -> Metrics:
    return {"end": float(np.sum(samples["end"].to_numpy()))}


def several() -> Ensemble:
    return Ensemble(
        "noise", "several", case("several").diagram, 1.0, measure, draws={"k.k": [1.0, 2.0, 3.0]},
        summarise=total, runs=1, seed=1,
    )  # fmt: skip


def run(cases: list[Case], pool: Processes) -> tuple[Results, Bar]:
    results, bar = Results("test", {"end": "1", "away": "1", "k.k": "1"}), Bar()
    run_all(cases, results, pool, bar)
    return results, bar


def here(cases: list[Case]) -> Results:
    """Run one after the other."""
    with Processes(1) as single:
        return run(cases, single)[0]


def places(results: Results) -> dict[str, float | None]:
    """Take out of the metrics where each case was measured."""
    rows = {name: row for of in results.metrics.values() for name, row in of.items()}
    return {name: row.pop("away") for name, row in rows.items() if "away" in row}


def same(one: Results, other: Results) -> None:
    """Assert that two results differ in nothing but where, and how long, they were computed."""
    assert [(e, *rows) for e, rows in one.metrics.items()] == [
        (e, *rows) for e, rows in other.metrics.items()
    ]
    for name in ("metrics", "parameters", "seeds", "fmus", "failure"):
        assert getattr(one, name) == getattr(other, name)
    assert list(one.runs) == list(other.runs)
    for run, again in zip(one.runs.values(), other.runs.values(), strict=True):
        assert run.meta() == again.meta()
        assert (run.columns, run.types) == (again.columns, again.types)
        assert run.time.tobytes() == again.time.tobytes()
        assert run.values.tobytes() == again.values.tobytes()
    assert list(one.samples) == list(other.samples)
    for frame, again in zip(one.samples.values(), other.samples.values(), strict=True):
        assert frame.drop(columns="away").equals(again.drop(columns="away"))


def test_side_by_side_gives_the_same_bits_in_the_same_order(
    pool: Processes, train_fmu: Path
) -> None:
    train = Diagram("train", step=0.05)
    train.add("train", Fmu(train_fmu, u=1.0))
    cases = [
        case("first"),
        case("train", diagram=train, record=("train.speed",)),
        Computed.of("computed", compute, {"draws": 4}),
        several(),
        case("between"),
        replace(case("last"), experiment="other"),
    ]
    results, bar = run(cases, pool)
    serial = here(cases)
    assert results.failure is None
    assert bar.count == sum(case.count for case in cases)
    assert "noise-first, noise-train" in bar.shown
    assert set(places(results).values()) == {1.0}
    assert set(places(serial).values()) == {0.0}
    same(results, serial)


def test_what_cannot_be_sent_or_fails_in_a_way_of_its_own_is_run_here(pool: Processes) -> None:
    lock = Lock()  # which cannot be pickled

    def locked(run: Run) -> Metrics:
        with lock:
            return measure(run)

    results, bar = run([case("a"), case("held", measure=locked), case("c")], pool)
    assert places(results) == {"a": 1.0, "held": 0.0, "c": 1.0}
    assert list(results.runs) == [("noise", name) for name in ("a", "held", "c")]
    assert bar.count == 3

    def mistaken(run: Run) -> Metrics:
        raise ZeroDivisionError("of the measure")

    with pytest.raises(ZeroDivisionError, match="of the measure"):
        run([case("a"), case("b", measure=mistaken)], pool)


def test_a_failing_case_ends_the_runs_as_it_does_alone(pool: Processes) -> None:
    cases = [case("a"), failing("bad"), case("c"), failing("worse"), case("d")]
    results, _ = run(cases, pool)
    assert places(results) == {"a": 1.0}
    assert results.failure is not None
    assert "noise-bad: block 'plant': fmi2DoStep" in results.failure
    assert list(results.runs) == [("noise", "a"), ("noise", "bad")]
    assert results.runs["noise", "bad"].failure
    serial = here(cases)
    places(serial)
    same(results, serial)
    assert not pool.started


def test_a_worker_that_dies_leaves_its_cases_to_be_run_here(pool: Processes) -> None:
    def dies_away(run: Run) -> Metrics:
        if parent_process() is not None:
            os._exit(1)
        return measure(run)

    cases = [case("a", measure=dies_away), case("b"), several(), case("c"), case("d")]
    results, bar = run(cases, pool)
    assert results.failure is None
    found = places(results)
    assert list(found) == list("abcd")
    assert found["a"] == found["c"] == found["d"] == 0.0  # b may have come back before
    assert bar.count == 7


def _told(folder: Path, run: Run) -> Metrics:
    (folder / "begun").touch()
    return measure(run)


def _interrupts(folder: Path, run: Run) -> Metrics:
    """Interrupt the study once the case after the next has begun, and go on for ever."""
    while not (folder / "begun").exists():
        time.sleep(0.01)
    time.sleep(0.2)
    os.kill(os.getppid(), signal.SIGINT)
    time.sleep(600.0)
    return {}


@pytest.mark.skipif(os.name == "nt", reason="a process is interrupted by Ctrl-C alone")
def test_an_interrupted_study_keeps_all_that_is_finished(pool: Processes, tmp_path: Path) -> None:
    cases = [
        case("a"),
        case("stopped", measure=partial(_interrupts, tmp_path)),
        case("b"),
        case("told", measure=partial(_told, tmp_path)),
        case("never", measure=partial(_interrupts, tmp_path / "nowhere")),
    ]
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        results, _ = run(cases, pool)
    finally:
        signal.signal(signal.SIGINT, before)
    assert results.failure == "noise-stopped: interrupted"
    assert list(results.metrics["noise"])[:2] == ["a", "b"]
    assert "stopped" not in results.metrics["noise"]
    assert not pool.started


def test_workers_start_only_for_what_takes_long() -> None:
    with Processes(2) as pool:
        cases = [*(case(name, long=False) for name in "abc"), case("long"), case("d", long=False)]
        assert set(places(run(cases, pool)[0]).values()) == {0.0}
        assert not pool.started


def test_workers_start_once_cases_have_shown_that_they_take_long(
    pool: Processes, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(0, 1000, 7))  # each case takes 7 s
    monkeypatch.setattr(running, "perf_counter", lambda: float(next(clock)))
    results, _ = run([case(name, long=False) for name in "abcd"], pool)
    assert list(places(results).values()) == [0.0, 1.0, 1.0, 1.0]
