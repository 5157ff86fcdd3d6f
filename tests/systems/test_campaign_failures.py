"""Runs that fail, kill their worker or hang are rows; all others are as without them."""

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim import Run
from railcosim.cosim.campaign import Campaign, CampaignError, Simulate
from tests.troubles import (
    POINTS,
    die,
    die_once,
    hang,
    hang_in_c,
    last,
    leave,
    line,
    troubled,
)


def check(table: Any, at: tuple[int, ...], words: str) -> None:
    assert list(table["run"]) == list(range(30))
    assert list(table["run"][table["error"].notna()]) == list(at)
    assert set(table["error"].dropna()) == {words}
    expected = [np.random.default_rng([0, n]).normal() for n in range(30) if n not in at]
    assert list(table["noise"].dropna()) == expected
    assert list(table["x"]) == POINTS["x"]


def test_workers_that_die() -> None:
    check(troubled(die, (0, 21)).run(workers=2), (0, 21), "the worker died in this run")


def test_a_worker_that_is_killed_from_outside(tmp_path: Path) -> None:
    trouble = partial(die_once, tmp_path / "mark")
    table = troubled(trouble, (9,)).run(workers=1)
    assert (tmp_path / "mark").exists()
    assert not any(isinstance(error, str) for error in table["error"])
    assert table["noise"].tolist() == [np.random.default_rng([0, n]).normal() for n in range(30)]


def test_a_run_that_leaves() -> None:
    check(troubled(leave, (5,)).run(executor="serial"), (5,), "SystemExit: 3")


def test_a_run_that_hangs_in_python() -> None:
    found = troubled(hang, (7, 20), timeout=0.2).run(executor="serial")
    check(found, (7, 20), "the run did not end within 0.2 s (timeout)")


def test_a_run_that_hangs_in_c() -> None:
    found = troubled(hang_in_c, (15,), timeout=0.2).run(workers=1)
    check(found, (15,), "the run did not end within 0.2 s (timeout)")


def test_a_broken_executor_is_made_again_by_its_function_only() -> None:
    def pool() -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, mp_context=get_context("spawn"))

    check(troubled(die, (3,)).run(executor=pool), (3,), "the worker died in this run")
    with pool() as executor, pytest.raises(CampaignError, match="give a function that makes"):
        troubled(die, (3,)).run(executor=executor)


def test_failed_runs_and_their_traces(tmp_path: Path) -> None:
    made = Campaign(
        name="c",
        work=Simulate(diagram=line(), stop=1.0, measure=last),
        draws={"source.value": [1.0, 1e308, "two", 3.0], "gain.k": [2.0]},
        traces="failed",
    )
    table = made.run(tmp_path, executor="serial")
    assert list(table["end"].fillna(-1.0)) == [2.0, -1.0, -1.0, 6.0]
    assert "gain" in table["error"][1]
    assert "value" in table["error"][2]
    assert [p.name for p in (tmp_path / "traces").iterdir()] == ["run-000001.parquet"]
    assert Run.load(tmp_path / "traces" / "run-000001.parquet").failure


def test_a_name_that_no_run_has_ends_it_before_it_begins(tmp_path: Path) -> None:
    work = Simulate(diagram=line(), stop=1.0, measure=last)
    for name, words in (("gian.k", "did you mean 'gain'"), ("gain.q", "no parameter 'q'")):
        with pytest.raises(Exception, match=words):
            Campaign(name="c", work=work, draws={name: [1.0]}).run(tmp_path / "none")
    assert not (tmp_path / "none").exists()
