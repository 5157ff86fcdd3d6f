"""One campaign in its folder, from where it is to the final table."""

import json
import shutil
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import journal, table
from .chunk import Chunk, Done, Job, this_process
from .dispatch import Dispatch
from .errors import CampaignError
from .executors import lanes_for
from .files import guarded, remove_parts, write_whole
from .identity import differences, fingerprint, versions
from .journal import Journal
from .lock import locked
from .parcel import Parcel, pack
from .simulate import Simulate

if TYPE_CHECKING:
    import pandas as pd

    from .definition import Campaign

DESCRIPTION = "campaign.json"
TRACES = "traces"

Progress = bool | Callable[[int], object]


def conduct(
    campaign: "Campaign",
    folder: Path | None,
    *,
    executor: Any,
    workers: int | None,
    fresh: bool,
    progress: Progress,
) -> "pd.DataFrame":
    """Run what is not done yet and return the table; see Campaign.run."""
    points = campaign.plan.points
    if isinstance(campaign.work, Simulate) and points:
        campaign.work.check(points[0])
    parcel = parcel_of(campaign)
    with ExitStack() as stack:
        if folder is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="railcosim-")))
        else:
            with guarded(folder):
                folder.mkdir(parents=True, exist_ok=True)
        stack.enter_context(locked(folder))
        _admit(description(campaign, parcel), folder, fresh=fresh)
        remove_parts(folder)
        done = Journal(folder)
        stack.callback(done.close)
        todo = [n for n in range(campaign.count) if n not in done.done]
        if todo:
            lanes = lanes_for(executor, workers)
            _compute(campaign, folder, done, todo, parcel, lanes, progress)
        return _finish(campaign, folder, done)


def description(campaign: "Campaign", parcel: Parcel) -> dict[str, Any]:
    """Return what the campaign is, in figures and hashes; all of its table depends on that."""
    return {
        "name": campaign.name,
        "runs": campaign.count,
        "seed": campaign.seed,
        "sampling": campaign.sampling,
        "timeout": campaign.timeout,
        "units": dict(campaign.units),
        "draws": fingerprint(campaign.draws),
        "work": fingerprint(campaign.work),
        "traces": fingerprint(campaign.traces),
        "fmus": {Path(path).name: digest for digest, path in sorted(parcel.files.items())},
        "versions": versions(),
    }


def _admit(now: dict[str, Any], folder: Path, *, fresh: bool) -> None:
    """Make the folder this campaign's; raise CampaignError if it is another's."""
    path = folder / DESCRIPTION
    if fresh:
        _clear(folder)
    if not path.exists():
        text = json.dumps(now, indent=1, ensure_ascii=False) + "\n"
        write_whole(path, lambda stream: stream.write(text.encode()))
        return
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CampaignError(f"cannot read {path}: {error}") from error
    found = differences(before, now)
    if found:
        raise CampaignError(
            f"{folder} holds another campaign; what differs: {', '.join(found)}. "
            "Take another folder, or begin afresh there (fresh=True, --fresh)"
        )


def _clear(folder: Path) -> None:
    """Remove what a campaign wrote; its description last, so that the rest is never taken on."""
    with guarded(folder):
        for name in (table.NAME, journal.NAME):
            (folder / name).unlink(missing_ok=True)
        shutil.rmtree(folder / TRACES, ignore_errors=True)
        (folder / DESCRIPTION).unlink(missing_ok=True)


def _compute(
    campaign: "Campaign",
    folder: Path,
    done: Journal,
    todo: list[int],
    parcel: Parcel,
    lanes: Any,
    progress: Progress,
) -> None:
    from tqdm import tqdm

    plan, master = campaign.plan, this_process()
    bar = tqdm(
        total=campaign.count,
        initial=campaign.count - len(todo),
        desc=campaign.name,
        unit=" runs",
        disable=None if progress is True else True,  # None: not where there is no terminal
        leave=False,
    )

    def make(numbers: list[int]) -> Chunk:
        drawn = tuple(plan.drawn(number) for number in numbers)
        return Chunk(parcel, tuple(numbers), drawn, master)

    def take(found: Done) -> None:
        for number, run in found.traces.items():  # first, so that they are there if the row is
            trace = trace_path(folder, number)
            trace.parent.mkdir(exist_ok=True)
            run.save(trace)
        count = done.append(found.records)
        bar.update(count)
        if done.failed:
            bar.set_postfix_str(f"{done.failed} failed")
        if callable(progress):
            progress(count)

    def bury(chunk: Chunk, words: str) -> None:
        number = chunk.numbers[0]
        drawn = campaign.drawn(number)
        take(Done([{"run": number, "drawn": drawn, "rows": [], "error": words}]))

    dispatch = Dispatch(lanes, make=make, take=take, bury=bury, timeout=campaign.timeout)
    try:
        with bar:
            dispatch.run(todo)
        lanes.close()
    except KeyboardInterrupt:
        lanes.close(abandon=True)
        words = (
            f"{len(done.done)} of {campaign.count} runs of '{campaign.name}' are kept in {folder}"
        )
        raise KeyboardInterrupt(f"{words}; started again, it goes on there") from None
    except BaseException:
        lanes.close(abandon=True)
        raise


def parcel_of(campaign: "Campaign") -> Parcel:
    """Return what every worker needs of a campaign."""
    return pack(
        Job(
            campaign.work,
            campaign.plan.function,
            campaign.keeps,
            campaign.seed,
            campaign.timeout,
        )
    )


def trace_path(folder: Path, number: int) -> Path:
    """Return the file of a run's signals."""
    return folder / TRACES / f"run-{number:06}.parquet"


def _finish(campaign: "Campaign", folder: Path, done: Journal) -> "pd.DataFrame":
    """Write the table, if it is not there yet, and return it."""
    points = campaign.plan.points
    made = table.make_table(
        done.records().values(),
        seed=campaign.seed,
        units=campaign.units,
        meta={"name": campaign.name, "runs": campaign.count, "seed": campaign.seed},
        names=tuple(points[0]) if points else (),
    )
    table.write_table(folder / table.NAME, made)
    return table.frame_of(made)
