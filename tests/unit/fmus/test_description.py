from pathlib import Path
from xml.etree import ElementTree as ET
from zipfile import ZipFile

import pytest
from fmpy import read_model_description

from railcosim.fmus import build
from railcosim.fmus.description import derivative_unit
from railcosim.models import second_order_train
from railcosim.models.solver import RungeKutta4
from tests import plants


@pytest.fixture(scope="module")
def path() -> Path:
    return build(plants.everything())


def test_variables(path: Path) -> None:
    found = {v.name: v for v in read_model_description(str(path)).modelVariables}
    expected = {
        "u[1]": ("input", "continuous", None, "0.0"),
        "power": ("output", "continuous", "calculated", None),
        "v[2]": ("output", "continuous", "exact", "-1.0"),
        "der(v[1])": ("local", "continuous", "calculated", None),
        "m[2]": ("parameter", "fixed", "exact", "2.0"),
        "c": ("parameter", "tunable", "exact", "0.5"),
        "solver.inner_step": ("parameter", "fixed", "exact", "0.002"),
    }
    for name, (causality, variability, initial, start) in expected.items():
        v = found[name]
        assert (v.causality, v.variability, v.start) == (causality, variability, start)
        assert v.initial == (initial or "exact")  # FMPy fills in an input's default
    assert (found["u[1]"].min, found["u[1]"].max) == ("-5.0", "5.0")
    assert found["der(v[1])"].unit == "m/s2"
    assert found["der(v[2])"].derivative is found["v[2]"]


def test_dependencies_are_those_of_the_equations(path: Path) -> None:
    description = read_model_description(str(path))

    def names(unknowns: list) -> dict[str, set[str]]:
        return {u.variable.name: {d.name for d in u.dependencies} for u in unknowns}

    assert names(description.outputs) == {
        "power": {"u[1]", "u[2]", "v[1]", "v[2]"},
        "momentum[1]": {"v[1]"},
        "momentum[2]": {"v[2]"},
        "v[1]": {"v[1]"},
        "v[2]": {"v[2]"},
    }
    assert names(description.derivatives) == {
        "der(v[1])": {"u[1]", "v[1]"},
        "der(v[2])": {"u[2]", "v[2]"},
    }
    assert names(description.initialUnknowns)["der(v[1])"] == {"u[1]", "v[1]", "m[1]", "c"}


def test_every_unit_is_defined_by_its_base_units(path: Path) -> None:
    with ZipFile(path) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
    units = {u.get("name"): dict(u[0].attrib) for u in root.iter("Unit")}
    used = {r.get("unit") for r in root.iter("Real")}
    assert used <= set(units)
    assert units["N.s/m"] == {"kg": "1", "s": "-1"}
    assert units["W"] == {"kg": "1", "m": "2", "s": "-3"}


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("m", "m/s"),
        ("m/s", "m/s2"),
        ("m/s2", "m/s3"),
        ("1", "1/s"),
        ("1/s", "1/s2"),
        ("N.m/rad", "N.m/(rad.s)"),
        ("N/(m.s)", "N/(m.s2)"),
        ("degC", "K/s"),
    ],
)
def test_units_of_derivatives(unit: str, expected: str) -> None:
    assert derivative_unit(unit) == expected


def test_the_guid_changes_with_the_content() -> None:
    guids = {
        read_model_description(str(build(plant, solver=RungeKutta4(inner_step=step)))).guid
        for plant in (second_order_train(), plants.integrator(), plants.integrator(start=1.0))
        for step in (0.002, 0.001)
    }
    assert len(guids) == 6
