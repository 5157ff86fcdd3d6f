from pathlib import Path

import pytest

from railcosim import models
from railcosim.base.errors import FileError, RailcosimError
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.models.catalogue import PLANTS, catalogue, plant_named

CART = """
from railcosim.models import Plant

def cart():
    with Plant("cart") as plant:
        plant.der(plant.state("x", unit="m", output=True), 1.0)
    return plant

def number():
    return 3

def broken():
    return [].x
"""


@pytest.mark.parametrize("name", PLANTS)
def test_every_plant_can_be_had(name: str) -> None:
    assert plant_named(name.replace("_", "-")).name == name


# A small train of the same kind is checked in tests/systems/test_heavy_haul_runs.py.
CHECKED = [
    pytest.param(name, marks=pytest.mark.slow if name == "heavy_haul_train" else ())
    for name in PLANTS
]


@pytest.mark.parametrize("name", CHECKED)
def test_every_plant_s_fmu_passes_its_check(name: str) -> None:
    report = check(build(plant_named(name)))
    assert report.passed, str(report)
    assert not report.unchecked, str(report)


def test_the_catalogue_is_what_the_package_exports() -> None:
    assert list(catalogue()) == list(PLANTS)
    for name in PLANTS:
        assert name in models.__all__
        assert getattr(models, name)().name == name


def test_a_users_file(tmp_path: Path) -> None:
    file = tmp_path / "cart.py"
    file.write_text(CART)
    assert plant_named(f"{file}:cart").name == "cart"
    with pytest.raises(FileError, match="no function 'card'"):
        plant_named(f"{file}:card")
    with pytest.raises(FileError, match="returns int, not a Plant"):
        plant_named(f"{file}:number")
    with pytest.raises(FileError, match=r"broken\(\) failed"):
        plant_named(f"{file}:broken")


def test_mistakes() -> None:
    with pytest.raises(RailcosimError, match="did you mean 'second_order_train'"):
        plant_named("second_order_trian")
    with pytest.raises(FileError, match="no file"):
        plant_named("nowhere.py:f")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("x if x > 0 else 0", "a CasADi symbol has no truth value: write ca.if_else"),
        ("max(x, 0.0)", "a CasADi symbol has no truth value"),
        ("math.sin(x)", "Python's math and float"),
        ("x + missing", "NameError: name 'missing'"),
        ("plant.input('u', unit='kph')", r"unknown unit 'kph' .*write 'km/h'"),
    ],
)
def test_a_mistake_in_a_users_file_has_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, message: str
) -> None:
    """Also when the file is named from where the user stands."""
    monkeypatch.chdir(tmp_path)
    head = "import math\nfrom railcosim.models import Plant\n\ndef cart():\n"
    body = "    with Plant('cart') as plant:\n        x = plant.state('x', unit='m')\n"
    Path("cart.py").write_text(f"{head}{body}        plant.der(x, {line})\n    return plant\n")
    with pytest.raises(RailcosimError, match=rf"cart\.py, line 7: .*{message}"):
        plant_named("cart.py:cart")


def test_a_file_that_is_no_python(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("def cart(:\n")
    with pytest.raises(FileError, match=r"bad\.py, line 1: invalid syntax$"):
        plant_named(f"{tmp_path / 'bad.py'}:cart")
