"""Plant -> .fmu: into the cache for this machine (`build`), or to a file for others (`export`)."""

import hashlib
import json
import os
import tempfile
import uuid
import zipfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from importlib.metadata import version
from io import BytesIO
from pathlib import Path

import casadi as ca

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
from ..models.solver import Solver
from .code import GUID_MARK, METHODS, plant_c, plant_h
from .description import model_description
from .documentation import documentation_page
from .functions import Functions
from .layout import Layout
from .macho import universal_library

EQUATIONS = "resources/equations.casadi"
VARIABLES = "resources/railcosim.json"
DESCRIPTION = "modelDescription.xml"
Model = Plant | ca.DaeBuilder
_EPOCH = (1980, 1, 1, 0, 0, 0)  # a fixed date: the same FMU is the same bytes


def build(plant: Model, *, solver: Solver | None = None, compiler: str = "auto") -> Path:
    """Build a model's FMU for this machine and return its path in the cache.

    `plant` is a Plant or a casadi.DaeBuilder. The same plant, railcosim, compiler and flags give
    the same file, which is built only once. `solver` replaces the plant's own; `compiler` is
    "auto" (the system's C compiler if there is one, else zig), "system" or "zig". Raise
    BuildError if it cannot be built, DeclarationError for what cannot be expressed.
    """
    plant = _as_plant(plant)
    contents = _contents(plant, solver)
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
    plant: Model,
    path: str | Path,
    *,
    platforms: Sequence[str] | None = None,
    solver: Solver | None = None,
    compiler: str = "zig",
) -> Path:
    """Write the FMU of a plant or casadi.DaeBuilder with binaries for `platforms`.

    Platforms (by default this machine's) are "linux64", "win64" and "darwin64". An exported FMU is
    made to travel, so zig compiles it (Linux binaries then load with any glibc from 2.17 on);
    compiler="system" uses the system's, for this machine's platform only. Return the path. Raise
    ParameterError for an unknown platform, DeclarationError for what cannot be expressed,
    BuildError if it cannot be built, FileError if it cannot be written.
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
    if path.is_dir():
        raise FileError(f"cannot write {path}: it is a folder; give a file's name")
    if not path.parent.is_dir():
        raise FileError(f"cannot write {path}: no folder {path.parent}")
    plant = _as_plant(plant)
    contents = _contents(plant, solver)
    compilers = {
        name: [zig_compiler(target) for target in TARGETS[name]]
        if compiler == "zig"
        else [native_compiler(compiler)]
        for name in names
    }
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {n: pool.submit(_compile, plant.name, contents, c, n) for n, c in compilers.items()}
        binaries = {name: job.result() for name, job in jobs.items()}
    write_atomically(path, _archive(plant.name, contents, binaries))
    return path


def is_hashed(name: str) -> bool:
    """Return whether a file of the FMU's archive takes part in the GUID: all but the binaries."""
    return not name.startswith("binaries/") and not name.endswith("/")


def guid_of(contents: dict[str, bytes]) -> str:
    """Return the GUID that belongs to these files: a hash of them with the GUID itself left out.

    So the sources, the description, the equations and (through the GUID inside it) the binary
    cannot be exchanged one by one unnoticed.
    """
    return "{" + str(uuid.UUID(bytes=_digest(contents)[:16], version=5)) + "}"


def _as_plant(model: Model) -> Plant:
    if isinstance(model, Plant):
        return model
    if isinstance(model, ca.DaeBuilder):
        from ..models.dae_builder import plant_of

        return plant_of(model)
    raise ParameterError(f"an FMU is built from a Plant or a casadi.DaeBuilder, not from {model!r}")


def _fixed_sources(layout: Layout) -> dict[str, bytes]:
    """Return the C files that come as they are: our wrapper with the solver, FMI's headers."""
    method = METHODS[type(layout.solver)]
    folder = resources.files(__package__ or "").joinpath("c")
    ours = [
        name
        for name in sorted(entry.name for entry in folder.iterdir())
        if not name.startswith("solver_") and name != "error_norm.h"
    ]
    files = {
        f"sources/{name}": folder.joinpath(name).read_bytes()
        for name in (*ours, method.source, *method.needs)
    }
    headers = resources.files("fmpy").joinpath("c-code")
    for name in ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"):
        files[f"sources/{name}"] = headers.joinpath(name).read_bytes()
    return files


def _contents(plant: Plant, solver: Solver | None) -> dict[str, bytes]:
    """Return all files of the FMU but the binaries, GUID included."""
    layout = Layout(plant, solver)
    functions = Functions(layout)
    tool = f"railcosim {version('railcosim')}"
    with exact_expressions():
        equations = functions.equations.serialize()
    names = {
        "states": [s.name for s in layout.states],
        "inputs": [s.name for s in layout.inputs],
        "parameters": [s.name for s in layout.parameters],
        "discrete": [s.name for s in layout.discrete],
        "outputs": [s.name for s in layout.outputs],
    }
    contents = {
        DESCRIPTION: model_description(functions, tool).encode(),
        "sources/plant.c": plant_c(functions).encode(),
        "sources/plant.h": plant_h(functions).encode(),
        EQUATIONS: equations.encode(),
        VARIABLES: json.dumps(names, indent=1).encode(),
        "documentation/index.html": documentation_page(
            plant, tool=tool, guid=GUID_MARK, solver=layout.solver
        ).encode(),
        "model.png": resources.files(__package__ or "").joinpath("icon.png").read_bytes(),
        **_fixed_sources(layout),
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
            archive.writestr(entry, files[file], compresslevel=9)
    return buffer.getvalue()
