"""FMU files: the model description, the extracted files, the library for this machine."""

import os
import tempfile
import threading
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ...base.errors import FmuError, listing


def read_description(path: Path) -> Any:
    """Return FMPy's model description of an FMI 2.0 FMU; raise FmuError if it is none."""
    try:
        stat = path.stat()
    except (OSError, ValueError):
        if path.exists():
            raise
        raise FmuError(f"no file {path}") from None
    return _description(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _description(path: Path, mtime: int, size: int) -> Any:
    from fmpy import read_model_description

    try:
        with zipfile.ZipFile(path) as archive:
            if "modelDescription.xml" not in archive.namelist():
                raise FmuError(f"{path} is not an FMU: it holds no modelDescription.xml")
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        version = root.get("fmiVersion")
        if version != "2.0":
            raise FmuError(f"{path} is an FMU of FMI {version}; needed is FMI 2.0")
        description = read_model_description(str(path), validate=False)
    except zipfile.BadZipFile as error:
        raise FmuError(f"{path} is not an FMU, or is damaged: {error}") from error
    except OSError as error:
        raise FmuError(f"cannot read {path}: {error.strerror or error}") from error
    except FmuError:
        raise
    except Exception as error:  # FMPy and lxml raise many kinds, plain Exception among them
        words = str(error).partition("\n")[0]
        raise FmuError(f"{path}: modelDescription.xml cannot be read: {words}") from error
    return description


def is_ours(description: Any) -> bool:
    """Return whether railcosim made the FMU: then its steps end, and are never discarded."""
    return str(description.generationTool or "").startswith("railcosim")


def require_co_simulation(path: Path, description: Any) -> str:
    """Return the model identifier; raise FmuError if the FMU is not for co-simulation."""
    if description.coSimulation is None:
        raise FmuError(f"{path} has no co-simulation interface (model exchange only)")
    return description.coSimulation.modelIdentifier


# Extracted FMUs, for as long as the process lives: an instance may read its resources at any time.
_folders: dict[tuple[Path, int, int], Any] = {}  # each with the `name` of a folder
LOADING = threading.RLock()  # extraction, and FMPy's change of the working directory


def extracted(path: Path) -> Path:
    """Return the folder with the FMU's files: extracted once per process, removed at its end."""
    stat = path.stat()
    key = (path, stat.st_mtime_ns, stat.st_size)
    with LOADING:
        if key not in _folders:
            _folders[key] = _extract(path)
        return Path(_folders[key].name)


def adopt(path: Path, folder: str) -> None:
    """Use a folder where another process has extracted the FMU, and which it removes."""

    class Folder:
        name = folder

    stat = path.stat()
    _folders[path, stat.st_mtime_ns, stat.st_size] = Folder()


def _extract(path: Path) -> tempfile.TemporaryDirectory[str]:
    from fmpy import extract

    folder = tempfile.TemporaryDirectory(
        prefix=f"railcosim-{os.getpid()}-", ignore_cleanup_errors=True
    )
    try:
        extract(str(path), folder.name)
    except Exception as error:  # a damaged member, an illegal path, a full disk
        folder.cleanup()
        raise FmuError(f"{path} cannot be unpacked: {error}") from error
    return folder


def binary_of(path: Path, description: Any, identifier: str | None = None) -> Path:
    """Return the extracted library for this machine; raise FmuError if the FMU has none.

    `identifier` is the interface's model identifier, by default that for co-simulation.
    """
    from fmpy import platform, sharedLibraryExtension, supported_platforms

    identifier = identifier or require_co_simulation(path, description)
    library = extracted(path) / "binaries" / platform / f"{identifier}{sharedLibraryExtension}"
    if not library.is_file():
        has = [name for name in supported_platforms(str(path)) if name != "c-code"]
        remedy = "; its sources can be compiled: fmpy compile" if _has_sources(path) else ""
        raise FmuError(f"{path} has no binary for {platform}; it has: {listing(has)}{remedy}")
    return library


def _has_sources(path: Path) -> bool:
    with zipfile.ZipFile(path) as archive:
        return any(n.startswith("sources/") and n.endswith(".c") for n in archive.namelist())


def unit_of(variable: Any) -> str | None:
    """Return the unit that a variable or its declared type gives."""
    declared = variable.declaredType
    return variable.unit or (declared.unit if declared is not None else None)


def direct_inputs(description: Any) -> set[str]:
    """Return the inputs that some output depends on directly, by the model structure."""
    inputs = {v.name for v in description.modelVariables if v.causality == "input"}
    found: set[str] = set()
    for unknown in description.outputs:
        # No list of dependencies means that the output may depend on everything.
        known = unknown.dependencies
        found |= inputs if known is None else {v.name for v in known} & inputs
    return found


def start_of(variable: Any) -> Any:
    """Return a variable's start value in its type, or None; raise FmuError for one that is none."""
    start = variable.start
    if start is None or variable.type == "String":
        return start
    try:
        if variable.type == "Boolean":
            return {"true": True, "1": True, "false": False, "0": False}[str(start).lower()]
        return float(start) if variable.type == "Real" else int(start)
    except (ValueError, KeyError):
        raise FmuError(
            f"the start value '{start}' of {variable.name} is no {variable.type}"
        ) from None


def number_of(holder: Any, attribute: str, default: float | None = None) -> float | None:
    """Return a numeric attribute such as min or stopTime, or the default where there is none.

    Raise FmuError if it is no number.
    """
    text = getattr(holder, attribute, None)
    if text is None:
        return default
    try:
        return float(text)
    except ValueError:
        name = getattr(holder, "name", "the default experiment")
        raise FmuError(f"{attribute} of {name} is '{text}', which is no number") from None
