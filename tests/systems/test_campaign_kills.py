"""A campaign that is killed goes on where it was: nothing lost, nothing doubled, the same table."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from railcosim import Run
from railcosim.cosim.campaign.journal import Journal
from tests.campaigns import table_bytes

ROOT = Path(__file__).parents[2]
DRIVER = Path(__file__).with_name("campaign_driver.py")
RUNS = 120


def start(folder: Path, fmu: Path, executor: str, *where: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, DRIVER, folder, fmu, executor, *where],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process: subprocess.Popen[str], code: int = 0) -> str:
    out, err = process.communicate(timeout=300)
    assert process.returncode == code, err
    return out


def traces(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "traces").iterdir()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, train_fmu: Path) -> Path:
    """A campaign that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    finish(start(folder, train_fmu, "serial"))
    return folder


def same(folder: Path, whole: Path) -> None:
    assert table_bytes(folder) == table_bytes(whole)
    assert traces(folder) == traces(whole)
    lines = (folder / "journal.jsonl").read_bytes().splitlines()
    assert len(lines) == RUNS  # each run once
    assert not list(folder.glob(".*.part"))


def test_the_whole_one(whole: Path) -> None:
    table = pq.read_table(whole / "table.parquet").to_pandas()
    assert set(table["run"]) == set(range(RUNS))
    assert 0 < table["error"].notna().sum() < RUNS
    assert sorted(traces(whole)) == [f"run-{n:06}.parquet" for n in range(0, RUNS, 20)]
    trace = Run.load(whole / "traces" / "run-000020.parquet")
    assert trace["train.speed"].max() == table[table["run"] == 20]["end"].iloc[1]


def test_killed_in_the_middle_of_everything(tmp_path: Path, whole: Path, train_fmu: Path) -> None:
    """While it unpacks the FMU, writes a row and the table; and its workers, at some moment."""
    finish(start(tmp_path, train_fmu, "serial", "unpacking"), 9)
    assert size(tmp_path) == (0, False)
    finish(start(tmp_path, train_fmu, "serial", "journal"), 9)
    assert (tmp_path / "journal.jsonl").read_bytes().endswith(b"1.0")
    killed_at_random(tmp_path, train_fmu, 1, "processes", seed=3)
    finish(start(tmp_path, train_fmu, "serial", "table"), 9)
    assert not (tmp_path / "table.parquet").exists()
    assert list(tmp_path.glob(".table*.part"))
    finish(start(tmp_path, train_fmu, "serial"))
    same(tmp_path, whole)


def killed_at_random(folder: Path, fmu: Path, times: int, executor: str, seed: int) -> None:
    dice = random.Random(seed)
    for _ in range(times):
        process = start(folder, fmu, executor)
        before = size(folder)
        began = time.monotonic()
        # From its first sign of life on: it takes a second or more to start.
        while size(folder) == before and process.poll() is None and time.monotonic() - began < 30:
            time.sleep(0.01)
        time.sleep(dice.uniform(0.0, 0.3))
        process.kill()
        process.communicate()


def size(folder: Path) -> tuple[int, bool]:
    path = folder / "journal.jsonl"
    return path.stat().st_size if path.exists() else -1, (folder / "table.parquet").exists()


@pytest.mark.slow
def test_killed_twenty_times(tmp_path: Path, whole: Path, train_fmu: Path) -> None:
    """About a minute."""
    killed_at_random(tmp_path, train_fmu, 20, "processes", seed=20)
    finish(start(tmp_path, train_fmu, "processes"))
    same(tmp_path, whole)


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C cannot be sent to one process alone")
@pytest.mark.parametrize("executor", ["processes", pytest.param("serial", marks=pytest.mark.slow)])
def test_ctrl_c(executor: str, tmp_path: Path, whole: Path, train_fmu: Path) -> None:
    process = start(tmp_path, train_fmu, executor)
    while size(tmp_path)[0] <= 0 and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    out = finish(process, 130)
    assert f"of {RUNS} runs of 'trains' are kept in {tmp_path}; started again, it goes on" in out
    journal = Journal(tmp_path)
    assert out.startswith(f"{len(journal.done)} of")
    journal.close()
    finish(start(tmp_path, train_fmu, "serial"))
    same(tmp_path, whole)
