"""Running one FMU: spans from its default experiment, inputs, mistakes."""

import re
from pathlib import Path

import pytest

from railcosim.base.errors import FileError, FmuError
from railcosim.fmus.check import check
from railcosim.fmus.simulate import simulate, span
from tests.unit.cosim.test_fmu_block import rewrite

EXPERIMENT = '<DefaultExperiment startTime="0" stopTime="60.0" stepSize="0.05" />'


def with_experiment(source: Path, target: Path, text: str) -> Path:
    def change(name: str, data: bytes) -> tuple[str, bytes]:
        if name == "modelDescription.xml":
            assert EXPERIMENT.encode() in data
            data = data.replace(EXPERIMENT.encode(), text.encode())
        return name, data

    return rewrite(source, target, change)


@pytest.mark.parametrize("stop", [0.1, 4.2, 4.9, 5.1, 7.3, 199.9])
def test_without_a_step_size_there_are_500_steps(
    tmp_path: Path, train_fmu: Path, stop: float
) -> None:
    path = with_experiment(train_fmu, tmp_path / "a.fmu", '<DefaultExperiment startTime="0"/>')
    assert span(path, None, stop).count == 500
    run = simulate(path, stop=stop)
    assert (len(run.time), run.time[-1]) == (501, stop)


@pytest.mark.parametrize(
    ("text", "first", "last", "rows"),
    [
        ('<DefaultExperiment startTime="1" stopTime="10"/>', 1.0, 10.0, 501),
        ('<DefaultExperiment startTime="0.01" stopTime="1" stepSize="0.05"/>', 0.01, 1.01, 21),
        ('<DefaultExperiment startTime="50" stopTime="51" stepSize="0.3"/>', 50.0, 51.2, 5),
        ("", 0.0, 10.0, 501),
    ],
)
def test_start_time_and_steps_that_do_not_fit(
    tmp_path: Path, train_fmu: Path, text: str, first: float, last: float, rows: int
) -> None:
    path = with_experiment(train_fmu, tmp_path / "a.fmu", text)
    run = simulate(path, values={"u": 1.0})
    assert (run.time[0], run.time[-1], len(run.time)) == (first, last, rows)


@pytest.mark.parametrize(
    ("pattern", "new", "message"),
    [
        ('stopTime="60.0"', 'stopTime="abc"', "stopTime of the default experiment is 'abc'"),
        ('stepSize="0.05"', 'stepSize="x"', "stepSize of the default experiment is 'x'"),
        ('min="-10.0"', 'min="low"', "min of u is 'low'"),
    ],
)
def test_numbers_that_are_none_are_named(
    tmp_path: Path, train_fmu: Path, pattern: str, new: str, message: str
) -> None:
    path = rewrite(
        train_fmu,
        tmp_path / "a.fmu",
        lambda n, d: (n, re.sub(pattern.encode(), new.encode(), d, count=1)),
    )
    report = check(path)
    assert not report.passed
    assert message in " ".join(str(report).split())


def test_a_default_experiment_that_ends_before_it_starts(tmp_path: Path, train_fmu: Path) -> None:
    text = '<DefaultExperiment startTime="50" stopTime="1"/>'
    path = with_experiment(train_fmu, tmp_path / "a.fmu", text)
    with pytest.raises(FmuError, match="after the start at 50 s, not 1 s"):
        simulate(path)


def test_the_input_is_not_overwritten(tmp_path: Path, train_fmu: Path) -> None:
    file = tmp_path / "result.csv"
    file.write_text("time,u\n0,1\n")
    with pytest.raises(FileError, match="would overwrite the input"):
        simulate(train_fmu, inputs=file, out=file)
    assert file.read_text() == "time,u\n0,1\n"


def test_damage_anywhere_in_the_archive_is_one_clear_error(tmp_path: Path, train_fmu: Path) -> None:
    """Bytes of the zip's directory changed one at a time: a report or an error, never a crash."""
    data = train_fmu.read_bytes()
    first = data.index(b"PK\x01\x02")
    outcomes = set()
    for place in range(first, len(data), 29):
        path = tmp_path / "m.fmu"
        path.write_bytes(data[:place] + bytes([data[place] ^ 0x09]) + data[place + 1 :])
        try:
            from railcosim.cosim.fmu.file import read_description
            from railcosim.fmus.check.report import Report
            from railcosim.fmus.check.structure import check_structure

            check_structure(path, read_description(path), Report("m"))
            outcomes.add("report")
        except FmuError:
            outcomes.add("error")
    assert outcomes == {"report", "error"}
