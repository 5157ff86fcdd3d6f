"""Drivers in C, linked with the sources of an FMU: under sanitizers, valgrind and in threads.

main.c names the programs. What they know of the FMU comes from its modelDescription.xml.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ScalarVariable

SOURCES = ("main", "support", "play", "states", "arguments", "logs", "runs", "many")
COMMON = (
    "-std=gnu99", "-g", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror",
    "-Wno-unused-parameter", "-Wno-maybe-uninitialized",
)  # fmt: skip
PLAIN = ("-O1",)
ADDRESS = (
    "-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all",
    "-fno-omit-frame-pointer",
)  # fmt: skip
THREAD = ("-O1", "-fsanitize=thread")
OPTIONS = {
    "ASAN_OPTIONS": "detect_leaks=1",
    "UBSAN_OPTIONS": "print_stacktrace=1",
    # glibc counts what a thread keeps to reuse as in use; without that, bytes in use are exact.
    "GLIBC_TUNABLES": "glibc.malloc.tcache_count=0",
}
# Long enough for any program under valgrind: a driver that hangs is a failure, not a wait.
PATIENCE = 300
MEMCHECK = (
    "valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all",
    "--errors-for-leak-kinds=all",
)  # fmt: skip


def compiler() -> str | None:
    """Return gcc, which has the sanitizers on Linux, or None."""
    return shutil.which("gcc") if sys.platform == "linux" else None


@cache
def missing(flags: tuple[str, ...]) -> str | None:
    """Return why programs with these flags cannot be made or run here; None if they can."""
    gcc = compiler()
    if gcc is None:
        return "needs gcc on Linux (Debian: apt install gcc)"
    with tempfile.TemporaryDirectory() as folder:
        probe = Path(folder, "probe.c")
        probe.write_text("int main(void) { return 0; }")
        program = str(probe.with_suffix(""))
        made = subprocess.run([gcc, *flags, str(probe), "-o", program], capture_output=True)
        if made.returncode or subprocess.run([program], capture_output=True).returncode:
            return f"needs gcc with {' '.join(flags)}"
    return None


needs_valgrind = pytest.mark.skipif(
    compiler() is None or shutil.which("valgrind") is None,
    reason="needs gcc and valgrind on Linux (Debian: apt install gcc valgrind)",
)


@dataclass(frozen=True)
class Driver:
    """A program, and what has to stand before it."""

    path: Path
    launcher: tuple[str, ...] = ()

    def run(self, *arguments: object) -> list[str]:
        """Return what it prints; a failed check, a report of a tool or a crash fails the test."""
        done = subprocess.run(
            [*self.launcher, str(self.path), *map(str, arguments)],
            env={**os.environ, **OPTIONS},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PATIENCE,
        )
        words = "\n".join((done.stdout + done.stderr).splitlines()[:60])
        assert done.returncode == 0, f"{self.path.name} {arguments}: {done.returncode}\n{words}"
        return done.stdout.splitlines()


class Workshop:
    """Compiles drivers; what does not depend on the FMU is compiled once for each set of flags."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._objects: dict[tuple[str, ...], list[Path]] = {}

    def driver(self, fmu: Path, flags: Sequence[str]) -> Driver:
        """Return a driver for an FMU, compiled with these flags; skip the test if it cannot be."""
        reason = missing(tuple(flags))
        if reason:
            pytest.skip(reason)
        folder = self.folder / f"{len(list(self.folder.iterdir()))}-{fmu.stem}"
        folder.mkdir()
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder, [n for n in archive.namelist() if n.startswith("sources/")])
        if tuple(flags) == ADDRESS:
            guard_arrays(folder / "sources")
        description = read_model_description(str(fmu))
        (folder / "description.c").write_text(description_c(description))
        program = folder / "driver"
        here, shared = Path(__file__).parent, self._shared(tuple(flags))
        arguments = [*COMMON, *flags, _headers(), f"-I{here}", "sources/fmu.c", "description.c"]
        _run([*arguments, *map(str, shared), "-o", program.name, "-lm", "-lpthread"], folder)
        return Driver(program)

    def _shared(self, flags: tuple[str, ...]) -> list[Path]:
        if flags not in self._objects:
            folder = self.folder / f"{len(list(self.folder.iterdir()))}-shared"
            folder.mkdir()
            here = Path(__file__).parent
            files = [str(here / f"{name}.c") for name in SOURCES]
            _run([*COMMON, *flags, "-O0", _headers(), "-c", *files], folder)  # quicker compiled
            self._objects[flags] = [folder / f"{name}.o" for name in SOURCES]
        return self._objects[flags]


def _run(arguments: list[str], folder: Path) -> None:
    done = subprocess.run(
        [compiler() or "gcc", *arguments], capture_output=True, text=True, cwd=folder
    )
    assert done.returncode == 0, done.stderr


def _headers() -> str:
    return f"-I{resources.files('fmpy').joinpath('c-code')}"


_MEMBERS = re.compile(r"(?<=    State now;\n).*?(?=} Instance;)", re.DOTALL)
_ARRAYS = re.compile(r"^    (?P<type>[\w ]+?) (?P<names>\w+\[[^;]*);", re.MULTILINE)
_MADE = "calloc(1, sizeof(Instance));\n"


def guard_arrays(sources: Path) -> None:
    """Put poisoned bytes behind each array of the wrapper's Instance.

    By itself the address sanitizer knows the borders of a piece of memory, not those inside it.
    """
    header, maker = sources / "instance.h", sources / "life.h"
    names: list[str] = []

    def guarded(found: re.Match[str]) -> str:
        lines = []
        for name in found["names"].split(", "):
            names.append(f"guard_{name.partition('[')[0]}")
            lines += [f"    {found['type']} {name};", f"    char {names[-1]}[64];"]
        return "\n".join(lines)

    text = header.read_text()
    header.write_text(_MEMBERS.sub(lambda found: _ARRAYS.sub(guarded, found[0]), text))
    poison = [f"if (m) __asan_poison_memory_region(m->{name}, 64);\n" for name in names]
    text = maker.read_text()
    assert names and text.count(_MADE) == 1
    include = "#include <sanitizer/asan_interface.h>\n"
    maker.write_text(include + text.replace(_MADE, _MADE + "".join(poison)))


def description_c(description: ModelDescription) -> str:
    """Return description.c, which tells the drivers what fmu.h declares."""
    variables = description.modelVariables
    states = {id(v.derivative) for v in variables if v.derivative is not None}
    rows = [_row(v, _kind(v, id(v) in states)) for v in variables]
    (inner,) = (v for v in variables if v.name == "solver.inner_step")
    experiment, interface = description.defaultExperiment, description.coSimulation
    assert experiment is not None
    assert interface is not None
    return "\n".join(
        [
            '#include "fmu.h"',
            f'const char *const guid = "{description.guid}";',
            "const Variable variable[] = {",
            *rows,
            "};",
            f"const int n_variables = {len(rows)}, n_states = {len(states)};",
            f"const int n_indicators = {description.numberOfEventIndicators};",
            f"const int output_derivatives = {interface.maxOutputDerivativeOrder or 0};",
            f"const double start_time = {float(experiment.startTime or 0.0)!r};",
            f"const double step_size = {float(experiment.stepSize or 0.0)!r};",
            f"const fmi2ValueReference inner_step = {inner.valueReference};",
            "",
        ]
    )


def _kind(v: ScalarVariable, is_state: bool) -> str:
    """Return the kind's letter, as in fmu.h."""
    if v.causality == "parameter":
        return "t" if v.variability == "tunable" else "p"
    if v.derivative is not None or is_state:
        return "s" if is_state else "d"
    if v.type == "Integer":
        return "m"
    if v.causality in ("input", "calculatedParameter"):
        return "i" if v.causality == "input" else "c"
    return "e" if v.initial == "exact" else "o"


def _row(v: ScalarVariable, kind: str) -> str:
    low = "-HUGE_VAL" if v.min is None else repr(float(v.min))
    high = "HUGE_VAL" if v.max is None else repr(float(v.max))
    flags = f"{int(v.type == 'Integer')}, {int(v.causality == 'output')}"
    start = repr(float(v.start or 0.0))
    return f"    {{\"{v.name}\", {v.valueReference}, '{kind}', {flags}, {start}, {low}, {high}}},"
