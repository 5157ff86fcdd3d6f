"""A campaign's folder: its journal, its lock, whose it is, and the table."""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy import stats

from railcosim.cosim.campaign import Campaign, CampaignError
from railcosim.cosim.campaign.files import whole
from railcosim.cosim.campaign.identity import fingerprint
from railcosim.cosim.campaign.journal import Journal
from railcosim.cosim.campaign.lock import locked
from railcosim.cosim.campaign.table import make_table
from tests import troubles

VALUES = [0.1, -0.0, float("inf"), 5e-324, 1 / 3, float("nan")]


def record(run: int, **options: Any) -> dict[str, Any]:
    return {"run": run, "drawn": {}, "rows": [{"x": VALUES[run % 6]}], "error": None} | options


def test_a_journal_keeps_whole_lines_and_the_bits(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    assert journal.append(record(n) for n in (3, 1, 2)) == 3
    assert journal.append([record(3, rows=[]), record(0, error="é\ud800")]) == 1
    journal.close()
    size = journal.path.stat().st_size
    with journal.path.open("ab") as stream:
        stream.write(b'0badc0de {"run":4')
    again = Journal(tmp_path)
    assert (again.done, again.failed) == ({0, 1, 2, 3}, 1)
    assert journal.path.stat().st_size == size
    found = [r["rows"][0]["x"] for r in again.records().values()]
    assert list(again.records()) == [0, 1, 2, 3]
    assert np.array(found).tobytes() == np.array(VALUES[:4]).tobytes()
    again.close()


def test_a_damaged_line_ends_the_journal(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.append(record(n) for n in range(5))
    journal.close()
    data = bytearray(journal.path.read_bytes())
    data[data.index(b'"run":3') + 6] ^= 1
    journal.path.write_bytes(data)
    again = Journal(tmp_path)
    assert again.done == {0, 1, 2}
    again.close()


def test_one_at_a_time(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from railcosim.cosim.campaign.lock import locked\n"
        "with locked(Path(sys.argv[1])): print('in', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert other.stdout is not None
    other.stdout.readline()
    words = f"in use by process {other.pid} on " if os.name != "nt" else "in use by"
    with pytest.raises(CampaignError, match=words), locked(tmp_path):
        pass
    other.kill()  # its lock file stays, and means nothing
    other.communicate()
    with (
        locked(tmp_path),
        pytest.raises(CampaignError, match="another campaign of this process"),
        locked(tmp_path),
    ):
        pass
    with locked(tmp_path):
        pass


def test_a_file_is_whole_or_not_there(tmp_path: Path) -> None:
    path = tmp_path / "f"
    with pytest.raises(ZeroDivisionError), whole(path) as stream:
        stream.write(b"half")
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(CampaignError, match="cannot write"), whole(tmp_path / "none" / "f"):
        pass


def noise(drawn: Any, generator: np.random.Generator) -> dict[str, float]:
    return {"y": drawn["x"] + generator.normal()}


def campaign(**options: Any) -> Campaign:
    values: dict[str, Any] = {
        "name": "c",
        "work": noise,
        "draws": {"x": stats.uniform()},
        "runs": 20,
    }
    return Campaign(**(values | options))


def test_another_campaigns_folder(tmp_path: Path) -> None:
    campaign().run(tmp_path, executor="serial")
    before = (tmp_path / "table.parquet").read_bytes()
    for options, words in (
        ({"runs": 21}, r"its runs \(there 20, here 21\)\. Take"),
        ({"seed": 1}, r"its seed \(there 0, here 1\)\. Take"),
        ({"draws": {"x": stats.uniform(0.0, 2.0)}}, "its draws. Take"),
        ({"work": lambda drawn, generator: {"y": 1.0}, "seed": 2}, "its seed .*, its work. Take"),
    ):
        with pytest.raises(CampaignError, match=words):
            campaign(**options).run(tmp_path, executor="serial")
    assert (tmp_path / "table.parquet").read_bytes() == before
    campaign(seed=1).run(tmp_path, executor="serial", fresh=True)
    assert (tmp_path / "table.parquet").read_bytes() != before
    told = json.loads((tmp_path / "campaign.json").read_text())
    assert told["seed"] == 1
    assert told["versions"]["numpy"] == np.__version__


def test_a_finished_campaign_runs_nothing_again(tmp_path: Path) -> None:
    told: list[int] = []
    first = campaign().run(tmp_path, executor="serial", progress=told.append)
    assert sum(told) == 20
    again = campaign().run(tmp_path, executor="serial", progress=told.append)
    assert sum(told) == 20
    assert first.equals(again)


def test_fingerprints() -> None:
    def made(k: float) -> Any:
        return lambda x: k * x

    assert fingerprint(made(2.0)) == fingerprint(made(2.0)) != fingerprint(made(3.0))
    assert fingerprint(partial(noise, 1)) != fingerprint(partial(noise, 2))
    assert fingerprint({"a": (1, 2.0)}) != fingerprint({"a": (1, 2)})
    assert fingerprint(np.arange(3)) != fingerprint(np.arange(4))
    assert fingerprint(troubles.line()) == fingerprint(troubles.line())
    assert fingerprint(troubles.line()) != fingerprint(troubles.line().with_values({"gain.k": 2.0}))
    loop: list[Any] = [1]
    loop.append(loop)
    assert fingerprint(loop) == fingerprint(loop)


def test_a_fingerprint_is_the_same_in_every_process() -> None:
    code = (
        "from tests import troubles; from railcosim.cosim.campaign.identity import fingerprint\n"
        "from scipy import stats; c = troubles.troubled(troubles.die, (1,))\n"
        "print(fingerprint([c.work, troubles.line(), stats.norm(1.0), {'b', 'a', 'c'}]))"
    )
    root = Path(__file__).parents[4]
    found = {
        subprocess.run(
            [sys.executable, "-c", code], cwd=root, check=True, capture_output=True,
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(root)},
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(found) == 1


def test_the_table(tmp_path: Path) -> None:
    table = campaign(units={"x": "m"}).run(tmp_path, executor="serial")
    assert list(table.columns) == ["run", "seed", "x", "y", "error"]
    assert table.attrs["units"] == {"run": "1", "seed": "", "x": "m", "y": "", "error": ""}
    schema = pq.read_schema(tmp_path / "table.parquet")
    assert schema.field("x").metadata == {b"unit": b"m"}
    assert json.loads(schema.metadata[b"railcosim"]) == {"name": "c", "runs": 20, "seed": 0}
    run = table.to_dict("records")[13]
    generator = np.random.default_rng(json.loads(run["seed"]))
    assert run["y"] == run["x"] + generator.normal()


def test_types_of_columns() -> None:
    rows = [
        {"i": 1, "f": 1, "b": True, "t": "x", "m": 2.5, "none": None},
        {"i": 2, "f": 0.5, "b": None, "t": 3.0, "m": True},
        {"late": 1},
    ]
    records = [record(0, rows=rows[:2]), record(1, rows=rows[2:]), record(2, rows=[], error="no")]
    table = make_table(records, seed=9, units={}, meta={})
    types = {f.name: str(f.type) for f in table.schema}
    assert types == {
        "run": "int64", "seed": "string", "i": "int64", "f": "double", "b": "bool", "t": "string",
        "m": "double", "none": "double", "late": "int64", "error": "string",
    }  # fmt: skip
    assert table["run"].to_pylist() == [0, 0, 1, 2]
    assert table["seed"].to_pylist() == ["[9, 0]", "[9, 0]", "[9, 1]", "[9, 2]"]
    assert table["late"].to_pylist() == [None, None, 1, None]
    assert table["t"].to_pylist() == ["x", "3.0", None, None]
    assert table["error"].to_pylist() == [None, None, None, "no"]


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (3.0, "ParameterError|a run gives a row"),
        ({"y": [1.0]}, "'y' is .*, which is no number"),
        ({"x": 1.0}, "metric 'x' bears the name of another column"),
        ({"seed": 1.0}, "metric 'seed' bears"),
    ],
)
def test_rows_that_no_table_can_hold_are_failed_runs(row: object, words: str) -> None:
    table = campaign(runs=1, work=lambda drawn, generator: row).run(executor="serial")
    assert table["error"].str.match(words).all()
