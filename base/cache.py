"""The folder for built FMUs and compiler caches, and the atomic write that keeps it whole."""

import os
import tempfile
from pathlib import Path

from .errors import FileError

VARIABLE = "RAILCOSIM_CACHE"


def cache_folder(*parts: str) -> Path:
    """Return (and make) a folder below the user's cache, or below $RAILCOSIM_CACHE if set."""
    from platformdirs import user_cache_path

    override = os.environ.get(VARIABLE)
    root = Path(override) if override else user_cache_path("railcosim", appauthor=False)
    folder = root.joinpath(*parts)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            f"cannot create the cache folder {folder} ({error.strerror}); "
            f"set {VARIABLE} to a folder you can write to"
        ) from error
    return folder


def write_atomically(path: Path, content: bytes, *, content_named: bool = False) -> None:
    """Write a file so that other processes see either none of it or all of it.

    `content_named` says that the name is a hash of the content: then a file that stands there
    already, and that Windows will not replace because another process has it open, is as good.
    """
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror}") from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        temporary.chmod(0o644)
        temporary.replace(path)
    except PermissionError as error:
        if not (content_named and path.exists()):
            raise FileError(f"cannot write {path}: {error.strerror}") from error
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)
