"""`check` against reference files, and with inputs from files."""

from pathlib import Path

import numpy as np
import pytest

from railcosim.base.errors import FileError
from railcosim.fmus.check import check
from railcosim.fmus.simulate import simulate


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_against_a_file_made_independently(tmp_path: Path, train_fmu: Path) -> None:
    """The step response of 2.2 wn²/((s+a)(s+b)) from its formula, at times of its own."""
    a, b = (0.2178 - np.sqrt(0.2178**2 - 0.0324), 0.2178 + np.sqrt(0.2178**2 - 0.0324))
    t = np.linspace(0.0, 60.0, 1201)
    y = 2.2 * (1.0 - (b * np.exp(-a * t) - a * np.exp(-b * t)) / (b - a))
    rows = "\n".join(f"{ti:.17g},{yi:.17g}" for ti, yi in zip(t, y, strict=True))
    reference = write(tmp_path / "ref.csv", f"time,speed\n{rows}\n")
    inputs = write(tmp_path / "in.csv", "time,u\n0,1\n")
    report = check(train_fmu, reference=reference, inputs=inputs, tolerance=1e-9)
    assert report.passed, str(report)
    assert [c.variable for c in report.comparisons] == ["speed"]
    wrong = write(tmp_path / "wrong.csv", "time,speed\n0,0\n60,2.2\n")
    report = check(train_fmu, reference=wrong, inputs=inputs)
    assert not report.passed
    assert "speed" in str(report)
    assert "FAIL" in str(report)


def test_a_result_of_simulate_is_a_reference(tmp_path: Path, train_fmu: Path) -> None:
    inputs = write(tmp_path / "in.csv", "time,u\n0,0\n5,2\n5,-1\n60,3\n")
    simulate(train_fmu, inputs=inputs, out=tmp_path / "r.csv")
    report = check(train_fmu, reference=tmp_path / "r.csv", tolerance=1e-12)
    assert report.passed, str(report)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("time,u\n", "holds no rows"),
        ("t,u\n0,1\n", "first column must be 'time'"),
        ("time,v\n0,1\n", "no input 'v'; there are: u"),
        ("time,u\n0,1\n1,x\n", r"line 3, column 'u': 'x' is not a finite number"),
        ("time,u\n0,1\n1,\n", r"line 3, column 'u': an empty cell"),
        ("time,u\n0,1\n1,inf\n", r"line 3, column 'u': 'inf'"),
        ("time,u\n1,1\n0,1\n", "line 3: the time decreases"),
        ("time,u,u\n0,1,2\n", "two columns are named 'u'"),
        (
            "time,u\n0,1,2,3\n0\n",
            "Expected 2 fields in line 2, saw 4",
        ),
        ("time;u\n0;1\n", "not 'time;u'; columns are separated by commas"),
        ("time,u\n0,nan\n", "'nan' is not a finite number"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, train_fmu: Path, text: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        check(train_fmu, inputs=write(tmp_path / "in.csv", text))


def test_a_reference_without_outputs_or_times_in_common(tmp_path: Path, train_fmu: Path) -> None:
    with pytest.raises(FileError, match="no output of the FMU"):
        check(train_fmu, reference=write(tmp_path / "a.csv", "time,u\n0,1\n"))
    with pytest.raises(FileError, match="no file"):
        check(train_fmu, reference=tmp_path / "none.csv")


def test_the_whole_reference_is_compared(tmp_path: Path, train_fmu: Path) -> None:
    """Also where its length is no whole number of ten steps, or of steps."""
    for step, end in ((0.03, 0.99), (0.05, 0.97)):
        rows = "".join(f"{k / 100},{0.0 if k < 90 else 50.0}\n" for k in range(int(end * 100) + 1))
        reference = tmp_path / "ref.csv"
        reference.write_text(f"time,speed\n{rows}")
        report = check(train_fmu, reference=reference, step=step)
        assert not report.passed
        assert report.comparisons[0].time > 0.89
