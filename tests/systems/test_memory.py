"""Many instances, made and freed again and again: memory does not grow."""

import subprocess
import sys
from pathlib import Path

import pytest
from fmpy import extract

from railcosim.fmus import build
from tests.drivers import PLAIN, Workshop
from tests.hybrid_plants import fleet

ROUNDS, INSTANCES = 20, 100
ROOT = Path(__file__).parents[2]


def test_in_c_not_one_byte_is_left(tmp_path: Path) -> None:
    """Of both FMU types. From the second round on the bytes in use must be exactly the same."""
    driver = Workshop(tmp_path).driver(build(fleet()), PLAIN)
    rounds = driver.run("memory", ROUNDS, INSTANCES)[:-1]
    kilobytes = [int(line.split()[2]) for line in rounds]
    assert len(kilobytes) == ROUNDS
    assert kilobytes[-1] - kilobytes[1] <= 64


@pytest.mark.skipif(sys.platform != "linux", reason="measures memory by Linux's /proc")
def test_through_fmpy_memory_does_not_grow(tmp_path: Path) -> None:
    """In a process without pytest. It moves by some MB; leaked instances would be 20."""
    extract(str(build(fleet(60))), str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-m", "tests.drivers.rounds", tmp_path, str(ROUNDS), str(INSTANCES)],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    sizes = [int(line) for line in done.stdout.split()]
    assert len(sizes) == ROUNDS
    assert sizes[-1] - sizes[2] <= 4096, sizes
