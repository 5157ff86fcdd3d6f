"""Machines that run FMU libraries: this one, Windows under Wine, ARM Linux under QEMU.

A loader in C (loader.c) is built for each; it reads a scenario and prints the values it gets.
"""

import os
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

from railcosim.base.compilers import Compiler, native_compiler, zig_compiler

WINDOWS_TARGET = "x86_64-windows-gnu"
ARM_TARGET = "aarch64-linux-gnu.2.17"
ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")


@dataclass(frozen=True)
class Machine:
    """A compiler for a kind of machine, and what starts a program of that kind here."""

    name: str
    compiler: Compiler
    launcher: tuple[str, ...] = ()
    variables: Mapping[str, str] = field(default_factory=dict)

    def build_loader(self, folder: Path) -> None:
        """Compile the loader to loader.exe, a name that suits every machine."""
        source = Path(__file__).with_name("loader.c")
        headers = resources.files("fmpy").joinpath("c-code")
        # With -O2 and -s as for a library, or zig would build its runtime a second time.
        command = [*self.compiler.command, "-O2", "-s", "-Wall", f"-I{headers}", source]
        if self.name != "win64":
            command += ["-ldl"]  # where dlopen is
        done = subprocess.run(
            [*command, "-o", "loader.exe"],
            env={**os.environ, **dict(self.compiler.environment)},
            capture_output=True,
            text=True,
            cwd=folder,
        )
        assert done.returncode == 0, done.stderr

    def run(
        self, library: Path, guid: str, scenario: str, *, kind: int = 1, fails: bool = False
    ) -> list[str]:
        """Let the loader play a scenario on a library; return its lines, or its complaints.

        `kind` is FMI's type of instance: 1 is co-simulation. All files are in the library's
        folder and named without it, because Windows writes paths in its own way.
        """
        folder = library.parent
        self.build_loader(folder)
        (folder / "scenario.txt").write_text(scenario)
        done = subprocess.run(
            [*self.launcher, "./loader.exe", f"./{library.name}", guid, str(kind), "scenario.txt"],
            env={**os.environ, **self.variables},
            capture_output=True,
            text=True,
            errors="replace",
            cwd=folder,
            timeout=120,
        )
        assert bool(done.returncode) == fails, done.stderr or done.stdout
        return (done.stderr if fails else done.stdout).splitlines()


def here() -> Machine:
    """Return this machine."""
    return Machine("here", native_compiler())


def wine() -> Path | None:
    """Return Wine's 64-bit program, not Debian's shell script around it, or None."""
    debian = Path("/usr/lib/wine/wine64")
    found = str(debian) if debian.exists() else shutil.which("wine64")
    return Path(found) if found else None


def windows(prefix: Path) -> Machine | str:
    """Return a 64-bit Windows whose drive is below `prefix`, or why there is none."""
    program = wine()
    if program is None:
        return "needs wine64 to run Windows programs (Debian: apt install wine64)"
    variables = {
        "HOME": str(prefix),
        "WINEPREFIX": str(prefix / "wine"),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml,winemenubuilder.exe=",  # no installers, no menus
        "DISPLAY": "",
    }
    return Machine("win64", zig_compiler(WINDOWS_TARGET), (str(program),), variables)


def stop_windows(machine: Machine) -> None:
    """End the Wine server of this machine's drive, which otherwise writes there for a while."""
    server = Path(machine.launcher[0]).with_name("wineserver")
    if server.exists():
        subprocess.run([server, "-k"], env={**os.environ, **machine.variables}, check=False)


def arm_linux() -> Machine | str:
    """Return a 64-bit ARM Linux, or why there is none."""
    program = shutil.which("qemu-aarch64")
    if program is None:
        return "needs qemu-aarch64 to run ARM programs (Debian: apt install qemu-user)"
    if not ARM_LIBRARIES.is_dir():
        return "needs ARM's C library (Debian: apt install libc6-arm64-cross)"
    launcher = (program, "-L", str(ARM_LIBRARIES))
    return Machine("linux-aarch64", zig_compiler(ARM_TARGET), launcher)
