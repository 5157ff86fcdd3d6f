"""Reader of consist files, YAML or JSON; docs/consists.md shows the format."""

from pathlib import Path
from typing import Any

from ..line.document import Document, read_document
from .checks import Unfit
from .consist import Consist, EndOfTrain
from .formation import formation
from .parts import couplers, made, vehicles
from .schema import SCHEMA, File


def read_consist(path: str | Path) -> Consist:
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
        # A vehicle's index is that in the whole train: only the first one's item is known by it.
        field, *rest = error.path
        document.fail(("train", *rest) if field == "vehicles" else error.path, error.text)


def _check_schema(document: Document) -> None:
    data = document.data
    if not isinstance(data, dict):
        document.fail((), f"this is not a mapping with keys; a consist has 'schema: {SCHEMA}'")
    found = data.get("schema")
    if found != SCHEMA:
        what = f"the schema '{found}' is not a consist's" if found else "'schema' is missing"
        document.fail(("schema",) if found else (), f"{what}; a consist has 'schema: {SCHEMA}'")
