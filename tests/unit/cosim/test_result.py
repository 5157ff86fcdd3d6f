from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from railcosim import Constant, Diagram, Ramp, Run
from railcosim.base.errors import FileError, ParameterError


@pytest.fixture
def run() -> Run:
    diagram = Diagram("result", step=0.1)
    diagram.add("ramp", Ramp(slope=1 / 3, unit="m/s"))
    diagram.add("force", Constant(2.0, unit="N"))
    return diagram.run(1.0)


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


def test_csv_reads_back_to_the_same_bits(run: Run, tmp_path: Path) -> None:
    run.save(tmp_path / "a.csv")
    back = pd.read_csv(tmp_path / "a.csv", index_col="time")
    assert np.array_equal(back.to_numpy(), run.values)
    assert np.array_equal(back.index.to_numpy(), run.time)


def test_file_mistakes(run: Run, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"must end in \.parquet or \.csv"):
        run.save(tmp_path / "a.xlsx")
    with pytest.raises(FileError, match="cannot write"):
        run.save(tmp_path / "nowhere" / "a.csv")
    (tmp_path / "b.parquet").write_text("no")
    with pytest.raises(FileError, match="cannot read"):
        Run.load(tmp_path / "b.parquet")
    run.frame.to_parquet(tmp_path / "c.parquet")
    with pytest.raises(FileError, match="not written by railcosim"):
        Run.load(tmp_path / "c.parquet")


def test_scope_groups_by_unit(run: Run) -> None:
    figure = run.scope()
    assert [axis.get_ylabel() for axis in figure.axes] == ["m/s", "N"]
    assert figure.axes[-1].get_xlabel() == "time / s"
    with pytest.raises(ParameterError, match="did you mean 'ramp.y'"):
        run.scope("rmp.y")
