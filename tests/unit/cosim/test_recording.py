"""Recording: which rows are kept, in memory and in files, and what memory it takes."""

import subprocess
import sys
import tracemalloc
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from railcosim import Run
from railcosim.base.errors import DiagramError, FileError, ParameterError, RailcosimError
from railcosim.cosim.clock import Clock, rational
from railcosim.cosim.results.observer import Observer
from railcosim.cosim.results.pacing import PacingReport
from railcosim.cosim.results.recording import Recorder, Recording
from railcosim.cosim.results.samples import Times

TENTH = Clock(Fraction(1, 10))
SIGNALS = ("a.y", "a.n", "b.y")


def recorder(
    ticks: int | None, recording: Recording | None = None, *, first: int = 0, name: str = "run"
) -> Recorder:
    units, types = {"a.y": "m", "c.y": "s"}, {"a.n": "int64"}
    return Recorder(SIGNALS, units, types, TENTH, ticks, recording, name=name, first=first)


def drive(made: Recorder, begin: int, end: int, chunk: int = 7) -> None:
    """Record the ticks begin ≤ k < end as an engine does: signals k, 2 k and k / 4."""
    while begin < end:
        stop = min(begin + chunk, end)
        count = made.count(begin, stop)
        rows = made.buffer(count)
        assert rows.shape == (count, 3)
        k = np.array([k for k in range(begin, stop) if k % made.every == 0])
        rows[:] = np.column_stack([k, 2 * k, k / 4])
        made.keep(count)
        begin = stop


def check(run: Run, ticks: list[int]) -> None:
    assert run.time.tolist() == [k / 10 for k in ticks]
    assert run["a.y"].tolist() == ticks
    assert run["a.n"].tolist() == [2 * k for k in ticks]
    assert run["a.n"].dtype == np.int64
    assert run.values.tolist() == [[k, 2 * k, k / 4] for k in ticks]
    assert run.units == {"a.y": "m"}


@pytest.fixture(params=["memory", "unknown", "parquet", "csv"])
def target(request: pytest.FixtureRequest, tmp_path: Path) -> Any:
    """Return (arguments of Recording, whether the number of ticks is known)."""
    kind = request.param
    if kind in ("memory", "unknown"):
        return {}, kind == "memory"
    return {"to": tmp_path / f"a.{kind}"}, True


# Which rows


@pytest.mark.parametrize(
    ("ticks", "every", "kept"),
    [
        (10, 1, list(range(11))),
        (10, 2, [0, 2, 4, 6, 8, 10]),
        (10, 3, [0, 3, 6, 9]),  # the last row is not on the grid: 10 // 3 + 1 rows
        (10, 11, [0]),
        (1, 1, [0, 1]),
    ],
)
def test_n_steps_and_every(target: Any, ticks: int, every: int, kept: list[int]) -> None:
    arguments, known = target
    made = recorder(ticks if known else None, Recording(every=every, **arguments))
    drive(made, 0, ticks + 1)
    assert made.rows == ticks // every + 1
    assert [made.tick(row) for row in range(made.rows)] == kept
    check(made.result(), kept)


def test_a_run_that_goes_on_keeps_to_the_grid(target: Any) -> None:
    """From a checkpoint at tick 5 on."""
    arguments, known = target
    made = recorder(10 if known else None, Recording(every=3, **arguments), first=5)
    drive(made, 5, 16)
    check(made.result(), [6, 9, 12, 15])


def test_a_span_without_a_row(target: Any) -> None:
    arguments, known = target
    made = recorder(2 if known else None, Recording(every=10, **arguments), first=5)
    drive(made, 5, 8)
    assert made.limit >= 1
    check(made.result(), [])


def test_counting_rows() -> None:
    made = recorder(10, Recording(every=3))
    assert [made.count(0, k) for k in range(8)] == [0, 1, 1, 1, 2, 2, 2, 3]
    assert [made.count(k, k + 1) for k in range(4)] == [1, 0, 0, 1]


def test_rows_that_are_not_kept_are_overwritten(target: Any) -> None:
    arguments, known = target
    made = recorder(10 if known else None, Recording(**arguments))
    drive(made, 0, 4)
    made.buffer(3)[:] = np.nan
    made.keep(0)
    drive(made, 4, 8)
    check(made.result(), list(range(8)))


def test_chunks_and_row_groups_do_not_matter(target: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where a buffer is larger than what is written at once."""
    monkeypatch.setattr("railcosim.cosim.results.recording.VALUES_AT_ONCE", 30)
    monkeypatch.setattr("railcosim.cosim.results.recording._BLOCK", 30)
    for chunk in (1, 7, 10, 25):
        arguments, known = target
        made = recorder(100 if known else None, Recording(**arguments))
        drive(made, 0, 101, chunk)
        check(made.result(), list(range(101)))


def test_the_row_just_kept_can_be_taken_back(target: Any) -> None:
    """By a simulation that shows where it stands and then goes on."""
    arguments, known = target
    made = recorder(10 if known else None, Recording(**arguments))
    drive(made, 0, 4)
    made.buffer(1)[:] = np.nan
    made.keep(1)
    made.keep(-1)
    drive(made, 4, 8)
    check(made.result(), list(range(8)))


def test_without_columns(target: Any) -> None:
    arguments, known = target
    made = Recorder((), {}, {}, TENTH, 5 if known else None, Recording([], **arguments))
    made.buffer(6)
    made.keep(6)
    run = made.result()
    assert (run.values.shape, run.time.tolist()) == ((6, 0), [k / 10 for k in range(6)])


def test_the_engine_writes_in_place() -> None:
    """A buffer is plain memory, and in memory that of the result itself."""
    made = recorder(10)
    rows: Any = made.buffer(11)
    view = memoryview(rows).cast("B").cast("d")
    for i in range(33):
        view[i] = float(i)
    made.keep(11)
    run = made.result()
    assert run.values.ravel().tolist() == list(range(33))
    view[0] = 5.0
    assert run.values[0, 0] == 5.0


def test_a_result_in_between_stays_as_it_is() -> None:
    """A simulation that is advanced by hand."""
    made = recorder(None)
    drive(made, 0, 4)
    before = made.result()
    drive(made, 4, 9)
    check(before, list(range(4)))
    check(made.result(), list(range(9)))


# Failures and files


def test_a_failed_run_keeps_its_rows_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    made = recorder(1000, Recording(to=path), name="bad")
    drive(made, 0, 8)
    assert not path.exists()
    assert (tmp_path / "a.parquet.part").exists()
    made.result("block 'a' failed at t = 0.8 s", info={"engine": "python"}, wall_time=1.0)
    run = Run.load(path)
    check(run, list(range(8)))
    assert (run.name, run.failure) == ("bad", "block 'a' failed at t = 0.8 s")
    assert run.engine == "python"
    assert [p.name for p in tmp_path.iterdir()] == ["a.parquet"]
    in_memory = recorder(1000)
    drive(in_memory, 0, 8)
    failed = in_memory.result("it failed")
    check(failed, list(range(8)))
    assert failed.failure == "it failed"


def test_a_streamed_file_is_like_a_saved_one(tmp_path: Path) -> None:
    report = PacingReport(1.0, 1e-3, 11, 0, 1e-5)
    runs = []
    for recording in (None, Recording(to=tmp_path / "a.parquet")):
        made = recorder(10, recording)
        drive(made, 0, 11)
        runs.append(made.result(info={"steps": 10}, pacing=report))
    saved = pq.read_table(runs[0].save(tmp_path / "b.parquet"))
    streamed = pq.read_table(tmp_path / "a.parquet")
    assert streamed.equals(saved)
    assert [f.metadata for f in streamed.schema] == [f.metadata for f in saved.schema]
    one, other = Run.load(tmp_path / "a.parquet"), Run.load(tmp_path / "b.parquet")
    assert one.meta() == other.meta() == runs[1].meta()
    runs[0].save(tmp_path / "b.csv")
    made = recorder(10, Recording(to=tmp_path / "a.csv"))
    drive(made, 0, 11)
    runs[1] = made.result()
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert runs[1].save(tmp_path / "c.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_an_interrupted_run_completes_its_file(tmp_path: Path) -> None:
    made = recorder(10, Recording(to=tmp_path / "a.parquet"))
    drive(made, 0, 4)
    made.close("interrupted at t = 0.4 s")
    made.close("again")
    run = Run.load(tmp_path / "a.parquet")
    check(run, list(range(4)))
    assert run.failure == "interrupted at t = 0.4 s"
    with pytest.raises(RailcosimError, match="has been closed"):
        made.buffer(1)


def test_a_new_file_takes_the_place_of_an_old_one_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    made = recorder(3, Recording(to=path))
    drive(made, 0, 4)
    made.result()
    again = recorder(5, Recording(to=path))
    drive(again, 0, 6)
    check(Run.load(path), list(range(4)))
    again.result()
    check(Run.load(path), list(range(6)))


@pytest.mark.parametrize("suffix", ["parquet", "csv"])
def test_a_disk_that_is_full(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("railcosim.cosim.results.recording.VALUES_AT_ONCE", 9)
    made = recorder(100, Recording(to=tmp_path / f"a.{suffix}"))
    drive(made, 0, 3)

    def full(*args: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(made._file, "_append", full)
    with pytest.raises(FileError, match=rf"cannot write .*a\.{suffix}: No space left on device"):
        drive(made, 3, 9)
    made.close("after that")  # what an engine does in the end; it has nothing to say any more
    assert list(tmp_path.iterdir()) == []


# Choosing


def test_what_record_stands_for() -> None:
    assert Recording.of(None) == Recording()
    assert Recording.of(["a.y"]) == Recording(("a.y",))
    chosen = Recording(["b.y", "a.y"], every=2)
    assert Recording.of(chosen) is chosen
    assert chosen.places(SIGNALS, "loop") == [2, 0]
    assert Recording().places(SIGNALS, "loop") == [0, 1, 2]
    assert Recording([]).places(SIGNALS, "loop") == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"ports": "a.y"}, "ports must be a list of names 'block.port', not 'a.y'"),
        ({"ports": [3]}, "ports must be a list of names"),
        ({"ports": ["a.y", "b.y", "a.y"]}, "a.y named twice"),
        ({"every": 0}, "every must be a whole number of ticks, not 0"),
        ({"every": 1.5}, "every must be a whole number of ticks, not 1.5"),
        ({"every": True}, "every must be a whole number of ticks"),
        ({"to": "a.xlsx"}, r"must end in \.parquet or \.csv"),
        ({"to": "nowhere/a.parquet"}, "no folder nowhere"),
    ],
)
def test_wrong_recordings(arguments: Any, message: str) -> None:
    with pytest.raises((ParameterError, FileError), match=message):
        Recording(**arguments)


def test_a_signal_that_is_not_there() -> None:
    with pytest.raises(DiagramError, match=r"no signal 'a\.x' to record in 'loop'.*mean 'a\.y'"):
        Recording(["a.x"]).places(SIGNALS, "loop")
    with pytest.raises(DiagramError, match=r"no signal 'a\.x' to observe in 'loop'"):
        Observer(print, ["a.x"]).places(SIGNALS, "loop")


def test_observers() -> None:
    observer = Observer(print, ["b.y"], every=3)
    assert (observer.places(SIGNALS, "loop"), observer.label) == ([2], "print")
    wrong: Any = Observer
    for arguments, message in (
        ((3,), "function must be callable, not 3"),
        ((print, "a.y"), "ports must be a list of names"),
        ((print, ("a.y",), 0), "every must be a whole number"),
    ):
        with pytest.raises(ParameterError, match=message):
            wrong(*arguments)


# Times


@pytest.mark.parametrize("step", [0.1, 1 / 3, 0.05, 2.5e-7, 1e-9, 86400.0])
@pytest.mark.parametrize("start", [0.0, -7.3, 1 / 7])
def test_times_are_those_of_the_clock(step: float, start: float) -> None:
    clock = Clock(rational(step), rational(start))
    times = Times(clock, first=12, every=5, count=2000)
    expected = [clock.time(12 + 5 * i) for i in range(2000)]
    assert times.array().tolist() == expected
    assert times.array(100, 200).tolist() == expected[100:200]
    assert times.array(7, 7).tolist() == []


def test_times_with_numbers_too_large_for_a_float() -> None:
    clock = Clock(Fraction(10**15 + 1, 10**16), Fraction(1, 3))
    times = Times(clock, first=0, every=1, count=50)
    assert times.array().tolist() == [clock.time(k) for k in range(50)]


# Memory


def test_at_most_nine_bytes_for_a_sample() -> None:
    """Even for a single signal, which has the times beside it: they are made when asked for."""
    ticks = 2_000_000
    for columns in (("a.y",), SIGNALS):
        tracemalloc.start()
        made = Recorder(columns, {}, {}, TENTH, ticks)
        for begin in range(0, ticks + 1, 10_000):
            count = made.count(begin, min(begin + 10_000, ticks + 1))
            made.buffer(count)[:] = 1.0
            made.keep(count)
        run = made.result()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert run.values.shape == (ticks + 1, len(columns))
        assert peak <= 9 * run.values.size + 1_000_000


def test_a_run_that_ended_early_does_not_hold_the_memory() -> None:
    tracemalloc.start()
    made = Recorder(("a.y",), {}, {}, TENTH, 10_000_000)
    made.buffer(100)[:] = 1.0
    made.keep(100)
    run = made.result("it failed")
    del made
    assert tracemalloc.get_traced_memory()[0] < 1_000_000
    tracemalloc.stop()
    assert run.values.tolist() == [[1.0]] * 100


def test_too_many_rows_are_refused_with_a_remedy() -> None:
    with pytest.raises(ParameterError, match=r"\d+ rows of 3 signals need .*GB.*every=…, to='run"):
        recorder(10**15)
    with pytest.raises(ParameterError, match="GB of memory"):
        recorder(10**25)


LONG = """
import resource, sys
from fractions import Fraction
import numpy as np
from railcosim.cosim.clock import Clock
from railcosim.cosim.results.recording import Recorder, Recording

ticks, path = int(sys.argv[1]), sys.argv[2]
columns = [f"a.y{i}" for i in range(4)]
made = Recorder(columns, {}, {}, Clock(Fraction(1, 100)), ticks, Recording(to=path))
rng = np.random.default_rng(0)
begin = 0
while begin <= ticks:
    end = min(begin + 20_000, ticks + 1)
    rows = made.buffer(end - begin)
    rows[:] = rng.standard_normal(rows.shape)
    rows[:, 0] = np.arange(begin, end)
    made.keep(end - begin)
    begin = end
run = made.result()
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures memory as Linux does")
def test_ten_million_rows_stream_with_flat_memory(tmp_path: Path) -> None:
    """Ten times as many rows, 320 MB of numbers, take no more memory but for some MB."""
    peaks = []
    for ticks in (1_000_000, 10_000_000):
        path = tmp_path / f"{ticks}.parquet"
        done = subprocess.run(
            [sys.executable, "-c", LONG, str(ticks), path], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        peaks.append(int(done.stdout))
    assert peaks[1] - peaks[0] < 30_000, peaks  # kB
    lazy = Run.load(path, lazy=True)
    assert lazy["a.y0"][-1] == 10_000_000
    assert lazy.time[-1] == 100_000.0
    assert pq.ParquetFile(path).metadata.num_row_groups <= 25


def test_pandas_reads_a_streamed_file(tmp_path: Path) -> None:
    made = recorder(10, Recording(to=tmp_path / "a.parquet"))
    drive(made, 0, 11)
    made.result()
    frame = pd.read_parquet(tmp_path / "a.parquet")
    assert list(frame.columns) == ["time", *SIGNALS]
    assert frame["a.n"].tolist() == [2 * k for k in range(11)]
