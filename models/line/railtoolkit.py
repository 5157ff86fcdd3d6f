"""What the two schemas of railtoolkit share: versions, and the choice among several items."""

from ...base.errors import listing, suggest
from .document import Document

VERSIONS = ("2022.05", "2024.07")


def checked_version(document: Document) -> str:
    """Return the version of the schema a file is written in; raise FileError for another one."""
    if "schema_version" not in document.data:
        document.fail((), f"'schema_version' is missing; known are {', '.join(VERSIONS)}")
    found = document.data["schema_version"]
    if not isinstance(found, str):
        document.fail(("schema_version",), f'must be a string: write it in quotes, "{found}"')
    if found not in VERSIONS:
        document.fail(
            ("schema_version",), f"version '{found}' is not known; known are {', '.join(VERSIONS)}"
        )
    return found


def chosen(document: Document, field: str, ids: list[str], name: str) -> int:
    """Return the index of the one with the id `name`, or of the only one if `name` is empty."""
    for index, identifier in enumerate(ids):
        if identifier in ids[:index]:
            document.fail((field, index, "id"), f"'{identifier}' is also the id of an earlier one")
    if not name:
        if len(ids) > 1:
            document.fail((field,), f"{len(ids)} are given; choose one by its id: {listing(ids)}")
        return 0
    if name not in ids:
        document.fail((field,), f"no '{name}'; there are: {listing(ids)}{suggest(name, ids)}")
    return ids.index(name)
