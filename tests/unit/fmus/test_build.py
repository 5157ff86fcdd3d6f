import concurrent.futures
import ctypes
import multiprocessing
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from railcosim import Diagram, Fmu
from railcosim.base.compilers import TARGETS, system_compiler
from railcosim.base.errors import FileError, FmuError, ParameterError
from railcosim.fmus import build, export
from railcosim.models import second_order_train
from railcosim.models.solver import RungeKutta4
from tests import hybrid_plants, plants


def test_fmpy_finds_nothing_to_report(train_fmu: Path) -> None:
    assert validate_fmu(str(train_fmu)) == []
    for plant in (
        plants.everything(), plants.passing("passing"), plants.pendulum(), hybrid_plants.braking(),
        hybrid_plants.draft_gear(), hybrid_plants.clock(), hybrid_plants.fleet(),
        hybrid_plants.geared(),
    ):  # fmt: skip
        assert validate_fmu(str(build(plant))) == []


def test_fmpys_own_command_validates_it(train_fmu: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "validate", str(train_fmu)], capture_output=True, text=True
    )
    assert done.returncode == 0
    assert "No problems found" in done.stdout or done.stdout == ""


def test_the_cache_is_keyed_by_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, train_fmu: Path
) -> None:
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path))
    path = build(second_order_train())
    stamp = path.stat().st_mtime_ns
    assert build(second_order_train()) == path
    assert path.stat().st_mtime_ns == stamp
    assert path.read_bytes() == train_fmu.read_bytes()  # built elsewhere: the same bytes
    assert build(second_order_train(), solver=RungeKutta4(inner_step=0.001)) != path
    assert build(plants.integrator()) != build(plants.integrator(start=2.0))


def test_the_compilers_arguments_are_part_of_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    if system_compiler() is None:
        pytest.skip("no system C compiler to give arguments to")
    paths = set()
    for command in ("cc", "cc -O0"):
        monkeypatch.setenv("CC", command)
        system_compiler.cache_clear()
        paths.add(build(second_order_train()))
    monkeypatch.undo()
    system_compiler.cache_clear()
    assert len(paths) == 2


@pytest.mark.parametrize("platform", list(TARGETS))
def test_an_export_is_the_same_bytes_again(tmp_path: Path, platform: str) -> None:
    one, two = (
        export(second_order_train(), tmp_path / f"{i}.fmu", platforms=[platform]) for i in (1, 2)
    )
    assert one.read_bytes() == two.read_bytes()


def _build(folder: str) -> bytes:
    os.environ["RAILCOSIM_CACHE"] = folder
    return build(second_order_train()).read_bytes()


def test_processes_that_build_at_once_get_the_same_file(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(4, mp_context=context) as pool:
        results = list(pool.map(_build, [str(tmp_path)] * 4))
    assert len(set(results)) == 1
    folders = list((tmp_path / "fmus").iterdir())
    assert [p.name for f in folders for p in f.iterdir()] == ["second_order_train.fmu"]


def test_zig_and_the_system_compiler_give_the_same_numbers() -> None:
    if system_compiler() is None:
        pytest.skip("no system C compiler to compare zig with")

    def run(kind: str) -> bytes:
        diagram = Diagram("bits", step=0.05)
        diagram.add("train", Fmu(build(second_order_train(), compiler=kind), u=1.5))
        return diagram.run(60.0).values.tobytes()

    assert run("system") == run("zig")


def test_only_fmi_functions_are_exported(train_fmu: Path, tmp_path: Path) -> None:
    if shutil.which("nm") is None or sys.platform != "linux":
        pytest.skip("needs nm (Debian: binutils) on Linux to list exported symbols")
    for number, path in enumerate((train_fmu, build(second_order_train(), compiler="zig"))):
        with zipfile.ZipFile(path) as archive:
            library = archive.extract(
                "binaries/linux64/second_order_train.so", tmp_path / str(number)
            )
        done = subprocess.run(
            ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
        )
        names = {line.split()[-1] for line in done.stdout.splitlines()}
        assert names
        assert {n for n in names if not n.startswith("fmi2")} == set()


def test_linux_exports_need_no_newer_glibc_than_2_17(tmp_path: Path) -> None:
    path = export(second_order_train(), tmp_path / "t.fmu", platforms=["linux64"])
    with zipfile.ZipFile(path) as archive:
        library = archive.read("binaries/linux64/second_order_train.so")
    import re

    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_(\d+\.\d+)", library)}
    assert versions
    assert max(versions) <= (2, 17)


def test_all_platforms_from_one_machine(tmp_path: Path) -> None:
    path = export(second_order_train(), tmp_path / "t.fmu", platforms=list(TARGETS))
    with zipfile.ZipFile(path) as archive:
        found = {n.split("/")[1] for n in archive.namelist() if n.startswith("binaries/")}
        assert archive.read("binaries/win64/second_order_train.dll")[:2] == b"MZ"
    assert found == set(TARGETS)


def test_the_sources_inside_compile_on_their_own(train_fmu: Path, tmp_path: Path) -> None:
    """With nothing but the FMU's sources folder, and the library that comes out runs."""
    from railcosim.base.compilers import native_compiler

    with zipfile.ZipFile(train_fmu) as archive:
        archive.extractall(tmp_path)
    library = tmp_path / "again.so"
    native_compiler().shared_library(tmp_path / "sources" / "fmu.c", library)
    version = ctypes.CDLL(str(library)).fmi2GetVersion
    version.restype = ctypes.c_char_p
    assert version() == b"2.0"


def test_fmpy_compiles_the_sources(tmp_path: Path) -> None:
    """FMPy's own command builds a binary from <SourceFiles>, for both types."""
    if system_compiler() is None or sys.platform == "win32":
        pytest.skip("fmpy compile takes the system's C compiler, and there is none that works")
    path = tmp_path / "braking.fmu"
    shutil.copy(build(hybrid_plants.braking()), path)
    before = simulate_fmu(str(path), stop_time=50.0)
    done = subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(path)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for kind in ("CoSimulation", "ModelExchange"):
        after = simulate_fmu(str(path), stop_time=50.0, fmi_type=kind)
        assert after["position"][-1] == pytest.approx(before["position"][-1], rel=1e-5)


def test_export_mistakes(tmp_path: Path) -> None:
    plant = second_order_train()
    with pytest.raises(ParameterError, match="built from a Plant"):
        build(second_order_train)  # type: ignore[arg-type]  # pyright: ignore
    with pytest.raises(ParameterError, match="no platform given"):
        export(plant, tmp_path / "t.fmu", platforms=[])
    with pytest.raises(FmuError, match=r"build\(plant\) returns one"):
        Fmu(plant)  # type: ignore[arg-type]  # pyright: ignore
    with pytest.raises(ParameterError, match="no platform 'linux'; .*did you mean 'linux64'"):
        export(plant, tmp_path / "t.fmu", platforms=["linux"])
    with pytest.raises(FileError, match="no folder"):
        export(plant, tmp_path / "missing" / "t.fmu")
    with pytest.raises(ParameterError, match="inner_step"):
        build(plant, solver=RungeKutta4(inner_step=0.0))
    with pytest.raises(ParameterError, match="only zig"):
        export(plant, tmp_path / "t.fmu", platforms=["win64", "linux64"], compiler="system")
