"""One door for files of lines and trains: the format is recognised by what is in the file."""

from pathlib import Path
from typing import Any

from ...base.errors import FileError
from . import rolling_stock, running_path
from .document import Document, read_document
from .line import Line
from .rolling_stock import train_from_rolling_stock
from .running_path import line_from_running_path
from .train import Train
from .ttobench import is_track, line_from_ttobench

_LINES = "a TTOBench track (JSON) or a railtoolkit running path (YAML)"
_TRAINS = "a railtoolkit rolling stock file (YAML)"


def read_line(path: str | Path, name: str = "") -> Line:
    """Read a line from a TTOBench track or a railtoolkit running path, in SI units.

    `name` is the id of the path, which is needed only if the file has several. Raise FileError,
    with the line of the file and the place in it, for a file that is neither or is wrong.
    """
    document = read_document(path)
    kind = _kind(document)
    if kind == "track":
        line = line_from_ttobench(document)
        if name not in ("", line.name):
            document.fail(("metadata", "id"), f"the only line is '{line.name}', not '{name}'")
        return line
    if kind == running_path.SCHEMA:
        return line_from_running_path(document, name)
    raise FileError(f"{path}: {_what(document, kind)}, not a line; expected {_LINES}")


def read_train(path: str | Path, name: str = "") -> Train:
    """Read a train from a railtoolkit rolling stock file, in SI units.

    `name` is the id of the train, which is needed only if the file has several. Raise FileError,
    with the line of the file and the place in it, for a file that is not one or is wrong.
    """
    document = read_document(path)
    kind = _kind(document)
    if kind == rolling_stock.SCHEMA:
        return train_from_rolling_stock(document, name)
    raise FileError(f"{path}: {_what(document, kind)}, not a train to be read; expected {_TRAINS}")


def _kind(document: Document) -> str:
    data: Any = document.data
    if is_track(data):
        return "track"
    return str(data.get("schema", "")) if isinstance(data, dict) else ""


def _what(document: Document, kind: str) -> str:
    data = document.data
    if kind in (running_path.SCHEMA, rolling_stock.SCHEMA, "track"):
        names = {running_path.SCHEMA: "running path", rolling_stock.SCHEMA: "rolling stock file"}
        return f"this is a {names.get(kind, 'TTOBench track')}"
    if kind:
        return f"the schema '{kind}' is not known"
    if not isinstance(data, dict):
        return "this is not a mapping with keys"
    if "max traction force" in data:
        return "this is a TTOBench train, which has no length"
    near = [key for key in ("stops", "speed limits") if key in data]
    if near:
        missing = "speed limits" if near == ["stops"] else "stops"
        return f"'{missing}' is missing beside '{near[0]}'"
    keys = ", ".join(str(key) for key in list(data)[:5])
    return f"the keys ({keys or 'none'}) and no 'schema' tell no known format"
