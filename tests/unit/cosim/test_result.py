from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from railcosim import Constant, Diagram, Ramp, Run
from railcosim.base.errors import FileError, ParameterError
from railcosim.cosim.results.pacing import LateTick, PacingReport


@pytest.fixture
def run() -> Run:
    diagram = Diagram("result", step=0.1)
    diagram.add("ramp", Ramp(slope=1 / 3, unit="m/s"))
    diagram.add("force", Constant(2.0, unit="N"))
    return diagram.run(1.0)


def mixed() -> Run:
    """Of one column of each type, and everything else that a run may say of itself."""
    return Run(
        "mixed",
        np.arange(4) / 10,
        np.array([[0.1, 3.0, 1.0], [0.2, -4.0, 0.0], [0.3, 2.0**31 - 1, 1.0], [1 / 3, 0.0, 0.0]]),
        ("a.x", "a.count", "a.on"),
        {"a.x": "m/s", "a.count": "1"},
        types={"a.x": "float64", "a.count": "int64", "a.on": "bool"},
        info={"engine": "compiled", "algorithm": "Jacobi()", "order": ["a"], "steps": 3},
        pacing=PacingReport(2.0, 1e-3, 4, 1, 0.5, (LateTick(2, 0.2, 0.5),)),
    )


def test_frame(run: Run) -> None:
    assert list(run.frame.columns) == ["ramp.y", "force.y"]
    assert run.frame.index.name == "time"
    assert run.frame.loc[0.3, "ramp.y"] == pytest.approx(0.1)


def test_parquet_round_trip(run: Run, tmp_path: Path) -> None:
    back = Run.load(run.save(tmp_path / "a.parquet"))
    assert back.values.tobytes() == run.values.tobytes()
    assert back.time.tobytes() == run.time.tobytes()
    assert (back.columns, back.units, back.name) == (run.columns, run.units, run.name)
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert schema.field("ramp.y").metadata == {b"unit": b"m/s"}
    assert b"railcosim" in schema.metadata
    assert [path.name for path in tmp_path.iterdir()] == ["a.parquet"]


def test_csv_reads_back_to_the_same_bits(run: Run, tmp_path: Path) -> None:
    run.save(tmp_path / "a.csv")
    back = pd.read_csv(tmp_path / "a.csv", index_col="time")
    assert np.array_equal(back.to_numpy(), run.values)
    assert np.array_equal(back.index.to_numpy(), run.time)


# Types


def test_typed_columns() -> None:
    run = mixed()
    assert [str(t) for t in run.frame.dtypes] == ["float64", "int64", "bool"]
    assert run["a.x"].dtype == np.float64
    assert run["a.count"].dtype == np.int64
    assert run["a.count"].tolist() == [3, -4, 2**31 - 1, 0]
    assert run["a.on"].dtype == np.bool_
    assert run["a.on"].tolist() == [True, False, True, False]
    assert run.values.dtype == np.float64
    assert run.values[:, 1].tolist() == [3.0, -4.0, 2.0**31 - 1, 0.0]


@pytest.mark.parametrize("lazy", [False, True])
def test_types_and_the_rest_in_parquet(tmp_path: Path, *, lazy: bool) -> None:
    run = mixed()
    path = run.save(tmp_path / "a.parquet")
    schema = pq.read_schema(path)
    assert schema.types == [pa.float64(), pa.float64(), pa.int64(), pa.bool_()]
    assert [str(t) for t in pd.read_parquet(path).dtypes][1:] == ["float64", "int64", "bool"]
    back = Run.load(path, lazy=lazy)
    assert back.types == run.types == {"a.count": "int64", "a.on": "bool"}
    assert back.frame.equals(run.frame)
    assert back["a.on"].tolist() == run["a.on"].tolist()
    assert (back.info, back.pacing, back.failure) == (run.info, run.pacing, None)
    assert (back.engine, back.algorithm) == ("compiled", "Jacobi()")


def test_truth_values_are_numbers_in_csv(tmp_path: Path) -> None:
    text = mixed().save(tmp_path / "a.csv").read_text()
    assert text.splitlines()[:3] == ["time,a.x,a.count,a.on", "0.0,0.1,3,1", "0.1,0.2,-4,0"]


# Files of other times and places


def test_a_file_of_an_earlier_version(tmp_path: Path) -> None:
    """Written as version 0.1.0 did: everything float64, three things in the metadata."""
    meta = b'{"name": "old", "units": {"a.y": "m"}, "failure": "it broke"}'
    fields = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
    fields += [pa.field("a.y", pa.float64(), metadata={"unit": "m"})]
    schema = pa.schema(fields, metadata={b"railcosim": meta})
    table = pa.table({"time": [0.0, 0.1], "a.y": [1.0, 2.0]}, schema=schema)
    pq.write_table(table, tmp_path / "old.parquet", compression="zstd")
    run = Run.load(tmp_path / "old.parquet")
    assert (run.name, run.units, run.failure) == ("old", {"a.y": "m"}, "it broke")
    assert (run.types, run.info, run.pacing, run.engine) == ({}, {}, None, "")
    assert run["a.y"].tolist() == [1.0, 2.0]
    assert run.time.tolist() == [0.0, 0.1]


def test_a_column_is_not_taken_for_one_with_a_longer_name(tmp_path: Path) -> None:
    """The Parquet reader takes the dots in names for nesting."""
    run = Run("dots", np.arange(2.0), np.array([[1.0, 2.0], [3.0, 4.0]]), ("a.b.c", "a.b"), {})
    back = Run.load(run.save(tmp_path / "a.parquet"), lazy=True)
    assert back["a.b"].tolist() == [2.0, 4.0]
    assert back["a.b.c"].tolist() == [1.0, 3.0]


def test_lazy_runs_read_what_is_asked_for(run: Run, tmp_path: Path) -> None:
    path = run.save(tmp_path / "a.parquet")
    lazy = Run.load(path, lazy=True)
    assert repr(lazy) == "Run('result': 11 rows of 2 signals)"
    assert lazy["ramp.y"].tobytes() == run["ramp.y"].tobytes()
    assert lazy.time.tobytes() == run.time.tobytes()
    copy = Run.load(lazy.save(tmp_path / "b.parquet"))
    assert copy.values.tobytes() == run.values.tobytes()
    lazy.save(path)  # onto itself
    assert Run.load(path).values.tobytes() == run.values.tobytes()
    path.unlink()
    with pytest.raises(FileError, match=r"cannot read .*a\.parquet"):
        lazy["force.y"]


def test_file_mistakes(run: Run, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"must end in \.parquet or \.csv"):
        run.save(tmp_path / "a.xlsx")
    with pytest.raises(FileError, match="cannot write"):
        run.save(tmp_path / "nowhere" / "a.csv")
    with pytest.raises(FileError, match="no file"):
        Run.load(tmp_path / "none.parquet")
    (tmp_path / "b.parquet").write_text("no")
    with pytest.raises(FileError, match="cannot read"):
        Run.load(tmp_path / "b.parquet")
    run.frame.to_parquet(tmp_path / "c.parquet")
    with pytest.raises(FileError, match="not written by railcosim"):
        Run.load(tmp_path / "c.parquet")
    for suffix in ("parquet", "csv"):
        (tmp_path / f"d.{suffix}").mkdir()
        with pytest.raises(FileError, match=rf"cannot write .*d\.{suffix}"):
            run.save(tmp_path / f"d.{suffix}")
    assert not list(tmp_path.glob("*.part"))
    with pytest.raises(FileError, match="a signal is named 'time'"):
        run.renamed({"ramp.y": "time"}).save(tmp_path / "e.csv")


# Values


def test_renamed() -> None:
    run = mixed().renamed({"a.x": "x", "a.on": "on"})
    assert run.columns == ("x", "a.count", "on")
    assert run.units == {"x": "m/s", "a.count": "1"}
    assert run["on"].tolist() == [True, False, True, False]
    assert run.info["steps"] == 3


def test_replace_keeps_the_numbers_where_they_are(run: Run) -> None:
    other = replace(run, failure="it broke", wall_time=2.0)
    assert (other.failure, other.wall_time, other.name) == ("it broke", 2.0, run.name)
    assert other.samples is run.samples
    assert repr(other) == "Run('result': 11 rows of 2 signals, failed)"


def test_an_empty_run(tmp_path: Path) -> None:
    run = Run("empty", failure="at once")
    assert (run.time.shape, run.values.shape) == ((0,), (0, 0))
    back = Run.load(run.save(tmp_path / "a.parquet"))
    assert (back.values.shape, back.failure) == ((0, 0), "at once")


def test_scope_groups_by_unit(run: Run) -> None:
    figure = run.scope()
    assert [axis.get_ylabel() for axis in figure.axes] == ["m/s", "N"]
    assert figure.axes[-1].get_xlabel() == "time / s"
    with pytest.raises(ParameterError, match="did you mean 'ramp.y'"):
        run.scope("rmp.y")
