"""Parcels: functions by value, FMUs by content."""

import hashlib
import threading
from pathlib import Path

import pytest

from railcosim import Fmu
from railcosim.cosim.campaign import CampaignError
from railcosim.cosim.campaign.parcel import MissingError, pack, stored, unpack, without_places


@pytest.fixture
def fmu(tmp_path: Path, train_fmu: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "mine.fmu"
    path.write_bytes(train_fmu.read_bytes())
    return path


def test_functions_by_value() -> None:
    k = 3
    assert unpack(pack(lambda x: k * x), {})(2) == 6


def test_an_fmu_that_is_there_is_used_where_it_is(fmu: Path) -> None:
    block = unpack(pack(Fmu(fmu, gain=2.0)), {})
    assert block.path == fmu
    assert block.values == {"gain": 2.0}


def test_an_fmu_that_is_not_there_is_asked_for(fmu: Path) -> None:
    parcel, content = pack([Fmu(fmu), fmu]), fmu.read_bytes()
    (digest,) = parcel.files
    assert parcel.bytes_of(digest) == content
    fmu.unlink()
    with pytest.raises(MissingError) as caught:
        unpack(parcel, {})
    assert caught.value.digests == [digest]
    with pytest.raises(CampaignError, match=r"the FMU mine\.fmu arrived damaged"):
        unpack(parcel, {digest: content[:-1]})
    assert not stored(digest).exists()
    stored(digest).write_bytes(content[: len(content) // 2])  # left there by something killed
    with pytest.raises(MissingError):
        unpack(parcel, {})
    block, path = unpack(parcel, {digest: content})
    assert block.path == path == stored(digest)
    assert hashlib.sha256(path.read_bytes()).hexdigest() == digest
    assert unpack(parcel, {})[1] == stored(digest)  # once is enough
    for place in (fmu, stored(digest)):
        assert without_places(f"{place} failed", parcel) == "mine.fmu failed"


def test_an_fmu_that_changes_meanwhile(fmu: Path) -> None:
    parcel = pack(fmu)
    fmu.write_bytes(b"another")
    with pytest.raises(CampaignError, match="has changed while the campaign runs"):
        parcel.bytes_of(next(iter(parcel.files)))


def test_what_cannot_travel() -> None:
    lock = threading.Lock()
    with pytest.raises(CampaignError, match=r"cannot be sent to a worker: .*lock"):
        pack(lambda: lock)
