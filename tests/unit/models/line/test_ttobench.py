"""TTOBench tracks: read in each unit, refused with the place, and written back."""

import json
from pathlib import Path
from typing import Any

import pytest

from railcosim.base.errors import FileError, ParameterError
from railcosim.models.line import Line, Stop, beijing_line_5, read_line, write_ttobench

TRACK = """{
  "metadata": {"id": "sample", "library version": "1.1", "description": "made up"},
  "altitude": {"unit": "m", "value": 12},
  "stops": {
    "unit": "m",
    "values": [0, 900, 2000.5]
  },
  "speed limits": {
    "units": {"position": "m", "velocity": "km/h"},
    "values": [[0, 54], [600, 36], [900, 72]]
  },
  "gradients": {
    "units": {"position": "m", "slope": "permil"},
    "values": [
      [0, 0],
      [250.0, -4.5],
      [1200, 3]
    ]
  }
}
"""


def reading(folder: Path, text: str) -> Line:
    path = folder / "track.json"
    path.write_text(text, encoding="utf-8")
    return read_line(path)


def test_a_track_is_read_in_si_units(tmp_path: Path):
    line = reading(tmp_path, TRACK)
    assert (line.name, line.length, line.description) == ("sample", 2000.5, "made up")
    assert [(stop.name, stop.position) for stop in line.stops] == [
        ("S1", 0.0), ("S2", 900.0), ("S3", 2000.5)
    ]  # fmt: skip
    assert line.speed_limits == ((0.0, 15.0), (600.0, 10.0), (900.0, 20.0))
    assert line.gradients == ((0.0, 0.0), (250.0, -4.5), (1200.0, 3.0))


def test_other_units_give_the_same_line(tmp_path: Path):
    data = json.loads(TRACK)
    data["stops"] = {"unit": "km", "values": [0, 0.9, 2.0005]}
    data["speed limits"] = {
        "units": {"position": "km", "velocity": "m/s"},
        "values": [[0, 15], [0.6, 10], [0.9, 20]],
    }
    data["gradients"]["units"]["position"] = "km"
    data["gradients"]["values"] = [[0, 0], [0.25, -4.5], [1.2, 3]]
    assert reading(tmp_path, json.dumps(data)) == reading(tmp_path, TRACK)


def test_a_level_track_with_what_is_not_used_is_read(tmp_path: Path):
    data = json.loads(TRACK)
    del data["gradients"], data["altitude"]
    data["metadata"]["library version"] = "TTOBench v1.4"
    data["curvatures"] = {
        "units": {"position": "m", "radius at start": "m", "radius at end": "m"},
        "values": [[0, "infinity", "infinity"], [100, 300, 300]],
    }
    data["tunnels"] = {
        "units": {"position": "m", "length": "m", "cross section": "m^2"},
        "values": [[700, 100, 40]],
    }
    assert reading(tmp_path, json.dumps(data)).gradients == ((0.0, 0.0),)


def test_tabs_and_a_byte_order_mark_do_no_harm(tmp_path: Path):
    with pytest.raises(FileError, match=r"track.json:6: stops.values\[1\]"):
        reading(tmp_path, "\ufeff" + TRACK.replace("  ", "\t").replace("900, 2000.5", "-1, 2000.5"))


def test_stops_may_have_names(tmp_path: Path):
    data = json.loads(TRACK)
    data["metadata"]["stop names"] = ["A", "B", "C"]
    data["metadata"]["local stop names"] = ["甲", "乙", "丙"]
    line = reading(tmp_path, json.dumps(data))
    assert line.stop("乙") == Stop(name="B", position=900.0, local_name="乙")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"stops"', '"stop"', "'stops' is missing beside 'speed limits', not a line"),
        (
            '"altitude"',
            '"altitud"',
            r"3: altitud: unknown key 'altitud'; known: .*; did you mean 'altitude'",
        ),
        ('"1.1"', '"2.0"', r"2: metadata.library version: version '2.0' is not known"),
        ('"id": "sample", ', "", r"2: metadata.id: 'id' is missing"),
        ("900, 2000.5", "900, 800", r"6: stops.values\[2\]: 800 m does not lie after the 900 m"),
        ("[0, 900", "[5, 900", r"6: stops.values\[0\]: the first stop must be at 0, not 5"),
        ("900, 2000.5", "true, 2000.5", r"6: stops.values\[1\]: a number is needed \(found true\)"),
        ("2000.5", "Infinity", r"6: stops.values\[2\]: a finite number is .*\(found Infinity\)"),
        ("[0, 900, 2000.5]", "[0]", r"6: stops.values: a line needs two stops or more, not 1"),
        ("[0, 900, 2000.5]", "[]", r"6: stops.values: a line needs two stops or more, not 0"),
        ('"km/h"', '"mph"', r"9: speed limits.units.velocity: .*'km/h' or 'm/s' .*\"mph\""),
        ('"permil"', '"%"', r"13: gradients.units.slope: .*'permil' .found \"%\""),
        ("[600, 36]", '[600, "36"]', r"10: speed limits.values\[1\]\[1\]: a number without a unit"),
        ("[600, 36]", "[600]", r"10: speed limits.values\[1\]\[1\]: one item too few"),
        ("[600, 36]", "[600, 36, 1]", r"10: speed limits.values\[1\]: no more than 2 may"),
        ("[600, 36]", "[600, -36]", r"10: speed limits.values\[1\]\[1\]: -36 km/h is not within"),
        ("[900, 72]", "[9000, 72]", r"10: speed limits.values\[2\]\[0\]: 9000 m is not before"),
        ("[0, 54], ", "", r"10: speed limits.values\[0\]\[0\]: the first position must be 0"),
        ("[250.0, -4.5]", "[250.0, NaN]", r"16: gradients.values\[1\]\[1\]: .*finite number"),
        ("[250.0, -4.5]", "[250.0, 450]", r"16: gradients.values\[1\]\[1\]: 450 ‰ is not within"),
        ("[1200, 3]", "[250, 3]", r"17: gradients.values\[2\]\[0\]: 250 m does not lie after"),
        ("[1200, 3]", "[2000.5, 3]", r"17: gradients.values\[2\]\[0\]: 2000.5 m is not before"),
        ('"unit": "m",\n', "", r"4: stops.unit: 'unit' is missing"),
        ("[1200, 3]\n", "[1200, 3\n", r"19: not valid JSON: Expecting"),
        ('"altitude"', '"stops": 1, "altitude"', r"4: 'stops' is given twice, first in line 3"),
        (
            'made up"',
            'made up", "stop names": ["A"]',
            "2: metadata.stop names: 1 names for 3",
        ),
    ],
)
def test_a_wrong_track_is_refused_with_line_and_place(
    tmp_path: Path, old: str, new: str, message: str
):
    assert TRACK.count(old) >= 1
    with pytest.raises(FileError, match=rf"track\.json:? ?.*{message}"):
        reading(tmp_path, TRACK.replace(old, new, 1))


def test_what_is_written_is_read_as_the_same_line(tmp_path: Path):
    for line in (beijing_line_5(), reading(tmp_path, TRACK)):
        path = tmp_path / f"{line.name}.json"
        write_ttobench(line, path)
        assert read_line(path) == line
        data: Any = json.loads(path.read_text(encoding="utf-8"))
        assert data["stops"]["values"][-1] == line.length


def test_a_line_beyond_its_last_stop_cannot_be_written(tmp_path: Path):
    stops = (Stop(name="a", position=0.0), Stop(name="b", position=8.0))
    line = Line(name="x", length=9.0, stops=stops, speed_limits=((0.0, 9.0),))
    with pytest.raises(ParameterError, match="does not begin and end at a stop"):
        write_ttobench(line, tmp_path / "x.json")
