from pathlib import Path

import pytest

from railcosim.base.errors import FileError, RailcosimError
from railcosim.models.catalogue import PLANTS, plant_named

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
