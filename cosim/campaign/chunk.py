"""Chunks: some runs that travel together, and what a worker does with them."""

import os
import socket
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import parent_process
from threading import local
from time import perf_counter
from typing import Any

import numpy as np

from ...base.errors import RailcosimError
from ..results.result import Run, SimulationError
from .draws import generator_of
from .journal import Record
from .parcel import MissingError, Parcel, unpack, without_places
from .timeout import TimedOutError, limited
from .work import Closable, Drawn, Preparable, Simulation, plain_row, plain_rows, plain_text


@dataclass(frozen=True)
class Job:
    """What all runs of a campaign share; it travels as a parcel."""

    work: Any
    draw: Callable[[np.random.Generator], Drawn] | None
    keeps: Callable[[int, str | None], bool]  # whether a run's trace is kept, by number and error
    seed: int
    timeout: float | None


@dataclass(frozen=True)
class Chunk:
    """Runs by number with the numbers drawn for them (None: drawn by the worker)."""

    parcel: Parcel
    numbers: tuple[int, ...]
    drawn: tuple[dict[str, Any] | None, ...]
    master: str  # the process that has it computed
    shipped: Mapping[str, bytes] = field(default_factory=dict)  # FMUs that the worker lacked


@dataclass(frozen=True)
class Done:
    """What a chunk gave; `missing` names FMUs to ship, `refusal` why the work cannot be loaded."""

    records: list[Record] = field(default_factory=list)
    traces: dict[int, Run] = field(default_factory=dict)
    seconds: float = 0.0  # of the runs alone
    missing: list[str] = field(default_factory=list)
    refusal: str | None = None
    interrupted: bool = False


# The last campaign's work in each thread of a worker: FMUs loaded for one run serve the next.
_loaded = local()


def compute(chunk: Chunk) -> Done:
    """Compute a chunk's runs, in a worker. A run that fails gives a record with its error."""
    try:
        job = _job(chunk)
    except MissingError as error:
        return Done(missing=error.digests)
    except Exception as error:  # a module that is not there, another version of a class
        return Done(refusal=f"{type(error).__name__}: {error}")
    done = Done()
    began = perf_counter()
    worker = this_process()
    # The child of another process may be ended for a run that hangs; it will be replaced.
    fatal = worker != chunk.master and parent_process() is not None
    try:
        for number, drawn in zip(chunk.numbers, chunk.drawn, strict=True):
            start = perf_counter()
            record, trace = _one(job, chunk.parcel, number, drawn, fatal)
            record |= {"seconds": round(perf_counter() - start, 6), "worker": worker}
            done.records.append(record)
            if trace is not None:
                done.traces[number] = trace
    except KeyboardInterrupt:
        return Done(done.records, done.traces, interrupted=True)
    return Done(done.records, done.traces, seconds=perf_counter() - began)


def forget() -> None:
    """Let go of what this thread keeps of the last campaign."""
    job: Job | None = getattr(_loaded, "job", None)
    if job is not None and isinstance(job.work, Closable):
        job.work.close()
    _loaded.__dict__.clear()


def _job(chunk: Chunk) -> Job:
    if getattr(_loaded, "digest", None) != chunk.parcel.digest:
        forget()
        job: Job = unpack(chunk.parcel, chunk.shipped)
        work = job.work.prepared() if isinstance(job.work, Preparable) else job.work
        _loaded.job = Job(work, job.draw, job.keeps, job.seed, job.timeout)
        _loaded.digest = chunk.parcel.digest
    return _loaded.job


def this_process() -> str:
    """Return a name for this process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def _one(
    job: Job, parcel: Parcel, number: int, drawn: Drawn | None, fatal: bool
) -> tuple[Record, Run | None]:
    """Return one run's record, and its signals if they are to be kept."""
    record: Record = {"run": number, "drawn": {}, "rows": [], "error": None}
    run: Run | None = None
    try:
        with _quiet(), limited(job.timeout, fatal=fatal):
            generator = generator_of(job.seed, number)
            if drawn is None:
                drawn = {} if job.draw is None else job.draw(generator)
            record["drawn"] = plain_row(drawn)
            if isinstance(job.work, Simulation):
                run = job.work.run(drawn, generator)
                found = job.work.measured(run)
            else:
                found = job.work(drawn, generator)
            record["rows"] = plain_rows(found, record["drawn"])
    except TimedOutError as error:
        record["error"] = str(error)
    except (Exception, SystemExit) as error:
        run = error.run if isinstance(error, SimulationError) else run
        record |= _told(error, parcel)
    keep = run is not None and job.keeps(number, record["error"])
    return record, run if keep else None


def _told(error: BaseException, parcel: Parcel) -> dict[str, str]:
    """Return an error in one line; for one that is not ours with its traceback, for the journal."""
    words = " ".join(plain_text(str(error)).split())
    if isinstance(error, RailcosimError):
        return {"error": without_places(words, parcel)}
    kind = type(error).__name__
    lines = traceback.format_exception(error)
    return {
        "error": without_places(f"{kind}: {words}" if words else kind, parcel),
        "traceback": plain_text("".join(lines)),
    }


@contextmanager
def _quiet() -> Iterator[None]:
    """Let every run begin with NumPy's own treatment of overflow, whatever the last one set."""
    with np.errstate(**np.geterr()):
        yield
