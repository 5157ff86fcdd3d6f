"""The two doors: what is neither a line nor a train, and files that cannot be read."""

import json
from pathlib import Path

import pytest

from railcosim.base.errors import FileError
from railcosim.models.line import read_line, read_train


@pytest.mark.parametrize("read", [read_line, read_train])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "this is not a mapping with keys"),
        ("just words", "this is not a mapping with keys"),
        ("[1, 2]", "this is not a mapping with keys"),
        ("{}", r"the keys \(none\) and no 'schema' tell no known format"),
        ("path: {id: old}", r"the keys \(path\) and no 'schema' tell no known format"),
        ('{"stops": {}}', "'speed limits' is missing beside 'stops'"),
        ('{"mass": 1, "max traction force": 2}', "a TTOBench train, which has no length"),
        ("schema: https://example.org/a.json", "schema 'https://example.org/a.json' is not known"),
        ("a: [1", ":1: expected"),
        ("a: !!python/object/apply:os.getcwd []", ":1: could not determine a constructor"),
        ("a: &x [*x]", r"the keys \(a\)"),
        ("{" * 3, "1: not valid JSON: Expecting property name"),
        ('{"a":' + "[" * 100_000 + "]" * 100_000 + "}", "cannot be read: "),
    ],
)
def test_what_is_neither_is_refused_with_what_was_expected(
    tmp_path: Path, read: type, text: str, message: str
):
    path = tmp_path / "file"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=message) as raised:
        read(path)
    if "expected a" not in message and ":" not in message:
        assert "railtoolkit" in str(raised.value)


def test_a_line_is_no_train(tmp_path: Path):
    path = tmp_path / "track.json"
    path.write_text('{"stops": {}, "speed limits": {}}')
    with pytest.raises(FileError, match="this is a TTOBench track, not a train"):
        read_train(path)


def test_files_that_cannot_be_read_are_named(tmp_path: Path):
    with pytest.raises(FileError, match=r"cannot read .*missing.yaml: No such file"):
        read_line(tmp_path / "missing.yaml")
    with pytest.raises(FileError, match=r"cannot read .*: Is a directory"):
        read_line(tmp_path)
    (tmp_path / "binary").write_bytes(b"\x93NUMPY\xff")
    with pytest.raises(FileError, match=r"binary: not a text file in UTF-8 \(byte 0\)"):
        read_line(tmp_path / "binary")


def test_yaml_means_what_its_version_1_2_says(tmp_path: Path):
    path = tmp_path / "path.yaml"
    path.write_text(
        "schema: https://railtoolkit.org/schema/running-path.json\n"
        'schema_version: "2022.05"\n'
        "paths:\n"
        "- {name: no, id: 1:30, characteristic_sections: [[0, 36, 0], [1e3, 36, 0]],\n"
        "   points_of_interest: [[0, on, front], [010, off, front]]}\n"
    )
    line = read_line(path)
    assert (line.name, line.description, line.length) == ("1:30", "no", 1000.0)
    assert [(stop.name, stop.position) for stop in line.stops] == [("on", 0.0), ("off", 10.0)]


def test_railtoolkit_files_may_be_json(tmp_path: Path):
    path = tmp_path / "path.json"
    path.write_text(json.dumps({
        "schema": "https://railtoolkit.org/schema/running-path.json",
        "schema_version": "2022.05",
        "paths": [{"name": "n", "id": "i", "characteristic_sections": [[0, 36, 0], [9, 36, 0]]}],
    }))  # fmt: skip
    assert read_line(path).length == 9.0
