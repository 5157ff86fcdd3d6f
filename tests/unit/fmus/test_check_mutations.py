"""`check` on mutations of a good FMU: each is found, by a rule that any FMU is held to."""

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import pytest

from railcosim.cli import main
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.models import second_order_train
from railcosim.models.solver import RungeKutta4
from tests import plants
from tests.unit.cosim.test_fmu_block import rewrite
from tests.unit.fmus.test_check import failed

OURS = "contents"  # the rule that only FMUs of ours have: it must not be the one that finds


def in_xml(old: str, new: str) -> Callable[[str, bytes], tuple[str, bytes]]:
    def change(name: str, data: bytes) -> tuple[str, bytes]:
        if name == "modelDescription.xml":
            text = data.decode()
            assert re.search(old, text, re.DOTALL), old
            data = re.sub(old, new, text, count=1, flags=re.DOTALL).encode()
        return name, data

    return change


@pytest.fixture(scope="module")
def everything() -> Path:
    return build(plants.everything())


OUTPUT = r'(<Outputs>\s*)<Unknown index="\d+" dependencies="[\d ]*" />'
INITIAL = r'(<InitialUnknowns>\s*)<Unknown index="\d+" dependencies="[\d ]*" />'


@pytest.mark.parametrize(
    ("change", "rule", "message"),
    [
        (in_xml(INITIAL, r"\1"), "model structure", "power is missing in InitialUnknowns"),
        (
            in_xml(r"<InitialUnknowns>.*</InitialUnknowns>", ""),
            "model structure",
            "momentum[1] is missing in InitialUnknowns",
        ),
        (in_xml(OUTPUT, r"\1"), "model structure", "power is missing in Outputs"),
        (
            in_xml(OUTPUT, r'\1<Unknown index="4" />'),
            "model structure",
            "momentum[1] stands 2 times in Outputs",
        ),
        (in_xml(r'guid="\{........', 'guid="{00000000'), "GUID", "refuses the description's GUID"),
        (
            in_xml(r'name="m\[1\]" valueReference="\d+"', 'name="m[1]" valueReference="7"'),
            "value references",
            "m[1] and m[2] share value reference 7 but start differently",
        ),
        (
            in_xml(r'(<Real unit="N" min="-5.0" max="5.0") start="0.0"', r"\1"),
            "start values",
            "u[1] (input) needs a start value",
        ),
        (in_xml(r'name="c"', 'name="power"'), "names", "2 variables are named 'power'"),
        (
            in_xml(r'(<Derivatives>\s*<Unknown index="\d+" dependencies=")', r"\g<1>99 "),
            "model structure",
            "name variable 99; there are 1 to 13",
        ),
        (
            in_xml(r'(<Outputs>\s*<Unknown index="\d+" dependencies=")', r"\g<1>0 "),
            "model structure",
            "name variable 0; there are 1 to 13",
        ),
        (
            in_xml(r'<Outputs>\s*<Unknown index="\d+"', '<Outputs><Unknown index="one"'),
            "model structure",
            "name variable one",
        ),
        (in_xml(r'derivative="\d+"', 'derivative="77"'), "model structure", "variable 77"),
        (in_xml(r'<Unit name="m/s">.*?</Unit>', ""), "units", "'m/s' of v[1] is not defined"),
        (in_xml('name="c"', 'name="1 c"'), "FMPy's validation", "legal variable name"),
        (in_xml('unit="W"', 'unit="W" start="1.0"'), "start values", "power is calculated"),
        (in_xml('start="0.5"', 'start="abc"'), "start values", "'abc' of c is no Real"),
        (in_xml('start="0.5"', 'start="0.25"'), "initial values", "c starts at 0.5, by the desc"),
        (
            in_xml('min="0.1" start="1.0"', 'min="0.1" start="0.01"'),
            "start values",
            "m[1] starts at 0.01, outside",
        ),
        (in_xml('stepSize="0.01"', 'stepSize="0"'), "default experiment", "is not positive"),
        (in_xml('dependencies="1 ', 'dependencies="'), "dependencies", "power depends on u[1]"),
        (
            in_xml('name="logAll"', 'name="logMore"'),
            "log categories",
            "logMore is not taken",
        ),
    ],
)  # fmt: skip
def test_mutations_of_the_description_are_found(
    tmp_path: Path, everything: Path, change, rule: str, message: str
) -> None:
    found = failed(check(rewrite(everything, tmp_path / "m.fmu", change), stop=0.3))
    assert message in found[rule]
    assert rule != OURS


def swapped(path: Path, target: Path, binary: bytes) -> Path:
    return rewrite(path, target, lambda n, d: (n, binary if "binaries" in n else d))


def binary_in(path: Path) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return next(archive.read(n) for n in archive.namelist() if n.startswith("binaries/"))


def test_the_binary_of_another_model_is_found(tmp_path: Path, train_fmu: Path) -> None:
    other = build(second_order_train(), solver=RungeKutta4(inner_step=0.5))
    found = failed(check(swapped(train_fmu, tmp_path / "o.fmu", binary_in(other))))
    assert "the binary refuses the description's GUID" in found["GUID"]


def test_the_binary_of_another_model_is_found_even_with_the_guid_patched(
    tmp_path: Path, everything: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real_sin = ca.sin

    def guid(path: Path) -> bytes:
        with zipfile.ZipFile(path) as archive:
            return re.findall(rb'guid="(.*?)"', archive.read("modelDescription.xml"))[0]

    monkeypatch.setattr(ca, "sin", lambda x: 1.0001 * real_sin(x))
    other = build(plants.everything())
    monkeypatch.undo()
    assert guid(other) != guid(everything)
    binary = binary_in(other).replace(guid(other), guid(everything))
    report = check(swapped(everything, tmp_path / "o.fmu", binary))
    assert "by its equations" in failed(report)["equations"]
    assert any(not c.passed for c in report.comparisons)
    assert OURS not in failed(report)


def test_a_garbage_binary_is_found(tmp_path: Path, train_fmu: Path) -> None:
    found = failed(check(swapped(train_fmu, tmp_path / "g.fmu", b"junk")))
    assert "cannot be loaded" in found["GUID"]


def test_a_missing_binary_is_told(tmp_path: Path, train_fmu: Path) -> None:
    bare = rewrite(
        train_fmu, tmp_path / "bare.fmu", lambda n, d: None if "binaries" in n else (n, d)
    )
    assert "has no binary for" in failed(check(bare))["binary"]


def test_a_guid_missing_in_another_platforms_binary_is_found(
    tmp_path: Path, train_fmu: Path
) -> None:
    path = tmp_path / "two.fmu"
    path.write_bytes(train_fmu.read_bytes())
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("binaries/win64/second_order_train.dll", b"MZ of something else")
    found = failed(check(path))
    assert "win64/second_order_train.dll does not hold the GUID" in found["GUID"]


def test_equations_that_are_not_the_binarys_are_found(tmp_path: Path, train_fmu: Path) -> None:
    """The equations of another plant with the same variables."""
    with zipfile.ZipFile(train_fmu) as archive:
        function = ca.Function.deserialize(archive.read("resources/equations.casadi").decode())
    symbols = [ca.MX.sym(n, *function.size_in(n)) for n in function.name_in()]
    dx, y = function(*symbols)
    names = (function.name_in(), function.name_out())
    other = ca.Function("equations", symbols, [1.001 * dx, y], *names)
    path = rewrite(
        train_fmu,
        tmp_path / "e.fmu",
        lambda n, d: (n, other.serialize().encode() if n.endswith(".casadi") else d),
    )
    report = check(path)
    assert {OURS, "equations"} <= failed(report).keys()
    assert any(not c.passed for c in report.comparisons)


@pytest.mark.parametrize("name", ["../../evil.txt", "/evil.txt", "C:/evil.txt", "a\\..\\evil.txt"])
def test_paths_that_lead_out_are_found(tmp_path: Path, train_fmu: Path, name: str) -> None:
    out = tmp_path / "out.fmu"
    out.write_bytes(train_fmu.read_bytes())
    with zipfile.ZipFile(out, "a") as archive:
        archive.writestr(name, "x")
    assert "leads out of the FMU" in failed(check(out))["archive"]
    assert not list(tmp_path.rglob("evil.txt"))


def test_damaged_files_are_found(tmp_path: Path, train_fmu: Path) -> None:
    data = bytearray(train_fmu.read_bytes())
    place = data.index(b"PK\x03\x04", 4000) + 200
    data[place] ^= 0xFF
    damaged = tmp_path / "damaged.fmu"
    damaged.write_bytes(bytes(data))
    assert "damaged" in failed(check(damaged))["archive"]


def unreadable(tmp_path: Path, train_fmu: Path) -> dict[str, tuple[Path, str]]:
    whole = train_fmu.read_bytes()
    cut, empty, text = (tmp_path / f"{n}.fmu" for n in ("cut", "empty", "text"))
    cut.write_bytes(whole[: len(whole) // 2])
    empty.write_bytes(b"")
    text.write_text("hello")
    xml = rewrite(train_fmu, tmp_path / "xml.fmu", in_xml("</fmiModelDescription>", ""))
    bare = rewrite(
        train_fmu, tmp_path / "bare.fmu", lambda n, d: None if n.endswith(".xml") else (n, d)
    )
    one = rewrite(train_fmu, tmp_path / "one.fmu", in_xml('fmiVersion="2.0"', 'fmiVersion="1.0"'))
    folder = tmp_path / "folder.fmu"
    folder.mkdir()
    return {
        "cut": (cut, "is not an FMU, or is damaged"),
        "empty": (empty, "is not an FMU, or is damaged"),
        "text": (text, "is not an FMU, or is damaged"),
        "xml": (xml, "modelDescription.xml cannot be read"),
        "bare": (bare, "it holds no modelDescription.xml"),
        "one": (one, "is an FMU of FMI 1.0; needed is FMI 2.0"),
        "folder": (folder, "cannot read"),
    }


@pytest.mark.parametrize("kind", ["cut", "empty", "text", "xml", "bare", "one", "folder"])
def test_what_is_no_fmu_is_one_clear_line(
    tmp_path: Path, train_fmu: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    path, message = unreadable(tmp_path, train_fmu)[kind]
    assert main(["check", str(path)]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1
