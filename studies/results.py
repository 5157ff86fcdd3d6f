"""What a study leaves behind: metrics, ledger, traces, figures, and how to run it again."""

import json
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, is_dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import FileError
from ..cosim.results.result import Run

if TYPE_CHECKING:
    import pandas as pd

    from .case import Case
    from .ensemble import Ensemble
    from .ledger import Entry

PACKAGES = ("railcosim", "casadi", "FMPy", "numpy", "scipy", "pandas", "matplotlib", "pyarrow")


@dataclass
class Results:
    """The runs of a study and what was measured on them, by experiment and controller."""

    study: str
    units: dict[str, str]
    metrics: dict[str, dict[str, dict[str, float | None]]] = field(default_factory=dict)
    runs: dict[tuple[str, str], Run] = field(default_factory=dict)
    samples: "dict[tuple[str, str], pd.DataFrame]" = field(default_factory=dict)  # of ensembles
    parameters: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    seeds: dict[str, dict[str, int]] = field(default_factory=dict)
    fmus: dict[str, str] = field(default_factory=dict)
    failure: str | None = None
    written: list[str] = field(default_factory=list)  # files of the results folder

    @property
    def count(self) -> int:
        """How many runs there were, those of ensembles included."""
        many = sum(len(set(frame["run"])) for frame in self.samples.values())
        return many + len(self.runs.keys() - self.samples.keys())

    def add(self, case: "Case", run: Run | None, metrics: dict[str, float | None]) -> None:
        """Take in one run; None where there are no signals to keep."""
        if run is not None:
            self.runs[case.experiment, case.controller] = run
        if metrics:
            self.metrics.setdefault(case.experiment, {})[case.controller] = metrics
        values = {
            f"{name}.{parameter}": _plain(value)
            for name, block in case.diagram.blocks.items()
            for parameter, value in block.parameters().items()
        }
        values["step"] = float(case.diagram.step)
        values["stop"] = case.stop
        self.parameters.setdefault(case.experiment, {})[case.controller] = values
        if case.seeds:
            self.seeds[case.name] = dict(case.seeds)
        self.fmus |= _guids(case)

    def add_samples(self, case: "Ensemble", table: "pd.DataFrame", *, failed: bool) -> None:
        """Take in the table of an ensemble's runs, and its summary if none of them failed."""
        frame = table.drop(columns=["seed"] if failed else ["seed", "error"])
        units = {"run": "1", "error": "", **self.units, **case.units}
        frame.attrs["units"] = {name: units[name] for name in frame.columns}
        self.samples[case.experiment, case.controller] = frame
        self.seeds[case.name] = {"ensemble": case.seed}
        if not failed:
            self.metrics.setdefault(case.experiment, {})[case.controller] = case.summarise(frame)

    def take(self, other: "Results") -> None:
        """Take in the runs of other results of the study, and all that belongs to them."""
        for mine, theirs in (
            (self.metrics, other.metrics),
            (self.parameters, other.parameters),
        ):
            for experiment, rows in theirs.items():
                mine.setdefault(experiment, {}).update(rows)
        self.runs |= other.runs
        self.samples |= other.samples
        self.seeds |= other.seeds
        self.fmus |= other.fmus

    def get(self, experiment: str, controller: str, metric: str) -> float | None:
        """Return a metric; None where it was not measured or has no value."""
        return self.metrics.get(experiment, {}).get(controller, {}).get(metric)

    def time(self, experiment: str, controller: str, metric: str) -> float | None:
        """Return a time; infinity where it never came, None where it was not measured."""
        row = self.metrics.get(experiment, {}).get(controller, {})
        if metric not in row:
            return None
        value = row[metric]
        return float("inf") if value is None else value


def prepare(folder: Path) -> None:
    """Make the results folder and clear it of what an earlier run wrote there.

    Removed is only what the folder's own run.json names as written. Raise FileError now rather
    than after the work.
    """
    try:
        for part in ("traces", "figures"):
            (folder / part).mkdir(parents=True, exist_ok=True)
        for name in _written(folder):
            (folder / name).unlink(missing_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise FileError(f"cannot write to {folder}: {error.strerror or error}") from error


def _written(folder: Path) -> list[str]:
    """Return the files that an earlier run lists in its run.json, itself included."""
    try:
        names = json.loads((folder / "run.json").read_text(encoding="utf-8"))["written"]
        inside = [n for n in names if (folder / n).resolve().is_relative_to(folder.resolve())]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [*inside, "run.json"]


def write_data(folder: Path, results: Results) -> None:
    """Write metrics.json, traces/ and samples/."""
    for (experiment, controller), run in results.runs.items():
        name = f"traces/{experiment}-{controller}.parquet"
        run.save(folder / name)
        results.written.append(name)
    for (experiment, controller), frame in results.samples.items():
        name = f"samples/{experiment}-{controller}.parquet"
        _write_samples(folder / name, frame)
        results.written.append(name)
    results.written.append("metrics.json")
    _write_json(folder / "metrics.json", {"units": results.units, "experiments": results.metrics})


def _write_samples(path: Path, frame: "pd.DataFrame") -> None:
    """Write an ensemble's table; each column's unit goes into its field's metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pandas(frame, preserve_index=False)
    units = frame.attrs["units"]
    fields = [f.with_metadata({"unit": units[f.name]}) for f in table.schema]
    try:
        path.parent.mkdir(exist_ok=True)
        pq.write_table(table.cast(pa.schema(fields)), path)
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror or error}") from error


def write_run(
    folder: Path, results: Results, *, command: str, overrides: Mapping[str, Any], seconds: float
) -> None:
    """Write run.json: what was run, with what, and how to run it again."""
    about = {
        "study": results.study,
        "command": command,
        "overrides": {key: _plain(value) for key, value in overrides.items()},
        "failure": results.failure,
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(seconds, 2),
        "run_seconds": {
            f"{e}-{c}": round(run.wall_time, 4) for (e, c), run in results.runs.items()
        },
        "engines": {f"{e}-{c}": run.engine for (e, c), run in results.runs.items()},
        "algorithms": sorted({run.algorithm for run in results.runs.values()}),
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "packages": {name: version(name) for name in PACKAGES},
        "fmus": results.fmus,
        "seeds": results.seeds,
        "parameters": results.parameters,
        "written": sorted(results.written),
    }
    _write_json(folder / "run.json", about)


def write_ledger(folder: Path, results: Results, ledger: "list[Entry]") -> None:
    """Write ledger.json."""
    results.written.append("ledger.json")
    _write_json(folder / "ledger.json", [asdict(entry) for entry in ledger])


def write_tables(
    folder: Path, results: Results, write: Callable[[Path, Results], list[Path]]
) -> None:
    """Let a study write its tables into tables/."""
    target = folder / "tables"
    try:
        files = write(target, results)
    except OSError as error:
        raise FileError(f"cannot write to {target}: {error.strerror or error}") from error
    results.written += [f"tables/{file.name}" for file in files]


def write_figure(folder: Path, results: Results, name: str, figure: Any) -> None:
    """Write figures/NAME.svg and .png, the same bytes for the same figure."""
    import matplotlib as mpl

    base = folder / "figures" / name
    results.written += [f"figures/{name}.svg", f"figures/{name}.png"]
    try:
        with mpl.rc_context({"svg.hashsalt": name}):
            figure.savefig(base.with_suffix(".svg"), metadata={"Date": None})
        figure.savefig(base.with_suffix(".png"), dpi=110)
    except OSError as error:
        raise FileError(f"cannot write {base}.svg: {error.strerror or error}") from error


def _write_json(path: Path, content: Any) -> None:
    try:
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror or error}") from error


def _guids(case: "Case") -> dict[str, str]:
    from ..cosim import Fmu
    from ..cosim.fmu.file import read_description

    found = [block for block in case.diagram.blocks.values() if isinstance(block, Fmu)]
    return {fmu.path.name: read_description(fmu.path).guid for fmu in found}


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it: rule bases as their fields, functions by name."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if callable(value):
        return getattr(value, "__qualname__", repr(value))
    return value if isinstance(value, str | int | float | bool | type(None)) else str(value)
