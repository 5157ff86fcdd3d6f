"""`railcosim identify` on files of one's own."""

import json
from pathlib import Path

import pandas as pd
import pytest

from railcosim.cli import main
from tests.unit.studies.identification.reference_train import Train, log


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("logs")
    paths = []
    for kind in range(2):
        made, _ = log(Train(), kind, noise=0.02)
        paths.append(folder / f"run{kind}.csv")
        pd.DataFrame(
            {
                "time": made.time,
                "command [cm/s2]": 100.0 * made.command,
                "speed [km/h]": 3.6 * made.speed,
                "air_brake": made.air_brake.astype(int),  # pyright: ignore
            }
        ).to_csv(paths[-1], index=False)
    return paths


def test_prints_and_writes_a_report(
    files: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = [*map(str, files), "--fix", "T3=0.8", "--fix", "K=0.8516", "--out", str(out)]
    assert main(["identify", *arguments]) == 0
    text = capsys.readouterr().out
    assert "2 brakings to a stop in 2 logs" in text
    assert "least squares" in text
    assert "0.3 and 0.65 s" in text
    assert "--set train.electric_coefficient=" in text
    assert all(len(line) <= 100 for line in text.splitlines())
    data = json.loads((out / "report.json").read_text())
    found = data["precise"]["parameters"]
    assert found["P1"]["value"] == pytest.approx(0.85, abs=4 * found["P1"]["standard_error"])
    assert found["P1"]["value"] == pytest.approx(0.85, rel=0.01)
    assert data["T1+T2"]["value"] == pytest.approx(1.73, abs=0.05)
    assert found["T3"]["fixed"]
    assert found["T3"]["value"] == 0.8
    assert data["precise"]["rmse"] < 3.0
    assert data["coarse_published"]["rmse"] > 40.0
    settings = json.loads((out / "parameters.json").read_text())
    assert settings["electric_delay.time"] == found["T1"]["value"]
    assert settings["train.air_numerator"] == pytest.approx(1.0142, rel=1e-4)
    assert (out / "speeds.svg").stat().st_size > 1000
    assert (out / "speeds.png").stat().st_size > 1000


def test_one_model_by_a_search(files: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--model", "coarse", "--method", "improved_fruit_fly", "--evaluations", "50"]
    assert main(["identify", str(files[0]), *options, "--seed", "3"]) == 0
    text = capsys.readouterr().out
    assert "improved fruit fly: 50 evaluations" in text
    assert "seed 3" in text
    assert "Precise" not in text


def test_mistakes(files: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def fails(*arguments: str) -> str:
        assert main(["identify", *arguments]) == 1
        out, err = capsys.readouterr()
        assert out == ""
        assert err.count("\n") == 1
        assert "Traceback" not in err
        return err

    first = str(files[0])
    assert "no file" in fails(str(tmp_path / "none.csv"))
    assert "required: LOGS" in fails()
    assert "write NAME=NUMBER" in fails(first, "--fix", "T3")
    assert "write NAME=NUMBER" in fails(first, "--fix", "T3=long")
    assert "given twice" in fails(first, "--fix", "T3=1", "--fix", "T3=2")
    assert "nothing to fix named 'T8'" in fails(first, "--fix", "T8=1")
    assert "invalid choice: 'genetic'" in fails(first, "--method", "genetic")
    assert "needs 4 brakings" in fails(first, "--method", "mixed_effects")
    assert "whole number from 1" in fails(first, "--method", "fruit_fly", "--evaluations", "0")
    assert "--seed -1" in fails(first, "--seed", "-1")
    assert "no column 'speed'" in fails(write(tmp_path, "time,command\n0,0\n"))
    names = [f"--fix={n}=1" for n in ("T1", "T2", "P1", "T3", "T4", "K")]
    assert "all parameters of the precise model are fixed" in fails(first, *names)


def write(folder: Path, text: str) -> str:
    path = folder / "own.csv"
    path.write_text(text)
    return str(path)
