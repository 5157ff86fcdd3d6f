"""railtoolkit running paths of both versions, and what is refused."""

from pathlib import Path

import pytest

from railcosim.base.errors import FileError
from railcosim.models.line import Line, read_line

OLD = """%YAML 1.2
---
schema: https://railtoolkit.org/schema/running-path.json
schema_version: "2022.05"
paths:
  - name: Hill line
    id: hill
    points_of_interest:
      - [ 1500.0, Middle, front ]
      - [  500.0, West,   front ]
      - [ 2000.0, clear,  rear ]
      - [ 2900.0, East,   front ]
    characteristic_sections:
      - [ 500.0, 54, 0.0 ]
      - [ 800.0, 54, 4.0 ]
      - [ 2e3,   36, -2.5 ]
      - [ 3000.0, 36, 0.0 ]
"""
NEW = """schema: https://railtoolkit.org/schema/running-path.json
schema_version: "2024.07"
paths:
  - id: hill
    description: Hill line
    points_of_interest:
      - {position: 1500.0, id: Middle, groups: [Stops], measure: front}
      - {position: 500.0, id: West, groups: [stops], measure: front}
      - {position: 2000.0, id: signal, groups: [signals], measure: front}
      - {position: 2900.0, id: East, groups: [stops, signals], measure: front}
    characteristic_sections:
      - position: 500.0
        speed: 54
      - position: 800.0
        resistance: 4.0
      - {position: 2000.0, speed: 36, resistance: -2.5}
      - {position: 3000.0, track: end}
"""


def reading(folder: Path, text: str, name: str = "") -> Line:
    path = folder / "path.yaml"
    path.write_text(text, encoding="utf-8")
    return read_line(path, name)


@pytest.mark.parametrize("text", [OLD, NEW], ids=["2022.05", "2024.07"])
def test_a_path_is_read_in_si_units_from_its_own_beginning(tmp_path: Path, text: str):
    line = reading(tmp_path, text)
    assert (line.name, line.description, line.length) == ("hill", "Hill line", 2500.0)
    assert [(stop.name, stop.position) for stop in line.stops] == [
        ("West", 0.0), ("Middle", 1000.0), ("East", 2400.0)
    ]  # fmt: skip
    assert line.speed_limits == ((0.0, 15.0), (1500.0, 10.0))
    assert line.gradients == ((0.0, 0.0), (300.0, 4.0), (1500.0, -2.5))


def test_without_groups_the_points_at_the_front_are_the_stops(tmp_path: Path):
    text = NEW.replace("groups: [Stops], ", "").replace("groups: [stops], ", "")
    names = [stop.name for stop in reading(tmp_path, text.replace("stops, ", "")).stops]
    assert names == ["West", "Middle", "signal", "East"]


def test_a_path_without_points_runs_from_end_to_end(tmp_path: Path):
    head, _, tail = OLD.partition("    points_of_interest:\n")
    text = head + tail[tail.index("    characteristic") :]
    line = reading(tmp_path, text)
    assert line.section("begin", "end").length == 2500.0


def test_of_several_paths_one_is_chosen_by_its_id(tmp_path: Path):
    second = OLD[OLD.index("  - name: Hill") :].replace("id: hill", "id: other")
    assert reading(tmp_path, OLD + second, "other").name == "other"
    with pytest.raises(FileError, match="path.yaml:5: paths: 2 are given; choose .*: hill, other"):
        reading(tmp_path, OLD + second)
    with pytest.raises(FileError, match="paths: no 'othr'; there are: hill, other; did you mean"):
        reading(tmp_path, OLD + second, "othr")


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (OLD, '"2022.05"', '"2019.01"', "4: schema_version: version '2019.01' is not known; known"),
        (OLD, '"2022.05"', "2022.05", '4: schema_version: must be a string: .*"2022.05"'),
        (OLD, 'schema_version: "2022.05"\n', "", "'schema_version' is missing; known are 2022.05"),
        (OLD, "running-path.json", "track.json", "schema .*track.json' is not known, not a line"),
        (OLD, "running-path.json", "rolling-stock.json", "a rolling stock file, not a line"),
        (OLD, "id: hill", "ident: hill", r"7: paths\[0\].ident: unknown key .*mean 'id'.$"),
        (OLD, "54, 4.0", "fast, 4.0", r"15: paths\[0\].*sections\[1\]\[1\]: .*number"),
        (OLD, "54, 4.0", "-54, 4.0", r"15: paths\[0\].*sections\[1\]\[1\]: must be more than 0"),
        (OLD, "54, 4.0", "54", r"15: paths\[0\].*sections\[1\]\[2\]: one item too few"),
        (OLD, "54, 4.0", "54, 400", r"15: .*sections\[1\]: resistance: 400 ‰ is not within"),
        (OLD, "54, 4.0", "999, 4.0", r"15: .*sections\[1\]: speed: 999 km/h is not within 1 to"),
        (OLD, "54, 4.0", ".inf, 4.0", r"15: .*sections\[1\]\[1\]: .*finite number"),
        (OLD, "2e3, ", "700.0, ", r"16: .*sections\[2\]: 700 m does not lie after the 800 m"),
        (OLD, "Middle, front", "Middle, top", r"9: .*interest\[0\]\[2\]: .*front"),
        (OLD, "2900.0, East", "3900.0, East", r"12: .*interest\[3\]: 3400 m is not on the line"),
        (OLD, "Middle", "west", r"9: .*points_of_interest\[0\]: 'west' is also the name"),
        (OLD, "[ 800.0", "[ 800.0 :", "15: "),
        (OLD, "    id: hill\n", "    id: hill\n    id: vale\n", "8: 'id' is given twice, first"),
        (OLD, "    id: hill", "\tid: hill", "7: .*use spaces, not tabs"),
        (NEW, "    characteristic", "    charcteristic",
         r"11: .*unknown key 'charcteristic_sections'; .*mean 'characteristic_sections'.$"),
        (NEW, "speed: 36", "sped: 36", r"16: .*\[2\].sped: unknown key 'sped'; .*did you mean"),
        (NEW, "        speed: 54\n", "", r"12: .*sections\[0\]: the first section has no speed"),
        (NEW, "[Stops], measure: front", "[stops], measure: middle",
         r"7: .*interest\[0\]: 'Middle' is a stop measured at the train's middle"),
        (NEW, "position: 1500.0", "position: 500.0",
         r"8: .*interest\[1\]: 0 m does not lie after the 0 m before it \(the stops are"),
    ],
)  # fmt: skip
def test_a_wrong_path_is_refused_with_line_and_place(
    tmp_path: Path, text: str, old: str, new: str, message: str
):
    assert old in text
    with pytest.raises(FileError, match=rf"path\.yaml:? ?.*{message}"):
        reading(tmp_path, text.replace(old, new, 1))
