"""Dispatch with lanes that are played: chunks grow, and the guilty run is found alone."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from railcosim.cosim.campaign import CampaignError, WhenLong
from railcosim.cosim.campaign.chunk import Chunk, Done
from railcosim.cosim.campaign.dispatch import DIED, Dispatch
from railcosim.cosim.campaign.executors import Answer, Lanes, lanes_for
from railcosim.cosim.campaign.parcel import pack
from railcosim.cosim.campaign.pools import Pool

PACE = 0.01  # s per run


class Played(Lanes):
    """A pool that breaks, with all that is on its way, when it gets to a deadly run."""

    def __init__(self, deadly: set[int], *, width: int = 2, shared: bool = True) -> None:
        self.deadly, self.width, self.shared = deadly, width, shared
        self.flying: list[Chunk] = []
        self.sent: list[tuple[int, ...]] = []
        self.broken, self.renewed, self.most = False, 0, 0

    def submit(self, chunk: Chunk) -> None:
        assert not self.broken
        self.flying.append(chunk)
        self.sent.append(chunk.numbers)
        self.most = max(self.most, len(self.flying))

    def answers(self) -> list[Answer]:
        chunk = self.flying.pop(0)
        if self.deadly & set(chunk.numbers):
            lost = [chunk, *self.flying] if self.shared else [chunk]
            self.broken = self.shared
            self.flying = [] if self.shared else self.flying
            return [(c, None) for c in lost]
        records: list[dict[str, Any]] = [{"run": n} for n in chunk.numbers]
        return [(chunk, Done(records, seconds=PACE * len(records)))]

    def renew(self) -> None:
        assert not self.flying
        self.broken = False
        self.renewed += 1


def dispatched(lanes: Lanes, count: int) -> tuple[list[int], dict[int, str]]:
    parcel = pack(None)
    taken: list[int] = []
    buried: dict[int, str] = {}
    Dispatch(
        lanes,
        make=lambda numbers: Chunk(parcel, tuple(numbers), (None,) * len(numbers), "me"),
        take=lambda done: taken.extend(r["run"] for r in done.records),
        bury=lambda chunk, words: buried.update({chunk.numbers[0]: words}),
        timeout=None,
    ).run(range(count))
    return taken, buried


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("deadly", [set(), {0}, {999}, {0, 1, 2, 3}, {17, 400, 401, 700}])
def test_every_run_once_and_the_guilty_alone(deadly: set[int], shared: bool) -> None:
    lanes = Played(deadly, shared=shared)
    taken, buried = dispatched(lanes, 1000)
    assert sorted(taken) == [n for n in range(1000) if n not in deadly]
    assert buried == dict.fromkeys(deadly, DIED)
    for number in deadly:
        assert (number,) in lanes.sent


def test_chunks_grow_to_half_a_second_and_share_the_end() -> None:
    lanes = Played(set())
    dispatched(lanes, 1000)
    sizes = [len(numbers) for numbers in lanes.sent]
    assert sizes[:3] == [1, 1, 20]
    assert max(sizes) * PACE == pytest.approx(0.6, abs=PACE)
    assert sizes[-1] <= 2
    assert lanes.most == 4


def test_a_pool_starts_when_there_is_enough_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def played(chunk: Chunk) -> Done:
        records: list[dict[str, Any]] = [{"run": n} for n in chunk.numbers]
        return Done(records, seconds=PACE * len(records))

    monkeypatch.setattr("railcosim.cosim.campaign.executors.compute", played)
    for count, starts in ((300, False), (1000, True)):
        with ThreadPoolExecutor(2) as executor:
            pool = Pool(lambda executor=executor: executor)
            lanes = lanes_for(WhenLong(pool), None)
            taken, buried = dispatched(lanes, count)
            assert sorted(taken) == list(range(count))
            assert (pool.started, buried) == (starts, {})
            lanes.close()


def test_what_is_no_executor() -> None:
    with pytest.raises(CampaignError, match="executor is 'serial'"):
        lanes_for(3, None)
    with pytest.raises(CampaignError, match="workers is a number"):
        lanes_for(None, 0)
    with pytest.raises(CampaignError, match="an executor has its own"):
        lanes_for("serial", 2)
