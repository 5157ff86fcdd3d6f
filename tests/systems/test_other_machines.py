"""FMUs for other machines really run: a Windows DLL under Wine, an ARM library under QEMU.

The same scenario is played here and there by the same loader. Plants without library functions
must give the same bits; sin and exp may differ in the last one.
"""

import math
import shutil
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import casadi as ca
import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription

from railcosim.base.compilers import host_platform
from railcosim.fmus import export
from railcosim.models import Plant, second_order_train
from tests import hybrid_plants, machines, plants
from tests.machines import Machine

STEPS = 200


def bits(value: float) -> str:
    return struct.pack(">d", value).hex()


def numbers(line: str) -> list[float]:
    """Return the values of a line that the loader printed, such as "real 3ff0000000000000"."""
    kind, *words = line.split()
    if kind == "real":
        return [struct.unpack(">d", bytes.fromhex(word))[0] for word in words]
    return [float(word) for word in words]


def step_of(description: ModelDescription) -> float:
    experiment = description.defaultExperiment
    assert experiment is not None
    assert experiment.stepSize is not None
    return float(experiment.stepSize)


def scenario(description: ModelDescription, *, back_at: int = STEPS // 2) -> str:
    """Write a run with a sine on each real input, and one return to a saved state."""
    step = step_of(description)
    variables = description.modelVariables
    inputs = [v for v in variables if v.causality == "input" and v.type == "Real"]
    gets = []
    for kind in ("Real", "Integer", "Boolean"):
        found = [v for v in variables if v.type == kind and v.causality in {"output", "local"}]
        if found:
            gets.append(" ".join(["get", kind.lower(), *(str(v.valueReference) for v in found)]))

    def play(first: int, last: int) -> list[str]:
        lines = []
        for k in range(first, last):
            for i, v in enumerate(inputs):
                value = 0.5 * math.sin(0.1 * k + i)  # the same bits for each machine
                lines.append(f"set real {v.valueReference} {bits(value)}")
            lines += [f"step {bits(k * step)} {bits(step)}", *gets]
        return lines

    return "\n".join(
        [
            f"setup {bits(0.0)} {bits(STEPS * step)}",
            *("enter", "exit", *gets),
            *play(0, back_at),
            *("save", *play(back_at, STEPS)),
            *("load", *gets, *play(back_at, STEPS)),
            *("terminate", "reset"),
        ]
    )


def binary(fmu: Path, platform: str, folder: Path) -> Path:
    """Unpack a platform's library into a folder of its own."""
    folder.mkdir()
    with zipfile.ZipFile(fmu) as archive:
        (name,) = [n for n in archive.namelist() if n.startswith(f"binaries/{platform}/")]
        library = folder / Path(name).name
        library.write_bytes(archive.read(name))
    return library


def from_sources(fmu: Path, machine: Machine, folder: Path) -> Path:
    """Compile the sources in an FMU, as those do for whom FMI 2.0 names no platform."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder, [n for n in archive.namelist() if n.startswith("sources/")])
    library = folder / "fmu.so"
    machine.compiler.shared_library(folder / "sources" / "fmu.c", library)
    return library


@pytest.fixture(scope="session")
def windows(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    """A Windows whose drive (0.7 GB) is made at its first program and removed at the end."""
    prefix = tmp_path_factory.mktemp("windows")
    machine = machines.windows(prefix)
    if isinstance(machine, str):
        pytest.skip(machine)
    yield machine
    machines.stop_windows(machine)
    shutil.rmtree(prefix, ignore_errors=True)


@pytest.fixture(scope="session")
def arm_linux() -> Machine:
    machine = machines.arm_linux()
    if isinstance(machine, str):
        pytest.skip(machine)
    return machine


@pytest.fixture(params=["win64", "linux-aarch64"])
def other(request: pytest.FixtureRequest) -> Machine:
    return request.getfixturevalue("windows" if request.param == "win64" else "arm_linux")


def deep() -> Plant:
    """A right-hand side with a large stack frame, which Windows must be asked for page by page."""
    n = 24
    a = ca.SX.sym("a", n)
    pulls = [sum((a[j] - a[i]) / (1.0 + (a[j] - a[i]) ** 2) for j in range(n)) for i in range(n)]
    pull = ca.Function("pull", [a], [ca.vertcat(*pulls)])
    with Plant("deep", stop=2.0, step=0.01) as plant:
        x = plant.state("x", unit="1", size=n, start=[0.1 * i for i in range(n)], output=True)
        plant.der(x, pull(x))
    return plant


def exported(plant: Plant, other: Machine, folder: Path) -> Path:
    """Export a plant for this machine, and for Windows if that is the other one."""
    platforms = {host_platform()} | ({"win64"} if other.name == "win64" else set())
    return export(plant, folder / "plant.fmu", platforms=sorted(platforms))


def library_for(fmu: Path, other: Machine, folder: Path) -> Path:
    if other.name == "win64":
        return binary(fmu, "win64", folder)
    return from_sources(fmu, other, folder)


def play(plant: Plant, other: Machine, folder: Path) -> tuple[list[str], list[str]]:
    """Return what the loader prints here and on the other machine."""
    fmu = exported(plant, other, folder)
    description = read_model_description(str(fmu))
    here = binary(fmu, host_platform(), folder / "here")
    there = library_for(fmu, other, folder / "there")
    text, guid = scenario(description), str(description.guid)
    return machines.here().run(here, guid, text), other.run(there, guid, text)


def check_return(lines: list[str]) -> None:
    """After the return to the saved state, the second half must be the first one again."""
    head, groups = lines[0], lines[1:]
    assert head == "2.0 default"
    width = len(groups) // (1 + STEPS + 1 + STEPS // 2)
    assert len(groups) == width * (1 + STEPS + 1 + STEPS // 2)
    half = width * (1 + STEPS // 2)
    once, again = groups[half - width : width * (1 + STEPS)], groups[width * (1 + STEPS) :]
    assert once == again
    assert len(set(once)) > 1


@pytest.mark.parametrize("plant", [second_order_train, hybrid_plants.ball, deep])
def test_a_plant_of_arithmetic_gives_the_same_bits(
    plant: Callable[[], Plant], other: Machine, tmp_path: Path
) -> None:
    """Without and with events: the ball bounces several times, and counts it in an integer."""
    here, there = play(plant(), other, tmp_path)
    check_return(there)
    assert there == here


@pytest.mark.parametrize("plant", [plants.pendulum, plants.everything])
def test_library_functions_agree_to_rounding(
    plant: Callable[[], Plant], other: Machine, tmp_path: Path
) -> None:
    here, there = play(plant(), other, tmp_path)
    check_return(there)
    assert len(here) == len(there)
    for ours, theirs in zip(here[1:], there[1:], strict=True):
        assert numbers(theirs) == pytest.approx(numbers(ours), rel=0, abs=1e-12)


def test_a_wrong_guid_is_refused_with_words(other: Machine, tmp_path: Path) -> None:
    library = library_for(exported(second_order_train(), other, tmp_path), other, tmp_path / "t")
    said = other.run(library, "{another}", "enter", fails=True)
    assert any("the GUID is not this binary's" in line for line in said)
    assert any("fmi2Instantiate" in line for line in said)
