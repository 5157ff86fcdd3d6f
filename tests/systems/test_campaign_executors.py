"""The same table, bit for bit, whoever computes it; and each run alone as in the campaign."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from railcosim.cosim.campaign import Campaign, CampaignError, Processes
from railcosim.cosim.campaign import chunk as chunks
from railcosim.cosim.campaign.dask import Dask
from railcosim.cosim.campaign.parcel import digest_of, stored
from tests.campaigns import table_bytes, train_campaign
from tests.troubles import slow_or_deadly


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory, train_fmu: Path) -> Path:
    folder = tmp_path_factory.mktemp("serial")
    train_campaign(train_fmu).run(folder, executor="serial")
    return folder


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    from dask import config
    from distributed import Client, LocalCluster

    with (
        config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        Client(cluster) as made,
    ):
        yield made


@pytest.mark.parametrize("workers", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_processes(workers: int, tmp_path: Path, serial: Path, train_fmu: Path) -> None:
    train_campaign(train_fmu).run(tmp_path, workers=workers)
    assert table_bytes(tmp_path) == table_bytes(serial)


def test_threads(tmp_path: Path, serial: Path, train_fmu: Path) -> None:
    with ThreadPoolExecutor(2) as executor:
        train_campaign(train_fmu).run(tmp_path, executor=executor)
    assert table_bytes(tmp_path) == table_bytes(serial)


def test_a_pool_for_several(tmp_path: Path, serial: Path, train_fmu: Path) -> None:
    with Processes(1) as pool:
        train_campaign(train_fmu, seed=8).run(tmp_path / "other", executor=pool)
        train_campaign(train_fmu).run(tmp_path / "pool", executor=pool)
    assert table_bytes(tmp_path / "pool") == table_bytes(serial)
    assert table_bytes(tmp_path / "other") != table_bytes(serial)


def test_dask(tmp_path: Path, serial: Path, train_fmu: Path, client: Any) -> None:
    train_campaign(train_fmu).run(tmp_path / "client", executor=client)
    address = client.scheduler.address
    train_campaign(train_fmu).run(tmp_path / "address", executor=address)
    assert table_bytes(tmp_path / "client") == table_bytes(serial)
    assert table_bytes(tmp_path / "address") == table_bytes(serial)


@pytest.mark.slow
def test_a_dask_worker_that_dies(client: Any) -> None:
    """Each time Dask starts another, which takes seconds."""
    campaign = Campaign(name="deadly", work=slow_or_deadly, draws={"x": list(range(40))})
    table = campaign.run(executor=client)
    errors = table["error"].tolist()
    assert errors[13] == "the worker died in this run"
    assert sum(isinstance(error, str) for error in errors) == 1


def test_an_fmu_is_shipped_where_it_is_not(
    tmp_path: Path, serial: Path, train_fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The worker's file of that name is another one: only the content counts."""
    fmu = tmp_path / "train.fmu"
    fmu.write_bytes(train_fmu.read_bytes())
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))
    shipped = []

    def elsewhere(chunk: chunks.Chunk) -> chunks.Done:
        content = fmu.read_bytes()
        fmu.write_bytes(b"something else")
        try:
            return chunks.compute(chunk)
        finally:
            fmu.write_bytes(content)
            shipped.append(len(chunk.shipped))

    monkeypatch.setattr("railcosim.cosim.campaign.executors.compute", elsewhere)
    train_campaign(fmu).run(tmp_path / "out", executor="serial")
    assert shipped[:2] == [0, 1]
    assert set(shipped[2:]) == {0}
    assert stored(digest_of(train_fmu)).read_bytes() == train_fmu.read_bytes()
    assert table_bytes(tmp_path / "out") == table_bytes(serial)


def test_each_run_alone(train_fmu: Path) -> None:
    campaign = train_campaign(train_fmu)
    table = campaign.run(executor="serial")
    good = table[table["error"].isna()]
    for number in sorted(set(good["run"]))[::20]:
        rows = good[good["run"] == number]
        assert [row["end"] for row in campaign.rows(number)] == list(rows["end"])
        assert campaign.repeat(number)["train.speed"][-1] == rows["end"].tolist()[0]
        assert list(rows["link.time"]) == [campaign.drawn(number)["link.time"]] * 2
    bad = int(table["run"][table["error"].notna()].tolist()[0])
    with pytest.raises(ValueError, match="only"):
        campaign.rows(bad)
    assert campaign.repeat(bad)["train.speed"][-1] < 3.2


def test_a_scheduler_that_is_not_there() -> None:
    with pytest.raises(CampaignError, match="no Dask scheduler at nowhere"):
        Dask.connected("nowhere")
