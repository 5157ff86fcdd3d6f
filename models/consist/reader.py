"""Reader of consist files, YAML or JSON; docs/consists.md shows the format."""

import pathlib
from typing import Any

from ..line.document import Document, read_document
from .checks import Path, Unfit
from .consist import Consist, EndOfTrain
from .formation import Formation, formation
from .parts import couplers, made, vehicles
from .schema import SCHEMA, File


def read_consist(path: str | pathlib.Path) -> Consist:
    """Read a train of vehicles and couplers from a consist file, into SI units.

    Raise FileError, with the line of the file and the place in it, for a file that is not one or is
    wrong.
    """
    document = read_document(path)
    _check_schema(document)
    file = document.validated(File)
    types, joints = vehicles(document, file), couplers(document, file)
    train = formation(document, file)
    device = file.end_of_train
    given: dict[str, Any] = {
        key: getattr(file, key)
        for key in (
            "radio_delay", "application_speed", "release_speed", "application_time", "release_time"
        )
        if getattr(file, key) is not None
    }  # fmt: skip
    try:
        return Consist(
            name=file.name,
            vehicles=tuple(types[name] for name in train.vehicles),
            couplers=tuple(joints[name] for name in train.joints),
            groups=tuple(tuple(group) for group in file.groups),
            end_of_train=device
            and made(document, ("end_of_train",), EndOfTrain, radio_delay=device.radio_delay),
            **given,
        )
    except Unfit as error:
        document.fail(_place(train, error.path), error.text)


def _place(train: Formation, path: Path) -> Path:
    """Return where a vehicle or a joint of the whole train is in the file: at its item."""
    field, *rest = path
    if field not in ("vehicles", "couplers"):
        return path
    return ("train", *(train.items[index] for index in rest if isinstance(index, int)))


def _check_schema(document: Document) -> None:
    data = document.data
    if not isinstance(data, dict):
        document.fail((), f"this is not a mapping with keys; a consist has 'schema: {SCHEMA}'")
    found = data.get("schema")
    if found != SCHEMA:
        what = f"the schema '{found}' is not a consist's" if found else "'schema' is missing"
        document.fail(("schema",) if found else (), f"{what}; a consist has 'schema: {SCHEMA}'")
