from pathlib import Path

import pytest

from railcosim.base.cache import cache_folder, write_atomically
from railcosim.base.errors import FileError


def test_the_variable_moves_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "c"))
    assert cache_folder("fmus", "x") == tmp_path / "c" / "fmus" / "x"
    assert (tmp_path / "c" / "fmus" / "x").is_dir()


def test_a_cache_that_cannot_be_made_says_how_to_move_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "file"))
    with pytest.raises(FileError, match="RAILCOSIM_CACHE"):
        cache_folder("fmus")


def test_write_leaves_no_temporary_files(tmp_path: Path) -> None:
    write_atomically(tmp_path / "a", b"one")
    write_atomically(tmp_path / "a", b"two")
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() == b"two"


def test_write_into_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="missing"):
        write_atomically(tmp_path / "missing" / "a", b"")
