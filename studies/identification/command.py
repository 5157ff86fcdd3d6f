"""`railcosim identify`: its options, and what it prints and writes."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import FileError, RailcosimError

if TYPE_CHECKING:
    from .report import Report

METHODS = ("mixed_effects", "least_squares", "fruit_fly", "improved_fruit_fly",
           "differential_evolution")  # fmt: skip


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "logs", metavar="LOGS", nargs="+", help="CSV or Parquet files, or folders with such"
    )
    parser.add_argument(
        "--model", choices=("precise", "coarse", "both"), default="both", help="default: both"
    )
    parser.add_argument(
        "--method", choices=METHODS,
        help="default: mixed_effects from four brakings on, else least_squares",
    )  # fmt: skip
    parser.add_argument(
        "--fix", metavar="NAME=VALUE", action="append", default=[],
        help="hold a parameter (T1, T2, P1, T3, T4, K, V_sw, k_bra, mu, …); may be repeated",
    )  # fmt: skip
    parser.add_argument("--evaluations", type=int, default=600, metavar="N",
                        help="of a search without derivatives (default: 600)")  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of a search (default: 0)")
    parser.add_argument("--out", metavar="DIR", help="folder for report.json, parameters, figure")


def run(options: Any) -> None:
    """Identify, print the report, and write it if asked to."""
    from .identify import identify
    from .logs import read_logs

    fixed = _fixed(options.fix)
    if options.seed < 0:
        raise RailcosimError(f"--seed {options.seed}: write a whole number from 0")
    logs = read_logs(options.logs)
    report = identify(
        logs, model=options.model, method=options.method, fixed=fixed,
        evaluations=options.evaluations, seed=options.seed,
    )  # fmt: skip
    print(report)
    if options.out:
        for path in write_report(Path(options.out), report):
            print(path)


def _fixed(pairs: list[str]) -> dict[str, float]:
    fixed: dict[str, float] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = None
        if not equals or not name or value is None:
            raise RailcosimError(f"--fix {pair}: write NAME=NUMBER, as in --fix T3=0.8")
        if name in fixed:
            raise RailcosimError(f"--fix {name} is given twice")
        fixed[name] = value
    return fixed


def write_report(folder: Path, report: "Report") -> list[Path]:
    """Write report.json, report.txt, parameters.json and the figure speeds, and return the paths.

    parameters.json holds what `with_values` and `--set` take.
    """
    from .figure import speeds_figure

    try:
        folder.mkdir(parents=True, exist_ok=True)
        texts = {
            "report.json": json.dumps(report.data(), indent=2, ensure_ascii=False, allow_nan=False),
            "parameters.json": json.dumps(report.settings, indent=2),
            "report.txt": str(report),
        }
        for name, text in texts.items():
            (folder / name).write_text(text + "\n", encoding="utf-8")
        figure = speeds_figure(report)
        figures = [folder / "speeds.png", folder / "speeds.svg"]
        for path in figures:
            figure.savefig(path, dpi=120)
    except OSError as error:
        raise FileError(f"cannot write into {folder}: {error.strerror or error}") from error
    return [*(folder / name for name in texts), *figures]
