"""`check` on good FMUs, on mutations of them, and against files."""

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railcosim.base.errors import FileError, FmuError
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.fmus.check.report import Report
from railcosim.fmus.simulate import simulate
from railcosim.models import second_order_train
from tests import plants
from tests.unit.cosim.test_fmu_block import rewrite


def failed(report: Report) -> dict[str, str]:
    return {f.rule: f.detail for f in report.findings if f.passed is False}


def in_xml(old: str, new: str) -> Callable[[str, bytes], tuple[str, bytes]]:
    def change(name: str, data: bytes) -> tuple[str, bytes]:
        if name == "modelDescription.xml":
            text = data.decode()
            assert re.search(old, text, re.DOTALL), old
            data = re.sub(old, new, text, count=1, flags=re.DOTALL).encode()
        return name, data

    return change


@pytest.mark.parametrize(
    "plant",
    [second_order_train, plants.everything, plants.pendulum, lambda: plants.passing("passing")],
)
def test_our_fmus_pass(plant) -> None:
    report = check(build(plant()))
    assert report.passed, str(report)
    assert report.comparisons
    assert all(c.error < 1e-9 for c in report.comparisons)
    assert all(f.passed for f in report.findings)


def test_the_reference_is_what_fits_the_equations() -> None:
    assert "the matrix exponential" in check(build(second_order_train())).reference
    assert "DOP853" in check(build(plants.pendulum())).reference


def test_a_solver_that_is_too_coarse_is_told() -> None:
    report = check(build(plants.pendulum(), inner_step=0.1), step=0.1)
    assert not report.passed
    assert any(not c.passed for c in report.comparisons)


def test_constant_pieces_are_not_taken_for_linear() -> None:
    report = check(build(plants.switching()))
    assert report.passed, str(report)
    assert "DOP853" in report.reference


def test_a_signal_at_rest_passes() -> None:
    report = check(build(plants.resting()))
    assert report.passed, str(report)


def test_the_whole_reference_is_compared(tmp_path: Path, train_fmu: Path) -> None:
    """Also where its length is no whole number of ten steps, or of steps."""
    for step, end in ((0.03, 0.99), (0.05, 0.97)):
        rows = "".join(f"{k / 100},{0.0 if k < 90 else 50.0}\n" for k in range(int(end * 100) + 1))
        reference = tmp_path / "ref.csv"
        reference.write_text(f"time,speed\n{rows}")
        report = check(train_fmu, reference=reference, step=step)
        assert not report.passed
        assert report.comparisons[0].time > 0.89


def test_a_start_value_that_is_no_number_is_told(tmp_path: Path, train_fmu: Path) -> None:
    path = rewrite(train_fmu, tmp_path / "s.fmu", in_xml('start="2.2"', 'start="abc"'))
    found = failed(check(path))
    assert "the start value 'abc' of gain is no Real" in found["value references"]


def test_a_guid_missing_in_another_platforms_binary_is_found(
    tmp_path: Path, train_fmu: Path
) -> None:
    path = tmp_path / "two.fmu"
    path.write_bytes(train_fmu.read_bytes())
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("binaries/win64/second_order_train.dll", b"MZ of something else")
    found = failed(check(path))
    assert "win64/second_order_train.dll does not hold the GUID" in found["GUID"]


# A wrong solver or wrong equations in the binary must show against the reference.


def test_the_binary_of_another_model_is_found(tmp_path: Path, train_fmu: Path) -> None:
    other = build(second_order_train(), inner_step=0.5)
    with zipfile.ZipFile(other) as archive:
        binary = archive.read("binaries/linux64/second_order_train.so")
    path = rewrite(
        train_fmu, tmp_path / "o.fmu", lambda n, d: (n, binary if "binaries" in n else d)
    )
    found = failed(check(path))
    assert "the binary refuses the description's GUID" in found["GUID"]


@pytest.mark.parametrize(
    ("change", "rule", "message"),
    [
        (in_xml(r'guid="\{........', 'guid="{00000000'), "contents", "not the hash"),
        (in_xml(r'guid="\{........', 'guid="{00000000'), "GUID", "refuses the description's GUID"),
        (in_xml('start="2.2"', 'start="2.3"'), "contents", "not the hash"),
        (
            in_xml(r'name="gain" valueReference="5"', 'name="gain" valueReference="6"'),
            "value references",
            "gain and natural_frequency share value reference 6 but start differently",
        ),
        (
            in_xml(r"<InitialUnknowns>.*</InitialUnknowns>", ""),
            "FMPy's validation",
            "InitialUnknowns",
        ),
        (in_xml(r'<Unknown index="2" dependencies="2" />', ""), "FMPy's validation", "Outputs"),
        (in_xml(r'<Unit name="m/s">.*?</Unit>', ""), "units", "'m/s' of speed is not defined"),
        (in_xml(r' start="0.0"', ""), "FMPy's validation", "start"),
        (in_xml('name="gain"', 'name="speed"'), "FMPy's validation", "not unique"),
        (in_xml('name="gain"', 'name="1 gain"'), "FMPy's validation", "legal variable name"),
    ],
)
def test_mutations_of_the_description_are_found(
    tmp_path: Path, train_fmu: Path, change, rule: str, message: str
) -> None:
    found = failed(check(rewrite(train_fmu, tmp_path / "m.fmu", change)))
    assert message in found[rule]


def test_equations_that_are_not_the_binarys_are_found(tmp_path: Path, train_fmu: Path) -> None:
    """The equations of another plant with the same variables: contents and reference both tell."""
    import casadi as ca

    with zipfile.ZipFile(train_fmu) as archive:
        function = ca.Function.deserialize(archive.read("resources/equations.casadi").decode())
    t, x, u, p = (ca.MX.sym(n, *function.size_in(i)) for i, n in enumerate("txup"))
    dx, y = function(t, x, u, p)
    other = ca.Function(
        "equations", [t, x, u, p], [1.001 * dx, y], ["t", "x", "u", "p"], ["dx", "y"]
    )
    path = rewrite(
        train_fmu,
        tmp_path / "e.fmu",
        lambda n, d: (n, other.serialize().encode() if n.endswith(".casadi") else d),
    )
    report = check(path)
    assert "contents" in failed(report)
    assert any(not c.passed for c in report.comparisons)


def test_a_garbage_binary_is_found(tmp_path: Path, train_fmu: Path) -> None:
    path = rewrite(
        train_fmu, tmp_path / "g.fmu", lambda n, d: (n, b"junk" if "binaries" in n else d)
    )
    assert "cannot be loaded" in failed(check(path))["GUID"]


def test_paths_that_lead_out_and_damaged_files_are_found(tmp_path: Path, train_fmu: Path) -> None:
    out = tmp_path / "out.fmu"
    out.write_bytes(train_fmu.read_bytes())
    with zipfile.ZipFile(out, "a") as archive:
        archive.writestr("../../evil.txt", "x")
    assert "leads out of the FMU" in failed(check(out))["archive"]
    data = bytearray(train_fmu.read_bytes())
    place = data.index(b"PK\x03\x04", 4000) + 200
    data[place] ^= 0xFF
    damaged = tmp_path / "damaged.fmu"
    damaged.write_bytes(bytes(data))
    assert "damaged" in failed(check(damaged))["archive"]


def test_an_fmu_that_fails_to_run_is_told(tmp_path: Path) -> None:
    report = check(build(plants.blow_up()), stop=2.0)
    assert "x is not finite" in failed(report)["runs"]
    assert not report.passed


def test_what_cannot_be_read_at_all_is_an_error(tmp_path: Path, train_fmu: Path) -> None:
    with pytest.raises(FmuError, match="no file"):
        check(tmp_path / "none.fmu")
    with pytest.raises(FmuError, match="step must be a positive"):
        check(train_fmu, step=0.0)
    with pytest.raises(FmuError, match="tolerance must be positive"):
        check(train_fmu, tolerance=0.0)


# Reference and input files


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


def test_the_report_is_a_table(train_fmu: Path) -> None:
    lines = str(check(train_fmu)).splitlines()
    assert lines[0].startswith("second_order_train.fmu: FMI 2.0 co-simulation")
    assert lines[-1] == "passed"
    head = next(line for line in lines if "max error" in line)
    assert head.split() == ["variable", "unit", "max", "error", "at", "t", "/", "s", "tolerance"]
