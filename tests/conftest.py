"""Fixtures shared by all tests."""

from pathlib import Path

import pytest

from railcosim.fmus import build
from railcosim.models import second_order_train


@pytest.fixture(scope="session")
def train_fmu() -> Path:
    """The second-order train's FMU, built for this machine."""
    return build(second_order_train())
