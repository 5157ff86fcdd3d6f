"""The command line: `railcosim COMMAND`. Nothing heavy is imported before a command needs it."""

import argparse
import ast
import io
import os
import shlex
import sys
import textwrap
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from .base.errors import ParameterError, RailcosimError
from .studies.identification.command import add_options as add_identify_options

if TYPE_CHECKING:
    from .studies.results import Results


class _Parser(argparse.ArgumentParser):
    """Errors in one line, exit code 1, as everywhere in railcosim."""

    def error(self, message: str) -> NoReturn:
        raise RailcosimError(f"{message} (see: {self.prog} --help)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code: 0 only when all went well."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a console that lacks ζ shows ?, and goes on
    try:
        options = _parser().parse_args(arguments)
        code = options.run(options) or 0
        sys.stdout.flush()
        return code
    except RailcosimError as error:
        return _complain(str(error))
    except KeyboardInterrupt as stop:
        print(f"railcosim: interrupted{f'; {stop}' if stop.args else ''}", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:  # a full disk, an output that is gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _complain(f"{error.strerror or error}: {error.filename or 'standard output'}")


def _complain(message: str) -> int:
    """Print a message in one line to standard error and return exit code 1."""
    print(f"railcosim: {' '.join(message.split())}", file=sys.stderr)
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="railcosim",
        description="Train plants as FMI 2.0 FMUs, co-simulated with Python controllers.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, run: Callable[[Any], Any], text: str) -> argparse.ArgumentParser:
        made = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        made.set_defaults(run=run)
        return made

    command("studies", _studies, "list the studies")
    run = command("run", _run, "run a study: metrics, traces, figures and ledger")
    run.add_argument("study", metavar="STUDY")
    run.add_argument("--out", metavar="DIR", help="results folder (default: results/STUDY)")
    run.add_argument(
        "--set", metavar="BLOCK.PARAMETER=VALUE", action="append", default=[], dest="values",
        help="change a parameter wherever the study has it; may be repeated",
    )  # fmt: skip
    for option, metavar, text in (
        ("--line", "F", "line data for one run between two stops (default: Beijing Line 5)"),
        ("--train", "F", "rolling stock for it (default: a type B metro train)"),
        ("--from", "STOP", "where the train departs"),
        ("--to", "STOP", "where it is to stop"),
    ):
        run.add_argument(option, metavar=metavar, help=text, dest=f"line_{option[2:]}")

    sweep = command("sweep", _sweep, "run a case of a study many times, drawn or swept")
    sweep.add_argument("study", metavar="STUDY")
    sweep.add_argument("--case", metavar="EXPERIMENT-CONTROLLER", help="which of the study's cases")
    sweep.add_argument(
        "--draw", metavar="BLOCK.PARAMETER=WHAT", action="append", default=[], dest="draws",
        help="uniform(low,high), normal(mean,sd), triangular(low,mode,high), integers(low,high), "
        "stats.NAME(…) of scipy, or values to sweep: 0.8,0.9,1.0 or linspace(low,high,count)",
    )  # fmt: skip
    sweep.add_argument(
        "--set", metavar="BLOCK.PARAMETER=VALUE", action="append", default=[], dest="values",
        help="change a parameter in all runs; may be repeated",
    )  # fmt: skip
    sweep.add_argument("--runs", type=int, metavar="N", help="runs, at each combination of a sweep")
    sweep.add_argument("--seed", type=int, metavar="S", help="seed of the draws")
    sweep.add_argument(
        "--sampling", default="random", metavar="KIND", help="random, latin_hypercube or sobol"
    )
    sweep.add_argument("--traces", type=int, default=0, metavar="N", help="keep every N-th trace")
    sweep.add_argument("--workers", type=int, metavar="N", help="processes (default: one a core)")
    sweep.add_argument("--scheduler", metavar="ADDRESS", help="a Dask cluster: tcp://HOST:PORT")
    sweep.add_argument("--out", metavar="DIR", help="folder (default: results/sweeps/STUDY-CASE)")
    sweep.add_argument("--fresh", action="store_true", help="begin anew what the folder holds")

    command("models", _models, "list the plants with their variables")
    export = command("export", _export, "write a plant as an FMU for other tools")
    export.add_argument("model", metavar="MODEL", help="a plant's name, or FILE.py:FUNCTION")
    for option, metavar, kind, text in (
        ("--out", "F.fmu", str, "file (default: MODEL.fmu)"),
        ("--platform", "LIST", str, "linux64,win64,darwin64 (default: this machine's)"),
        ("--consist", "F", str, "vehicles and couplers of heavy_haul_train"),
        ("--gradients", "N", int, "stretches of the line that heavy_haul_train has room for"),
    ):
        export.add_argument(option, metavar=metavar, type=kind, help=text)

    info = command("info", _info, "show what an FMU says of itself")
    info.add_argument("fmu", metavar="FMU")
    check = command(
        "check",
        _check,
        "check an FMU: structure, all that it declares, a reference",
    )
    check.add_argument("fmu", metavar="FMU")
    check.add_argument("--reference", metavar="F.csv", help="time and variables to compare with")
    check.add_argument("--input", metavar="F.csv", help="time and input variables to apply")
    check.add_argument("--step", type=float, metavar="S", help="communication step in s")
    check.add_argument("--stop", type=float, metavar="S", help="stop time in s")
    check.add_argument(
        "--tolerance", type=float, metavar="X", help="allowed error, relative to the signal's size"
    )
    check.add_argument(
        "--timeout", type=float, default=60.0, metavar="S",
        help="time in s after which a call of the FMU is taken to hang (default: 60)",
    )  # fmt: skip

    identify = command("identify", _identify, "identify a train's brakes from logs of its runs")
    add_identify_options(identify)

    simulate = command("simulate", _simulate, "run one FMU, with inputs from a file")
    simulate.add_argument("fmu", metavar="FMU")
    simulate.add_argument("--input", metavar="F.csv", help="time and input variables to apply")
    simulate.add_argument("--step", type=float, metavar="S", help="communication step in s")
    simulate.add_argument("--stop", type=float, metavar="S", help="stop time in s")
    simulate.add_argument(
        "--set", metavar="VARIABLE=VALUE", action="append", default=[], dest="values",
        help="set a parameter, start value or constant input; may be repeated",
    )  # fmt: skip
    simulate.add_argument(
        "--out", metavar="F", default="result.csv", help=".csv or .parquet (default: result.csv)"
    )
    return parser


class _Version(argparse.Action):
    """Print the version, which is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *rest: Any) -> NoReturn:
        from importlib.metadata import version

        print(f"railcosim {version('railcosim')}")
        parser.exit()


def _values(pairs: Sequence[str]) -> dict[str, Any]:
    """Return NAME=VALUE pairs; a value is a Python literal, else a text."""
    values: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise RailcosimError(f"--set {pair}: write NAME=VALUE")
        try:
            values[name] = _tuples(ast.literal_eval(text))
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
            values[name] = text
    return values


def _tuples(value: Any) -> Any:
    """Return lists as the tuples that parameters are."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list | tuple) else value


# Studies


def _studies(options: Any) -> None:
    from .studies.registry import STUDIES

    for name, (_, title) in STUDIES.items():
        print(f"{name:18} {title}")


def _run(options: Any) -> int:
    from time import perf_counter

    from .studies.case import run_cases, with_overrides
    from .studies.metrics import UNITS
    from .studies.registry import study_named
    from .studies.results import (
        prepare,
        write_data,
        write_figure,
        write_ledger,
        write_run,
        write_tables,
    )

    began = perf_counter()
    study = study_named(options.study)
    overrides = _values(options.values)
    folder = Path(options.out or Path("results", study.name))
    way = {key: getattr(options, f"line_{key}") for key in ("line", "train", "from", "to")}
    on_line = any(way.values())
    cases = with_overrides(study.cases_on_line(**way) if on_line else study.cases(), overrides)
    for case in cases:
        case.check()  # what would not run is refused before anything is cleared
    prepare(folder)
    results = run_cases(study.name, cases, UNITS)
    write_data(folder, results)
    write_tables(folder, results, study.tables)
    ledger = []
    if not results.failure:
        if not on_line:  # the paper says nothing of other lines
            ledger = study.judge(results)
            write_ledger(folder, results, ledger)
        for name, figure in study.figures(results).items():
            write_figure(folder, results, name, figure)
    seconds = perf_counter() - began
    command = ["railcosim", "run", study.name, "--out", str(folder)]
    command += [word for pair in options.values for word in ("--set", pair)]
    command += [word for key, name in way.items() if name for word in (f"--{key}", name)]
    write_run(folder, results, command=shlex.join(command), overrides=overrides, seconds=seconds)
    if results.failure:
        raise RailcosimError(f"{results.failure}; the runs up to there are in {folder}")
    _print_summary(results, ledger)
    print(f"\n{results.count} runs, {seconds:.1f} s; results in {folder}")
    if unmet := study.unmet(results):
        raise RailcosimError(f"{'; '.join(unmet)}; see {folder / 'figures'}")
    return 0


def _sweep(options: Any) -> int:
    from .studies.sweeping import sweep

    return sweep(options, _values(options.values))


def _print_summary(results: "Results", ledger: list[Any]) -> None:
    for experiment, rows in results.metrics.items():
        print(f"\n{experiment}")
        width = max(len(name) for name in rows)
        for names in _blocks(list(next(iter(rows.values()))), results.units, 98 - width):
            heads = [f"{name} [{results.units[name]}]" for name in names]
            print("  " + " " * width + "".join(f"  {head:>9}" for head in heads))
            for controller, row in rows.items():
                cells = "".join(
                    f"  {_cell(row[name]):>{max(len(head), 9)}}"
                    for name, head in zip(names, heads, strict=True)
                )
                print(f"  {controller:{width}}{cells}")
    if ledger:
        print("\nThe paper's claims")
    for entry in ledger:
        print(textwrap.fill(entry.claim, 100, initial_indent="  ", subsequent_indent="  "))
        for text in (entry.verdict, f"({entry.measured})"):
            print(textwrap.fill(text, 100, initial_indent=" " * 6, subsequent_indent=" " * 6))


def _blocks(names: list[str], units: dict[str, str], width: int) -> list[list[str]]:
    """Return the metrics in blocks whose columns fit into a width."""
    blocks: list[list[str]] = [[]]
    left = width
    for name in names:
        needed = max(len(f"{name} [{units[name]}]"), 9) + 2
        if needed > left and blocks[-1]:
            blocks.append([])
            left = width
        blocks[-1].append(name)
        left -= needed
    return blocks


def _cell(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


# Models and FMUs


def _models(options: Any) -> None:
    from .models.catalogue import catalogue, plant_named

    for name, text in catalogue().items():
        print(f"{name}: {text}")
        for v in plant_named(name).variables():
            start = "" if v.start is None else f" = {_numbers(v.start)}"
            size = "" if v.size is None else f"[{v.size}]"
            print(f"  {v.kind:9} {v.name}{size}{start} [{v.unit}]  {v.description}")


def _numbers(values: Sequence[float]) -> str:
    """Return a vector's numbers; of a long one each different one, with how often it is there."""
    if len(values) <= 16:
        return ", ".join(f"{value:g}" for value in values)
    counts = Counter(values)
    if len(counts) > 6:
        return f"{values[0]:g}, …, {values[-1]:g}"
    return ", ".join(f"{count} × {value:g}" for value, count in counts.items())


def _export(options: Any) -> None:
    from .fmus import export

    plant = _plant(options)
    path = Path(options.out or f"{plant.name}.fmu")
    platforms = options.platform.split(",") if options.platform else None
    export(plant, path, platforms=platforms)
    print(f"{path}: {path.stat().st_size} bytes")


def _plant(options: Any) -> Any:
    from .models.catalogue import plant_named

    if options.consist is None and options.gradients is None:
        return plant_named(options.model)
    if options.model.replace("-", "_") != "heavy_haul_train":
        raise ParameterError(
            f"--consist and --gradients are for heavy_haul_train, not for '{options.model}'"
        )
    from .models.consist import read_consist
    from .models.heavy_haul import heavy_haul_train

    consist = None if options.consist is None else read_consist(options.consist)
    return heavy_haul_train(
        consist, gradients=1 if options.gradients is None else options.gradients
    )


def _info(options: Any) -> None:
    from .fmus.info import describe

    print(describe(Path(options.fmu)))


def _check(options: Any) -> int:
    from .fmus.check.isolated import check_isolated

    report = check_isolated(
        Path(options.fmu),
        reference=options.reference,
        inputs=options.input,
        step=options.step,
        stop=options.stop,
        tolerance=options.tolerance,
        timeout=options.timeout,
    )
    print(report)
    return 0 if report.passed else 1


def _identify(options: Any) -> None:
    from .studies.identification.command import run

    run(options)


def _simulate(options: Any) -> None:
    from .fmus.simulate import simulate

    path = Path(options.out)
    run = simulate(
        Path(options.fmu),
        inputs=options.input,
        step=options.step,
        stop=options.stop,
        values=_values(options.values),
        out=path,
    )
    print(f"{path}: {len(run.time)} rows of {len(run.columns)} signals")


if __name__ == "__main__":
    sys.exit(main())
