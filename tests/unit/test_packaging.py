"""The wheel holds what the tree holds; imports point down; nothing heavy is loaded early."""

import ast
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import railcosim

ROOT = Path(__file__).parents[2]
ROOMS = ["base", "cosim", "models", "controllers", "fmus", "studies"]  # from the ground up
# Which rooms each may import, beside itself.
BELOW = {
    "base": set(),
    "cosim": {"base"},
    "models": {"base"},
    "controllers": {"base", "cosim"},
    "fmus": {"base", "cosim", "models"},
    "studies": {"base", "cosim", "models", "controllers", "fmus"},
}


def tracked() -> list[str]:
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("needs a git checkout to know the tree's files")
    return [name for name in done.stdout.splitlines() if (ROOT / name).exists()]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a wheel from a clean copy of the tracked files."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in tracked():
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file():
            target.write_bytes((ROOT / name).read_bytes())
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", out, source],
        check=True,
        capture_output=True,
    )
    return next(out.glob("*.whl"))


DATA = (".py", ".c", ".h", ".png", ".yaml", ".csv", ".json")


def test_the_wheel_lists_what_the_tree_holds(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        packed = {n for n in archive.namelist() if n.startswith("railcosim/")}
        others = {n.split("/")[0] for n in archive.namelist()} - {"railcosim"}
    expected = {"railcosim/__init__.py", "railcosim/cli.py", "railcosim/py.typed"}
    expected |= {
        f"railcosim/{n}" for n in tracked() if n.split("/")[0] in ROOMS and n.endswith(DATA)
    }
    assert packed == expected
    assert all(name.endswith(".dist-info") for name in others)


def test_the_wheel_works_outside_the_repository(wheel: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    code = (
        "import railcosim, sys; from railcosim.models import second_order_train; "
        "from railcosim.fmus import build; build(second_order_train()); print(railcosim.__file__)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path / "site"), "RAILCOSIM_CACHE": str(tmp_path / "cache"),
             "PATH": __import__("os").environ["PATH"]},
        capture_output=True,
        text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "site") in done.stdout


def test_packages_are_the_folders() -> None:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        listed = set(tomllib.load(stream)["tool"]["setuptools"]["packages"])
    found = {"railcosim"}
    for room in ROOMS:
        for init in (ROOT / room).rglob("__init__.py"):
            found.add("railcosim." + ".".join(init.parent.relative_to(ROOT).parts))
    assert listed == found


def test_imports_point_down() -> None:
    for room in ROOMS:
        for path in (ROOT / room).rglob("*.py"):
            place = path.relative_to(ROOT).parts[:-1]
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ImportFrom) and node.level:
                    base = place[: len(place) - (node.level - 1)]
                    target = [*base, *(node.module or "").split(".")]
                    other = next(iter(target), "")
                    data = room == "controllers" and target[:2] == ["models", "line"]
                    good = other == room or other in BELOW[room] or data
                    assert good, f"{path}: imports {other}"


def test_every_tracked_python_file_in_a_room_is_short() -> None:
    for name in tracked():
        if name.endswith(".py") and name.split("/")[0] in ROOMS:
            lines = len((ROOT / name).read_text().splitlines())
            assert lines <= 420, f"{name} has {lines} lines; about 300 is a room"


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import railcosim", ["numpy", "pandas", "casadi", "fmpy", "matplotlib"]),
        ("from railcosim import Diagram, Step, Delay", ["pandas", "casadi", "matplotlib"]),
        ("import railcosim.controllers.pid", ["casadi", "pandas", "fmpy"]),
        ("from railcosim.models.catalogue import catalogue", ["casadi"]),
        ("from railcosim.cli import _parser; _parser()", ["numpy", "casadi", "pandas", "fmpy"]),
    ],
)
def test_nothing_heavy_is_imported_before_it_is_needed(statement: str, absent: list[str]) -> None:
    code = f"import sys; {statement}; print([m for m in {absent!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_can_be_had() -> None:
    for module in (
        railcosim,
        __import__("railcosim.cosim", fromlist=["x"]),
        __import__("railcosim.models", fromlist=["x"]),
        __import__("railcosim.controllers", fromlist=["x"]),
        __import__("railcosim.fmus", fromlist=["x"]),
    ):
        for name in module.__all__:
            assert getattr(module, name) is not None
        with pytest.raises(AttributeError):
            module.nothing  # noqa: B018


def test_no_module_hides_a_public_name() -> None:
    """However the parts were imported before, the names are functions and classes."""
    code = """
import importlib, pkgutil, types
import railcosim
for package in ("railcosim.models", "railcosim.controllers", "railcosim.cosim", "railcosim.fmus",
                "railcosim.fmus.check"):
    module = importlib.import_module(package)
    for info in pkgutil.iter_modules(module.__path__):
        importlib.import_module(f"{package}.{info.name}")
    for name in module.__all__:
        assert not isinstance(getattr(module, name), types.ModuleType), (package, name)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
