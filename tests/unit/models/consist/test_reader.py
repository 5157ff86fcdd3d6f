"""Consist files: what is read, and that mistakes are refused with line, place and remedy."""

import json
import re
from pathlib import Path

import pytest
import yaml

import railcosim.models.consist
from railcosim.base.errors import FileError
from railcosim.models.consist import (
    Consist,
    Coupler,
    DraftGear,
    EndOfTrain,
    Envelope,
    Points,
    ShoeBrake,
    coal_train,
    read_consist,
)

DOCS = Path(__file__).parents[4] / "docs" / "consists.md"
EXAMPLE = Path(railcosim.models.consist.__file__).parent / "data" / "coal_train.yaml"
SHORT = """schema: railcosim-consist
schema_version: "1"
name: short
draft_gears:
  G:
    stroke: 100
    loading: {points: [[0, 0], [50, 300], [100, 1500]]}
  H: {like: G, unloading_ratio: 0.3}
couplers:
  loose: {gear: G, slack: 10, damping: 40}
  tight: {gear: H, slack: 0}
coupler: loose
vehicles:
  Engine:
    mass: 120
    length: 20
    resistance: {constant: 2, linear: 0.01, quadratic: 0.0003, starting: 5}
    traction: {points: [[0, 400], [36, 300]], power: 3000}
    electric_brake: {points: [[0, 0], [18, 200], [36, 100]]}
  Wagon:
    mass: 80
    length: 13
    resistance: {constant: 1, linear: 0.005, quadratic: 0.0001, starting: 3}
    brake: {shoes: 4, service: [[0, 0], [100, 0.5]]}
  Old: {like: Wagon, brake: null, resistance: {constant: 2}}
  Light: {like: Old, mass: 20, brake: {shoes: 8}}
sets:
  pair: {items: [{vehicle: Wagon, times: 2}], coupler: tight}
  block:
    items:
      - {set: pair, times: 2}
      - {vehicle: Old, coupler: tight}
      - {vehicle: Light}
train:
  - {vehicle: Engine}
  - {set: block}
  - {vehicle: Engine, coupler: tight, times: 2}
  - {vehicle: Wagon}
"""


def reading(folder: Path, text: str) -> Consist:
    path = folder / "train.yaml"
    path.write_text(text, encoding="utf-8")
    return read_consist(path)


def test_the_example_is_the_papers_train_to_the_last_bit():
    assert read_consist(EXAMPLE) == coal_train(end_of_train=EndOfTrain(radio_delay=1.0))


def test_the_documentations_train_is_read(tmp_path: Path):
    blocks = re.findall(r"```yaml\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    train = reading(tmp_path, blocks[0])
    assert (train.size, train.groups) == (2 + 4 * 16 + 3, ((0, 1),))
    assert [coupler.slack for coupler in train.couplers[-3:]] == [0.0095, 0.0, 0.0]
    whole = blocks[0][: blocks[0].index("train:  ")] + blocks[1]
    assert reading(tmp_path, whole).groups == ((0, 1), (101,), (201,))
    whole += "groups: [[0, 1], [101, 201]]\n"
    assert reading(tmp_path, whole).groups == ((0, 1), (101, 201))
    same = coal_train(locomotives=4, wagons=198, distributed=(0, 0, 99, 198))
    assert same.groups == ((0, 1), (101,), (201,))


def test_values_come_in_si_units(tmp_path: Path):
    train = reading(tmp_path, SHORT)
    engine, wagon = train.vehicles[0], train.vehicles[1]
    assert (engine.mass, engine.length) == (120e3, 20.0)
    assert engine.traction == Envelope(points=((0.0, 400e3), (10.0, 300e3)), power=3e6)
    assert engine.electric_brake
    assert engine.electric_brake.points == ((0.0, 0.0), (5.0, 200e3), (10.0, 100e3))
    assert wagon.brake == ShoeBrake(shoes=4, service=((0.0, 0.0), (100.0, 0.5)))
    gear = DraftGear(
        name="G", stroke=0.1, loading=Points(points=((0.0, 0.0), (0.05, 300e3), (0.1, 1500e3)))
    )
    assert train.couplers[0] == Coupler(gear=gear, slack=0.01, damping=40e3)


def test_a_type_has_what_those_give_that_it_is_like(tmp_path: Path):
    vehicles = {vehicle.name: vehicle for vehicle in reading(tmp_path, SHORT).vehicles}
    old, light, wagon = vehicles["Old"], vehicles["Light"], vehicles["Wagon"]
    assert (old.mass, old.brake, old.length) == (80e3, None, 13.0)
    assert (old.resistance.constant, old.resistance.linear) == (2.0, 0.005)
    assert (light.mass, light.brake) == (20e3, ShoeBrake())
    assert light.resistance == old.resistance != wagon.resistance


def test_a_version_needs_no_quotes(tmp_path: Path):
    assert reading(tmp_path, SHORT.replace('"1"', "1")) == reading(tmp_path, SHORT)


@pytest.mark.parametrize("stroke", ["", "stroke: null, "])
def test_points_of_its_own_give_a_gear_its_stroke(tmp_path: Path, stroke: str):
    own = f"I: {{like: G, {stroke}loading: {{points: [[0, 0], [40, 200]]}}}}"
    text = SHORT.replace("  H: {like: G", f"  {own}\n  H: {{like: I").replace("stroke: 100", "")
    train = reading(tmp_path, text)
    used = {coupler.gear.name: coupler.gear.stroke for coupler in train.couplers}
    assert used == {"G": 0.1, "H": 0.04}  # H has it from I


def test_a_curve_of_its_own_keeps_the_stroke_of_inherited_points(tmp_path: Path):
    text = SHORT.replace("stroke: 100", "").replace("{like: G", "{like: G, loading: {exponent: 2}")
    assert reading(tmp_path, text).couplers[1].gear.stroke == 0.1


def test_sets_hold_sets_and_say_what_joins_their_items(tmp_path: Path):
    train = reading(tmp_path, SHORT)
    names = "Engine Wagon Wagon Wagon Wagon Old Light Engine Engine Wagon"
    assert [vehicle.name for vehicle in train.vehicles] == names.split()
    used = [coupler.gear.name for coupler in train.couplers]
    # tight (H) within the pairs, behind Old, and behind the engines of the train's third item
    assert used == ["G", "H", "G", "H", "G", "H", "G", "H", "H"]
    assert train.groups == ((0,), (7, 8))
    assert train.couplers[1].gear.unloading_ratio == 0.3


def test_json_is_read_too(tmp_path: Path):
    path = tmp_path / "train.json"
    path.write_text(json.dumps(yaml.safe_load(SHORT), indent=1), encoding="utf-8")
    assert read_consist(path) == reading(tmp_path, SHORT)


def test_distributed_power_may_be_one_group(tmp_path: Path):
    text = SHORT + "groups: [[0, 8], [7]]\nend_of_train: {}\nradio_delay: 2\nrelease_time: 9\n"
    train = reading(tmp_path, text)
    assert train.groups == ((0, 8), (7,))
    assert train.end_of_train == EndOfTrain()
    assert (train.radio_delay, train.release_time, train.application_time) == (2.0, 9.0, 4.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 120", "mass: -120",
         r"train.yaml:15: vehicles.Engine.mass: -120 t is not within 2 to 1000 t"),
        ("mass: 120", "mass: 100000", r":15: .*mass: 100000 t is not within"),
        ("mass: 120", "mass: .nan", r":15: .*mass: a finite number is needed"),
        ("mass: 120", "mass: .inf", r":15: .*finite"),
        ("mass: 120", "mass: 1" + 400 * "0", r":15: .*mass: "),
        ("mass: 120", "mass: true", r":15: .*mass: a number is needed .found true"),
        ("mass: 120", 'mass: "120"', r':15: .*a number without a unit is .*found "120"'),
        ("mass: 120", "mass: 138 t", r':15: .*a number without a unit is .*found "138 t"'),
        ("mass: 120", "mass: 138,5", r':15: .*decimals after a point .found "138,5"'),
        ("mass: 120", "mass: [120]", r":15: .*mass: a number is needed .found a list"),
        ("slack: 10,", "slack: 10,5,", r":10: .*unknown key 5; decimals have a point"),
        ("    mass: 120", "\tmass: 120", r":15: .*use spaces, not tabs"),
        ("mass: 120", "mass:\t120", r":15: .*use spaces, not tabs"),
        ("  - {set: block}", "\t- {set: block}", r":36: .*use spaces, not tabs"),
        ("  Engine:\n", "  Diesel: Co-Co\n  Engine:\n", r":14: .*mapping with keys .*\"Co-Co\""),
        ("train:\n", "trian:\n", r":34: trian: unknown key 'trian'; .*did you mean 'train'.$"),
        ("name: short", "nam: short", r":3: nam: unknown key 'nam'; .*did you mean 'name'.$"),
        ("mass: 120", "mas: 120", r":15: .*unknown key 'mas'; known: like, mass, .*mean 'mass'"),
        ("    mass: 120\n", "", r":14: vehicles.Engine: 'mass' is missing"),
        ("length: 20", "length: 2000", r":16: .*length: 2000 m is not within 3 to 100 m"),
        ("constant: 2, linear: 0.01, ", "", r":17: .*resistance: 'constant' is missing"),
        ("constant: 2, linear", "constant: -2, linear", r":17: .*resistance.constant: -2 N/kN"),
        ("[36, 300]]", "[36, 500]]",
         r":18: vehicles.Engine.traction.points\[1\]\[1\]: 500 kN is more than the 400 kN"),
        ("[36, 300]]", "[0, 300]]", r":18: .*points\[1\]\[0\]: 0 km/h does not lie above"),
        ("[36, 300]]", "[36, 300, 1]]", r":18: vehicles.Engine.traction.points\[1\]"),
        ("power: 3000", "power: 3000000", r":18: .*power: 3e\+06 kW is not within"),
        ("[18, 200], [36, 100]", "[18, 200], [36, 100], [40, 150]",
         r":19: vehicles.Engine.electric_brake.points\[3\]\[1\]: 150 kN is more"),
        ("[100, 0.5]", "[100, 1.5]", r":24: .*brake.service\[1\]\[1\]: 1.5 is not within 0 to 1"),
        ("[[0, 0], [100, 0.5]]", "[[10, 0], [100, 0.5]]", r":24: .*service\[0\]: the first pair"),
        ("shoes: 4", "shoes: 4.5", r":24: .*shoes: a whole number is needed"),
        ("Wagon, brake: null", "Wagno, brake: null",
         r":25: vehicles.Old.like: no vehicle 'Wagno'; there are: Engine, .*mean 'Wagon'"),
        ("  Wagon:\n", "  Wagon:\n    like: Light\n",
         r":20: vehicles.Wagon: a loop: 'Wagon' is like 'Light' is like 'Old' is like 'Wagon'"),
        ("  Old:", "  Old: {}\n  Old:", r":26: 'Old' is given twice, first in line 25"),
        ("stroke: 100", "stroke: 0", r":6: draft_gears.G.stroke: 0 mm is not within"),
        ("stroke: 100", "stroke: 90", r":7: .*loading.points: the curve ends at 100 mm, not at"),
        ("[50, 300]", "[50, 0]", r":7: draft_gears.G.loading.points\[1\]\[1\]: 0 kN does not lie"),
        ("{points: [[0", "{exponent: 2, points: [[0", r":7: .*loading: either 'points' or the po"),
        ("{like: G, unl", "{like: F, unl", r":8: draft_gears.H.like: no draft gear 'F'"),
        ("slack: 10,", "slack: -10,", r":10: couplers.loose.slack: -10 mm is not within"),
        ("{gear: H, s", "{gear: MT2, s", r":11: couplers.tight.gear: no draft gear 'MT2'"),
        ("coupler: loose\n", "", r":1: 'coupler' is missing: which of the 2 couplers"),
        ("coupler: loose\n", "coupler: lose\n", r":12: coupler: .*did you mean 'loose'"),
        ("{vehicle: Wagon, times: 2}", "{vehicle: Wagon, times: 0}",
         r":28: sets.pair.items\[0\].times: must be 1 or more .found 0"),
        ("{set: pair, times: 2}", "{set: block}",
         r":29: sets.block: a loop: 'block' holds 'block'; one of them must go without"),
        ("[{vehicle: Wagon, times: 2}]", "[{set: block}]",
         r":28: sets.pair: a loop: 'pair' holds 'block' holds 'pair'"),
        ("{set: pair, times: 2}", "{set: pare, times: 2}",
         r":31: sets.block.items\[0\].set: no set 'pare'; .*did you mean 'pair'"),
        ("{set: pair, times: 2}", "{vehicle: pair, times: 2}", r":31: .*no vehicle 'pair'"),
        ("{set: pair, times: 2}", "{times: 2}", r":31: .*either 'vehicle' or 'set' is wanted"),
        ("{vehicle: Old, coupler: tight}", "{vehicle: Old, coupler: tigth}",
         r":32: sets.block.items\[1\].coupler: no coupler 'tigth'; .*mean 'tight'"),
        ("{set: block}\n  -", "{set: block, times: 833}\n  -",
         r":36: train\[1\]: that makes 4999 vehicles; a train has 2 to 1000"),
        ("  - {vehicle: Engine}\n  -", "  -", r":35: train\[0\]: 'Wagon' is no locomotive; one m"),
        ("name: short", "name: ''", r":3: name: a name is needed"),
        ("name: short", "name: short\ngroups: [[0, 3], [7, 8]]",
         r":4: groups\[0\]\[1\]: vehicle 3 .*, 'Wagon', is no locomotive; locomotives: 0, 7, 8"),
        ("name: short", "name: short\ngroups: [[0]]", r":4: groups: vehicle 7 .* in no group"),
        ("name: short", "name: short\nend_of_train: {radio_delay: -1}",
         r":4: end_of_train.radio_delay: -1 s is not within"),
        ("name: short", "name: short\nrelease_speed: 0", r":4: release_speed: 0 m/s is not with"),
        ('version: "1"', 'version: "2"', r":2: schema_version: .*; known is 1 .found"),
        ('version: "1"', "version: true", r":2: schema_version: .*; known is 1 .found true"),
        ("  - {set: block}", "  - Wagon", r":36: train\[1\]: write {vehicle: Wagon}, or {s"),
        ("name: short", "name: short\nend_of_train: true",
         r":4: end_of_train: write {} or {radio_delay: 1.0} for a device, .*found true"),
        ("name: short", "name: short\nend_of_train:", r":4: .*leave the key out .*found nothing"),
        ("damping: 40", "damping: 9000",
         r":36: train\[1\]: coupler 6 .* 9000 kN·s/m, .* 'Light' of 20 t; at most 5000 kN·s/m"),
        ("schema: railcosim-consist\n", "", r":1: 'schema' is missing; a consist has 'schema: ra"),
        ("railcosim-consist", "https://railtoolkit.org/x", r":1: schema: .* is not a consist's"),
    ],
)  # fmt: skip
def test_a_mistake_is_refused_with_its_line_and_place(
    tmp_path: Path, old: str, new: str, message: str
):
    assert SHORT.count(old) >= 1
    with pytest.raises(FileError, match=message):
        reading(tmp_path, SHORT.replace(old, new, 1))


def test_a_train_needs_two_vehicles_and_a_locomotive(tmp_path: Path):
    head = SHORT[: SHORT.index("train:\n")]
    with pytest.raises(FileError, match=r":34: train: a train has 2 to 1000 vehicles, not 1"):
        reading(tmp_path, head + "train: [{vehicle: Engine}]\n")
    with pytest.raises(FileError, match=r":34: train: no vehicle is a locomotive; give one"):
        reading(tmp_path, head + "train: [{vehicle: Wagon, times: 2}]\n")
    with pytest.raises(FileError, match=r":34: train: no fewer than 1 may"):
        reading(tmp_path, head + "train: []\n")


def test_sets_that_multiply_are_stopped_while_they_are_small(tmp_path: Path):
    sets = ["  s0: {items: [{vehicle: Wagon, times: 10}]}"]
    sets += [f"  s{n}: {{items: [{{set: s{n - 1}, times: 10}}]}}" for n in range(1, 900)]
    head = SHORT[: SHORT.index("sets:\n")]
    text = head + "sets:\n" + "\n".join(sets) + "\ntrain: [{vehicle: Engine}, {set: s899}]\n"
    with pytest.raises(FileError, match=r":31: sets.s3.items\[0\]: that makes 10000 vehicles"):
        reading(tmp_path, text)


def test_a_long_chain_of_sets_and_types_is_read(tmp_path: Path):
    types = "".join(f"  T{n}: {{like: {f'T{n - 1}' if n else 'Wagon'}}}\n" for n in range(900))
    sets = "".join(
        f"  s{n}: {{items: [{{{f'set: s{n - 1}' if n else 'vehicle: T899'}}}]}}\n"
        for n in range(900)
    )
    head = SHORT[: SHORT.index("sets:\n")]
    tail = "train: [{vehicle: Engine}, {set: s899, times: 999}]\n"
    train = reading(tmp_path, f"{head}{types}sets:\n{sets}{tail}")
    assert train.size == 1000
    assert train.vehicles[-1].mass == 80e3


@pytest.mark.parametrize("text", ["[1, 2]", "", "schema: [1]", "{", "a: b: c", "schema: 3"])
def test_what_is_not_a_consist_is_refused(tmp_path: Path, text: str):
    with pytest.raises(FileError, match=r"train.yaml"):
        reading(tmp_path, text)


def test_a_file_that_is_not_there_is_said(tmp_path: Path):
    with pytest.raises(FileError, match=r"cannot read .*none.yaml"):
        read_consist(tmp_path / "none.yaml")
