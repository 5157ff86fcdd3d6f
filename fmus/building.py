"""Plant -> .fmu: into the cache for this machine (`build`), or to a file for others (`export`)."""

import hashlib
import json
import tempfile
import uuid
import zipfile
from collections.abc import Sequence
from importlib import resources
from importlib.metadata import version
from io import BytesIO
from pathlib import Path

from ..base.cache import cache_folder, write_atomically
from ..base.compilers import (
    FLAGS,
    KIND_FLAGS,
    SUFFIXES,
    TARGETS,
    Compiler,
    host_platform,
    machine,
    native_compiler,
    zig_compiler,
)
from ..base.errors import FileError, ParameterError, listing, suggest
from ..models.expressions import exact_expressions
from ..models.plant import Plant
from .code import GUID_MARK, plant_c, plant_h
from .description import model_description
from .layout import Layout
from .macho import universal_library

EQUATIONS = "resources/equations.casadi"
VARIABLES = "resources/railcosim.json"
DESCRIPTION = "modelDescription.xml"
_EPOCH = (1980, 1, 1, 0, 0, 0)  # a fixed date: the same FMU is the same bytes


def build(plant: Plant, *, inner_step: float = 0.002, compiler: str = "auto") -> Path:
    """Build a plant's FMU for this machine and return its path in the cache.

    The same plant, railcosim, compiler and flags give the same file, which is built only once.
    `inner_step` (s) is the start value of the FMU's parameter `solver.inner_step`; `compiler` is
    "auto" (the system's C compiler if there is one, else zig), "system" or "zig". Raise
    BuildError if it cannot be built.
    """
    contents = _contents(plant, inner_step)
    chosen = native_compiler(compiler)
    key = hashlib.sha256(_digest(contents))
    key.update(repr((chosen.identity, FLAGS, KIND_FLAGS, machine())).encode())
    folder = cache_folder("fmus", key.hexdigest()[:32])
    path = folder / f"{plant.name}.fmu"
    if not path.exists():
        binaries = {host_platform(): _compile(plant.name, contents, [chosen])}
        write_atomically(path, _archive(plant.name, contents, binaries), content_named=True)
    return path


def export(
    plant: Plant,
    path: str | Path,
    *,
    platforms: Sequence[str] | None = None,
    inner_step: float = 0.002,
    compiler: str = "zig",
) -> Path:
    """Write a plant's FMU with binaries for `platforms` (default: this machine's).

    Platforms are "linux64", "win64" and "darwin64". An exported FMU is made to travel, so zig
    compiles it (Linux binaries then load with any glibc from 2.17 on); compiler="system" uses
    the system's, for this machine's platform only. Return the path. Raise ParameterError for an
    unknown platform, BuildError if it cannot be built, FileError if it cannot be written.
    """
    path = Path(path)
    if isinstance(platforms, str):
        platforms = (platforms,)
    names = tuple(dict.fromkeys((host_platform(),) if platforms is None else platforms))
    if not names:
        raise ParameterError(f"no platform given; platforms: {listing(TARGETS)}")
    for name in names:
        if name not in TARGETS:
            raise ParameterError(
                f"no platform '{name}'; platforms: {listing(TARGETS)}{suggest(name, TARGETS)}"
            )
    if compiler != "zig" and names != (host_platform(),):
        raise ParameterError(f"only zig compiles for {listing(names)} on this machine")
    if not path.parent.is_dir():
        raise FileError(f"cannot write {path}: no folder {path.parent}")
    contents = _contents(plant, inner_step)
    binaries = {}
    for name in names:
        if compiler == "zig":
            chosen = [zig_compiler(target) for target in TARGETS[name]]
        else:
            chosen = [native_compiler(compiler)]
        binaries[name] = _compile(plant.name, contents, chosen, name)
    write_atomically(path, _archive(plant.name, contents, binaries))
    return path


def guid_of(contents: dict[str, bytes]) -> str:
    """Return the GUID that belongs to these files: a hash of them with the GUID itself left out.

    So the sources, the description, the equations and (through the GUID inside it) the binary
    cannot be exchanged one by one unnoticed.
    """
    return "{" + str(uuid.UUID(bytes=_digest(contents)[:16], version=5)) + "}"


def _fixed_sources() -> dict[str, bytes]:
    """Return the C files that are the same for every plant: our wrapper and FMI's headers."""
    files = {"sources/fmu.c": resources.files(__package__ or "").joinpath("c/fmu.c").read_bytes()}
    headers = resources.files("fmpy").joinpath("c-code")
    for name in ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"):
        files[f"sources/{name}"] = headers.joinpath(name).read_bytes()
    return files


def _contents(plant: Plant, inner_step: float) -> dict[str, bytes]:
    """Return all files of the FMU but the binaries, GUID included."""
    if not isinstance(plant, Plant):
        raise ParameterError(f"an FMU is built from a Plant, not from {plant!r}")
    if not isinstance(inner_step, int | float) or not 1e-9 <= inner_step < float("inf"):
        raise ParameterError(f"inner_step must be a time from 1e-9 s up, not {inner_step!r}")
    layout = Layout(plant)
    tool = f"railcosim {version('railcosim')}"
    with exact_expressions():
        equations = layout.equations().serialize()
    names = {
        "states": [s.name for s in layout.states],
        "inputs": [s.name for s in layout.inputs],
        "parameters": [s.name for s in layout.parameters],
        "outputs": [s.name for s in layout.outputs],
    }
    contents = {
        DESCRIPTION: model_description(layout, inner_step, tool).encode(),
        "sources/plant.c": plant_c(layout).encode(),
        "sources/plant.h": plant_h(layout, inner_step).encode(),
        EQUATIONS: equations.encode(),
        VARIABLES: json.dumps(names, indent=1).encode(),
        **_fixed_sources(),
    }
    guid = guid_of(contents).encode()
    return {name: data.replace(GUID_MARK.encode(), guid) for name, data in contents.items()}


def _digest(contents: dict[str, bytes]) -> bytes:
    digest = hashlib.sha256()
    for name in sorted(contents):
        digest.update(f"{name}\0{len(contents[name])}\0".encode())
        digest.update(contents[name])
    return digest.digest()


def _compile(
    name: str, contents: dict[str, bytes], compilers: list[Compiler], platform: str | None = None
) -> bytes:
    """Return the shared library; two compilers make the two slices of a universal one."""
    suffix = SUFFIXES[platform or host_platform()]
    slices = []
    with tempfile.TemporaryDirectory(prefix="railcosim-") as folder:
        for file, data in contents.items():
            if file.startswith("sources/"):
                Path(folder, Path(file).name).write_bytes(data)
        for number, compiler in enumerate(compilers):
            library = Path(folder, str(number), f"{name}{suffix}")
            library.parent.mkdir()
            compiler.shared_library(Path(folder, "fmu.c"), library)
            slices.append(library.read_bytes())
    return slices[0] if len(slices) == 1 else universal_library(slices)


def _archive(name: str, contents: dict[str, bytes], binaries: dict[str, bytes]) -> bytes:
    files = dict(contents)
    for platform, data in binaries.items():
        files[f"binaries/{platform}/{name}{SUFFIXES[platform]}"] = data
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(files, key=lambda f: (f != DESCRIPTION, f)):
            entry = zipfile.ZipInfo(file, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[file])
    return buffer.getvalue()
