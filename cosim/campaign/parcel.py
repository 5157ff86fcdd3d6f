"""Shipping work to a worker: pickled once, with its FMUs by the hash of their content.

An FMU's path means nothing on another machine. In a parcel it is replaced by the SHA-256 of the
file; who unpacks it uses the file of that path if it has this content, else the one in the store of
its machine, and asks for the bytes if there is none.
"""

import hashlib
import io
import os
import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import cloudpickle

from ...base.cache import cache_folder, write_atomically
from .errors import CampaignError


@dataclass(frozen=True)
class Parcel:
    """Pickled content, its hash, and the FMUs it needs: SHA-256 -> path where it was packed."""

    content: bytes
    digest: str
    files: Mapping[str, str]

    def bytes_of(self, digest: str) -> bytes:
        """Return an FMU's bytes; raise CampaignError if the file has changed since."""
        path = Path(self.files[digest])
        content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != digest:
            raise CampaignError(f"{path} has changed while the campaign runs")
        return content


class MissingError(Exception):
    """FMUs that this machine does not have; `digests` are their hashes."""

    def __init__(self, digests: list[str]) -> None:
        super().__init__(digests)
        self.digests = digests


def pack(content: Any) -> Parcel:
    """Return a parcel; functions that cannot be imported elsewhere travel by value."""
    stream = io.BytesIO()
    packer = _Packer(stream)
    try:
        packer.dump(content)
    except CampaignError:
        raise
    except Exception as error:  # pickling raises many kinds
        raise CampaignError(f"the work cannot be sent to a worker: {error}") from error
    data = stream.getvalue()
    return Parcel(data, hashlib.sha256(data).hexdigest(), packer.files)


def unpack(parcel: Parcel, shipped: Mapping[str, bytes]) -> Any:
    """Return a parcel's content; raise MissingError for FMUs that were not shipped."""
    places = {digest: _place(digest, path, shipped) for digest, path in parcel.files.items()}
    missing = [digest for digest, place in places.items() if place is None]
    if missing:
        raise MissingError(missing)
    return _Unpacker(io.BytesIO(parcel.content), places).load()


def is_fmu(value: Any) -> bool:
    """Return whether a value is the path of an FMU that is there."""
    return isinstance(value, Path) and value.suffix == ".fmu" and value.is_file()


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file's content."""
    stat = path.stat()
    return _digest(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _digest(path: Path, mtime: int, size: int) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


class _Packer(cloudpickle.Pickler):
    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream)
        self.files: dict[str, str] = {}

    def persistent_id(self, obj: Any) -> str | None:
        if not is_fmu(obj):
            return None
        digest = digest_of(obj)
        self.files[digest] = str(obj.absolute())
        return digest


class _Unpacker(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, places: Mapping[str, Path | None]) -> None:
        super().__init__(stream)
        self.places = places

    def persistent_load(self, pid: str) -> Path | None:
        return self.places[pid]


def _place(digest: str, path: str, shipped: Mapping[str, bytes]) -> Path | None:
    """Return a file of that content on this machine: where it was, or in the store."""
    for place in (Path(path), stored(digest)):
        if place.is_file() and digest_of(place) == digest:
            return place
    if digest not in shipped:
        return None
    if hashlib.sha256(shipped[digest]).hexdigest() != digest:
        raise CampaignError(f"the FMU {Path(path).name} arrived damaged")
    write_atomically(stored(digest), shipped[digest])
    return stored(digest)


def stored(digest: str) -> Path:
    """Return where an FMU of that content lies, or would lie, in this machine's store."""
    return cache_folder("shipped") / f"{digest}.fmu"


def without_places(text: str, parcel: Parcel) -> str:
    """Return a message with FMUs by name alone: their folders differ from machine to machine."""
    for digest, path in parcel.files.items():
        name = path.replace("\\", "/").rpartition("/")[2]
        for place in (path, os.fspath(stored(digest))):
            text = text.replace(place, name)
    return text
