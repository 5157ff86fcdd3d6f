"""railtoolkit rolling stock of both versions, and what is refused."""

from pathlib import Path

import pytest

from railcosim.base.errors import FileError
from railcosim.models.line import Train, read_train

OLD = """%YAML 1.2
---
schema: https://railtoolkit.org/schema/rolling-stock.json
schema_version: "2022.05"
trains:
  - name: Engine with two cars
    id: short
    formation: [engine, car, car]
vehicles:
  - name: Engine
    id: engine
    vehicle_type: traction unit
    power_type: electric
    length: 16.0
    mass: 60.0
    mass_traction: 40.0
    speed_limit: 90
    a_braking: -0.5
    rotation_mass: 1.2
    base_resistance: 3.0
    rolling_resistance: 1.5
    air_resistance: 6.0
    tractive_effort:
      - [ 0.0, 120000 ]
      - [ 36.0, 100000 ]
      - [ 90.0, 30000 ]
  - name: Car
    id: car
    vehicle_type: passenger
    length: 20.0
    mass: 30.0
    load_limit: 10.0
    speed_limit: 108
    rotation_mass: 1.05
    base_resistance: 2.0
    rolling_resistance: 1.0
    air_resistance: 4.0
"""
NEW = """schema: https://railtoolkit.org/schema/rolling-stock.json
schema_version: "2024.07"
model_fidelity: detailed
trains:
  - id: unit
    description: Two units
    train_type: metro
    formation: [unit, unit]
    loading_factor: [0.5]
vehicles:
  - id: unit
    vehicle_type: multiple_unit
    length: 30.0
    mass: 40.0
    load_limit: 20.0
    speed_limit: 72
    resistance:
      model_fidelity: calculated
      rotation_mass: 1.1
      base_resistance: 2.5
      rolling_resistance: 0.5
      air_resistance: 10.0
    traction:
      model_fidelity: calculated
      rated_power: 400.0
      initial_tractive_force: 50.0
    brakes:
      model_fidelity: two-part-deceleration
      reaction_time: 0.5
      deceleration: -0.9
      emergency_deceleration: -1.1
"""


def reading(folder: Path, text: str) -> Train:
    path = folder / "train.yaml"
    path.write_text(text, encoding="utf-8")
    return read_train(path)


def test_a_train_of_2022_is_summed_over_its_formation(tmp_path: Path):
    train = reading(tmp_path, OLD)
    assert (train.name, train.description) == ("short", "Engine with two cars")
    assert (train.mass_empty, train.mass, train.mass_crush) == (120e3, 140e3, 140e3)
    assert (train.length, train.max_speed) == (56.0, 25.0)
    assert train.rotating_mass_factor == pytest.approx((60 * 1.2 + 60 * 1.05) / 120)
    assert (train.service_deceleration, train.emergency_deceleration) == (0.5, 0.5)
    assert train.max_traction_force == 120e3
    assert train.traction_force(5.0) == pytest.approx(110e3)
    assert train.traction_force(25.0) == pytest.approx(30e3)


@pytest.mark.parametrize("velocity", [0.0, 50.0, 80.0])
def test_resistance_follows_the_formulas_of_engines_and_cars(tmp_path: Path, velocity: float):
    v = velocity / 100.0
    engine = 3.0 * 40 + 1.5 * 20 + 6.0 * 60 * v**2  # ‰ times t
    cars = 80 * (2.0 + 1.0 * v + 4.0 * v**2)
    davis = reading(tmp_path, OLD).davis
    assert davis.at(velocity / 3.6) == pytest.approx((engine + cars) / 140, rel=1e-12)


def test_freight_cars_have_no_linear_resistance_and_a_weaker_brake_is_assumed(tmp_path: Path):
    text = OLD.replace("passenger", "freight").replace("    a_braking: -0.5\n", "")
    train = reading(tmp_path, text)
    assert train.davis.b == 0.0
    assert train.service_deceleration == 0.225
    text = OLD.replace("    a_braking: -0.5\n", "")
    assert reading(tmp_path, text).service_deceleration == 0.375


def test_a_train_of_2024_has_loads_power_and_an_emergency_brake(tmp_path: Path):
    train = reading(tmp_path, NEW)
    assert (train.mass_empty, train.mass, train.mass_crush) == (80e3, 100e3, 120e3)
    assert (train.max_traction_force, train.max_power) == (100e3, 800e3)
    assert (train.service_deceleration, train.emergency_deceleration) == (0.9, 1.1)
    assert train.max_speed == 20.0
    assert train.rotating_mass_factor == pytest.approx(1.1)
    assert train.davis.at(0.0) == pytest.approx(2.5)
    assert train.traction_curve == ()


def test_tables_of_tractive_effort_are_added_in_newton(tmp_path: Path):
    text = NEW.replace(
        "calculated\n      rated_power: 400.0\n      initial_tractive_force: 50.0\n",
        "table\n      tractive_effort:\n        - {speed: 0, force: 50}\n"
        "        - {speed: 36, force: 40}\n        - {speed: 72, force: 10}\n",
    )
    train = reading(tmp_path, text)
    assert train.traction_curve == ((0.0, 100e3), (10.0, 80e3), (20.0, 20e3))
    assert train.traction_force(15.0) == pytest.approx(50e3)
    with pytest.raises(FileError, match=r"train.yaml:27: .*effort\[1\]: the speeds do not rise"):
        reading(tmp_path, text.replace("speed: 36", "speed: 0"))


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (OLD, '"2022.05"', '"2023.01"', "4: schema_version: version '2023.01' is not known"),
        (OLD, "rolling-stock.json", "running-path.json", "this is a running path, not a train"),
        (OLD, "car, car]", "car, cra]",
         r"8: trains\[0\].formation\[2\]: no vehicle 'cra'; vehicles: engine, car; did you mean"),
        (OLD, "formation: [engine, car, car]", "formation: []", r"8: .*\.formation: no fewer t"),
        (OLD, "mass: 60.0", "mass: 0", r"15: vehicles\[0\].mass: must be more than 0 .found 0."),
        (OLD, "mass: 60.0", "mass: 60 t", r"15: .*number without a unit .*found \"60 t\""),
        (OLD, "mass: 60.0", "weight: 60.0", r"15: .*: unknown key 'weight'; known:"),
        (OLD, "length: 16.0", "lenght: 16.0", r"14: .*unknown key .*mean 'length'.$"),
        (OLD, "traction unit", "locomotive", r"12: vehicles\[0\].vehicle_type: .*'traction unit'"),
        (OLD, "electric", "solar", r"13: vehicles\[0\].power_type: .*'diesel', 'electric'"),
        (OLD, "a_braking: -0.5", "a_braking: 0.5", r"18: vehicles\[0\].a_braking: .*less than 0"),
        (OLD, "rotation_mass: 1.2", "rotation_mass: 0.2", r"19: .*_mass: must be 1 or more"),
        (OLD, "[ 36.0,", "[ -36.0,", r"25: .*tractive_effort\[1\]\[0\]: must be 0 or more"),
        (OLD, "[ 36.0,", "[ 0.0,", r"25: vehicles\[0\].tractive_effort\[1\]: the speeds do not"),
        (OLD, "id: car", "id: engine", r"28: vehicles\[1\].id: 'engine' is also an earlier one's"),
        (OLD, "trains:", "trans:", r"5: trans: unknown key 'trans'; .*did you mean 'trains'"),
        (NEW, "model_fidelity: detailed\n", "", "1: model_fidelity: 'model_fidelity' is missing"),
        (NEW, "detailed", "simplified", "3: model_fidelity: a simplified train has no mass"),
        (NEW, "[0.5]", "[1.5]", r"9: trains\[0\].loading_factor\[0\]: must be 1 or less"),
        (NEW, "[0.5]", "[0.1, 0.2, 0.3]", r"9: .*loading_factor: 3 factors for 2 vehicles"),
        (NEW, "    formation: [unit, unit]\n", "", r"5: trains\[0\]: 'formation' is missing"),
        (NEW, "    speed_limit: 72\n", "", r"5: trains\[0\]: no vehicle .* has a 'speed_limit'"),
        (NEW, "  model_fidelity: calculated\n      rot", "  model_fidelity: table\n      rot",
         r"17: vehicles\[0\].resistance: a table is not read"),
        (NEW, "rated_power: 400.0", "rated_power: 0", r"5: .*no vehicle .*force and a power"),
        (NEW, "      deceleration: -0.9\n", "", r"5: trains\[0\]: .*forces are not read"),
        (NEW, "emergency_deceleration: -1.1", "emergency_deceleration: -0.1",
         r"5: trains\[0\]: train 'unit': the emergency brake .* is weaker"),
        (NEW, "two-part", "four-part", r"28: vehicles\[0\].brakes.model_fidelity: .*'force'"),
        (NEW, "resistance:\n", "resistence:\n",
         r"17: vehicles\[0\].resistence: unknown key .*did you mean 'resistance'"),
    ],
)  # fmt: skip
def test_a_wrong_train_is_refused_with_line_and_place(
    tmp_path: Path, text: str, old: str, new: str, message: str
):
    assert old in text
    with pytest.raises(FileError, match=rf"train\.yaml:? ?.*{message}"):
        reading(tmp_path, text.replace(old, new, 1))


def test_vehicles_alone_and_resistance_free_trains_are_refused(tmp_path: Path):
    start, _, rest = OLD.partition("trains:\n")
    with pytest.raises(FileError, match="1: 'trains' is missing|'trains' is missing: vehicles"):
        reading(tmp_path, start + rest[rest.index("vehicles:") :])
    lines = [line for line in OLD.splitlines() if "_resistance" not in line]
    with pytest.raises(FileError, match=r"trains\[0\]: no vehicle of the train has a resistance"):
        reading(tmp_path, "\n".join(lines))
