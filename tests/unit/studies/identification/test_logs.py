"""Reading logs: units and layouts that are understood, and mistakes said in one line."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from railcosim.base.errors import FileError, ParameterError
from railcosim.studies.identification.braking import brakings
from railcosim.studies.identification.identify import identify
from railcosim.studies.identification.logs import Log, read_logs
from railcosim.studies.identification.parameters import canonical


def run(count: int = 150) -> pd.DataFrame:
    """Return a stop: 5 s at 12 m/s, then braking at 0.8 m/s² from a second after the command."""
    time = 0.2 * np.arange(count)
    return pd.DataFrame(
        {
            "time": time,
            "command": np.where(time < 5.0, 0.0, -0.8),
            "speed": np.clip(12.0 - 0.8 * (time - 6.0), 0.0, 12.0),
            "air_brake": (time > 16.5).astype(int),
        }
    )


def write(folder: Path, table: pd.DataFrame, name: str = "log.csv") -> Path:
    path = folder / name
    if path.suffix == ".parquet":
        table.to_parquet(path)
    else:
        table.to_csv(path, index=False)
    return path


def test_units_and_other_names(tmp_path: Path) -> None:
    table = run()
    plain = read_logs([write(tmp_path, table)])[0]
    other = pd.DataFrame(
        {
            "Time [ms]": 1000.0 * table["time"],
            "driver": "A",
            "U (cm/s^2)": 100.0 * table["command"],
            "Speed [km/h]": 3.6 * table["speed"],
            "air_brake": ["on" if on else "off" for on in table["air_brake"]],
            "Gradient [‰]": 3.0,
        }
    )
    for name in ("other.csv", "other.parquet"):
        (log,) = read_logs([write(tmp_path, other, name)])
        for field in ("time", "command", "speed"):
            assert getattr(log, field) == pytest.approx(getattr(plain, field), abs=1e-12)
        assert log.air_brake is not None
        assert np.array_equal(log.air_brake, table["air_brake"] == 1)
        assert log.gradient == pytest.approx(np.full(150, 3.0))
    german = tmp_path / "semicolon.csv"
    table.to_csv(german, index=False, sep=";")
    assert read_logs([german])[0].speed == pytest.approx(plain.speed)
    indexed = tmp_path / "indexed.parquet"
    table.set_index("time").to_parquet(indexed)
    assert read_logs([indexed])[0].speed == pytest.approx(plain.speed)


def test_several_runs_and_folders(tmp_path: Path) -> None:
    both = pd.concat([run().assign(run="a"), run(140).assign(run="b")])
    write(tmp_path, both, "two.csv")
    write(tmp_path, run(), "one.csv")
    logs = read_logs([tmp_path])
    assert [(log.name, len(log.time)) for log in logs] == [
        ("one", 150), ("two-a", 150), ("two-b", 140),
    ]  # fmt: skip
    assert len(brakings(logs)) == 3


def test_a_file_counts_once(tmp_path: Path) -> None:
    path = write(tmp_path, run())
    with pytest.raises(FileError, match=r"log\.csv is given twice"):
        read_logs([tmp_path, path])


def test_kilometres_per_hour_that_are_not_said(tmp_path: Path) -> None:
    path = write(tmp_path, run().assign(speed=lambda table: 4.5 * table["speed"]))
    with pytest.raises(FileError, match=r"54 m/s cannot be; say the unit, as in 'speed \[km"):
        read_logs([path])


def test_several_stops_in_a_run() -> None:
    """A whole trip: each stop is a braking, and its window does not reach into the stop before."""
    one = run()
    away = pd.DataFrame({"command": 0.8, "speed": 0.16 * np.arange(75), "air_brake": 0})
    trip = pd.concat([one, away, one], ignore_index=True)
    log = Log(
        name="trip", time=0.2 * np.arange(len(trip)), command=trip["command"].to_numpy(dtype=float),
        speed=trip["speed"].to_numpy(dtype=float), air_brake=trip["air_brake"].to_numpy() > 0,
    )  # fmt: skip
    found = brakings([log])
    assert [b.name for b in found] == ["trip-1", "trip-2"]
    for braking in found:
        assert braking.time[0] == 0.0
        assert braking.time[braking.counts][0] == pytest.approx(3.0)
        assert braking.start_speed == pytest.approx(12.0)
        assert braking.onset == pytest.approx(16.5 - 2.0, abs=0.1 + 1e-9)


def test_the_instant_of_a_speed() -> None:
    (braking,) = brakings(read_of(run()))
    instant, slope = braking.passing(3.0)
    assert instant == pytest.approx(6.0 + 9.0 / 0.8 - 2.0, abs=1e-6)
    assert slope == pytest.approx(-1.0 / 0.8, rel=1e-6)


def read_of(table: pd.DataFrame) -> list[Log]:
    columns = {name: table[name].to_numpy(dtype=float) for name in ("time", "command", "speed")}
    return [Log(name="log", **columns)]


def changed(column: str, row: int, value: object) -> pd.DataFrame:
    table = run().astype({column: object})
    table.loc[row, column] = value
    return table


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            run().rename(columns={"speed": "sped"}),
            r"no column 'speed' \[m/s\].*did you mean 'sped'",
        ),
        (run().drop(columns="command"), r"no column 'command' \[m/s2\]; columns: time, speed"),
        (run().assign(v=1.0), "columns 'speed' and 'v' both are the speed"),
        (run().rename(columns={"speed": "speed [kph]"}), r"'speed \[kph\]'.*write 'km/h'"),
        (run().rename(columns={"speed": "speed [N]"}), r"'N' is not a unit of the speed"),
        (run().assign(speed=lambda t: 100.0 * t["speed"]), r"line 2.*1200 m/s cannot.*\[km/h\]"),
        (run().assign(command=lambda t: 100.0 * t["command"]), r"line 27.*\[cm/s2\]"),
        (changed("speed", 7, ""), r"line 9, column 'speed': 'nan' is not a finite number"),
        (changed("speed", 7, "fast"), r"line 9, column 'speed': 'fast' is not a finite number"),
        (changed("command", 3, np.inf), r"line 5, column 'command': 'inf'"),
        (changed("air_brake", 3, 2), r"line 5, column 'air_brake': 2 cannot be; the flag is 0"),
        (changed("time", 40, 7.8), r"line 42, column 'time': 7.8 s follows 7.8 s.*column 'run'"),
        (run()[lambda t: (t["time"] < 8) | (t["time"] > 11.1)], r"line 42.*gap of 3.4 s.*split"),
        (run(8), "8 samples are too few; 10 at least"),
        (run()[:0], "has no rows"),
        (pd.concat([run().assign(run=r) for r in (1, 2, 1)]), "line 302: run 1 begins again"),
        (run().assign(run=["a"] * 149 + [None]), "line 151: no value in column 'run'"),
    ],
)
def test_mistakes_in_files(tmp_path: Path, table: pd.DataFrame, words: str) -> None:
    path = write(tmp_path, table)
    with pytest.raises(FileError, match=words) as caught:
        read_logs([path])
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no file"):
        read_logs([tmp_path / "none.csv"])
    with pytest.raises(FileError, match=r"no \.csv or \.parquet"):
        read_logs([tmp_path])
    with pytest.raises(FileError, match="not '.txt'"):
        (tmp_path / "log.txt").touch()
        read_logs([tmp_path / "log.txt"])
    for name, content in (("a.csv", b""), ("b.parquet", b"no parquet"), ("c.csv", b"\xff\xfe\x00")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FileError, match=f"cannot read .*{name}|no column"):
            read_logs([tmp_path / name])


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (run(90), r"no stop: its speed goes from 12.00 to 2.56 m/s"),
        (run().assign(command=0.0), "no braking before it.*negative commands brake"),
        (run().assign(command=lambda t: -t["command"]), "negative commands brake"),
        (run().assign(air_brake=0), "the air brake does not come on before the stop at 21 s"),
        (run().assign(air_brake=1), "the air brake is on already at 5 s"),
    ],
)
def test_logs_without_a_braking(tmp_path: Path, table: pd.DataFrame, words: str) -> None:
    logs = read_logs([write(tmp_path, table)])
    with pytest.raises(FileError, match=words):
        identify(logs)


def test_what_is_fixed() -> None:
    assert canonical({"T3": 0.8, "k_bra": 0.6, "air_lag": 2}) == {
        "air_delay": 0.8, "fade_rate": 0.6, "air_lag": 2.0,
    }  # fmt: skip
    for fixed, words in (
        ({"T9": 1.0}, "nothing to fix named 'T9'"),
        ({"airlag": 1.0}, "did you mean 'air_lag'"),
        ({"T3": 1.0, "air_delay": 1.0}, "fixed twice"),
        ({"T4": 0.0}, "T4 must be a number from 0.001 up"),
        ({"P1": float("nan")}, "P1 must be"),
    ):
        with pytest.raises(ParameterError, match=words):
            canonical(fixed)
