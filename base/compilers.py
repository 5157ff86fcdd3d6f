"""Find a C compiler: the system's, or the `ziglang` package that pip installs with this one."""

import hashlib
import importlib.util
import os
import platform as host
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from .cache import cache_folder
from .errors import BuildError, listing
from .progress import announced

# Bit identity between compilers and machines: no contraction to fused multiply-add, no fast-math.
FLAGS = ("-O2", "-g0", "-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-Wall", "-shared")
# GCC's own, for a compiler that knows them. They change no result: without them GCC takes a clamp
# between constants apart into branches and lets sqrt() set errno, so that a loop over vehicles,
# cells and the like computes one element at a time.
GCC_FLAGS = ("-fno-math-errno", "-fno-thread-jumps", "-fno-tree-pre")
# By kind of library, NAME standing for its name. Without -g0, -s and the install name zig writes
# the folder of the build into it; with them the same source gives the same bytes.
KIND_FLAGS = {
    ".so": ("-fPIC", "-s", "-lm"),
    ".dylib": ("-fPIC", "-Wl,-install_name,@rpath/NAME", "-lm"),
    ".dll": ("-s",),
}

# FMI 2.0 platform -> zig targets. Always explicit: without one zig compiles for this very CPU.
# glibc 2.17 loads on every Linux since 2013. darwin64 is one library with two slices, for macOS
# from 11 on, the first for arm64; zig's own default is a macOS younger than many in use.
TARGETS = {
    "linux64": ("x86_64-linux-gnu.2.17",),
    "win64": ("x86_64-windows-gnu",),
    "darwin64": ("x86_64-macos.11.0", "aarch64-macos.11.0"),
}
SUFFIXES = {"linux64": ".so", "win64": ".dll", "darwin64": ".dylib"}


@dataclass(frozen=True)
class Runtime:
    """What zig builds from source (C start-up code, import libraries) before it can link.

    zig keeps the parts by content under `folder`, so this happens once for a target; a file
    there tells that it has. Processes that build at once share zig's locks: one builds, the
    others wait for it.
    """

    target: str
    version: str
    folder: Path

    def is_built(self, kind: str) -> bool:
        """Tell whether libraries of this kind (".so", ".dll", ".dylib") link without delay."""
        return self._mark(kind).exists()

    @contextmanager
    def announced(self, kind: str) -> Iterator[None]:
        """Show progress while the body links the first library of this kind."""
        if self.is_built(kind):
            yield
            return
        what = f"zig's runtime for {self.target}"
        with announced(f"building {what}, once; takes some seconds", f"built {what}"):
            yield
        with suppress(OSError):  # no more than a message too many next time
            self._mark(kind).touch()

    def _mark(self, kind: str) -> Path:
        needed = repr((self.version, FLAGS, KIND_FLAGS[kind]))  # other flags, another runtime
        key = hashlib.sha256(needed.encode()).hexdigest()[:16]
        return self.folder / f"built-{self.target}-{key}"


@dataclass(frozen=True)
class Compiler:
    """A command that makes a shared library, with what tells it from another compiler."""

    command: tuple[str, ...]
    identity: str
    environment: tuple[tuple[str, str], ...] = ()
    runtime: Runtime | None = None
    library_flags: tuple[str, ...] = ()

    def shared_library(self, source: Path, library: Path) -> None:
        """Compile one C file to a shared library; raise BuildError with the compiler's words.

        The first time a compiler must build its runtime for the target, this is said on stderr.
        """
        source, library = source.absolute(), library.absolute()  # the compiler runs elsewhere
        with self.runtime.announced(library.suffix) if self.runtime else nullcontext():
            self._compile(source, library)

    def _compile(self, source: Path, library: Path) -> None:
        arguments = [*self.command, *FLAGS, str(source), "-o", str(library)]
        arguments += [flag.replace("NAME", library.name) for flag in KIND_FLAGS[library.suffix]]
        arguments += self.library_flags
        try:
            done = subprocess.run(
                arguments,
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
                cwd=library.parent,
                env={**os.environ, **dict(self.environment)},
            )
        except OSError as error:
            raise BuildError(f"cannot start the C compiler {self.command[0]}: {error}") from error
        if done.returncode or not library.exists():
            words = done.stderr.strip() or f"exit code {done.returncode}"
            raise BuildError(f"{self.identity} cannot compile {source.name}: {words}")


def host_platform() -> str:
    """Return this machine's FMI 2.0 platform name, such as "linux64".

    FMI 2.0 names no folder for 64-bit ARM; as FMPy does, linux64 and darwin64 then hold the
    machine's own kind of binary.
    """
    name = {"linux": "linux", "win32": "win", "darwin": "darwin"}.get(sys.platform)
    if name is None or sys.maxsize < 2**32:
        raise BuildError(f"no FMI 2.0 platform for {sys.platform} on {host.machine()}")
    return name + "64"


@lru_cache
def system_compiler() -> Compiler | None:
    """Return the system's C compiler if there is one that works ($CC, cc, gcc, clang), or None."""
    named = os.environ.get("CC")
    names = [named] if named else ["gcc", "clang"] if os.name == "nt" else ["cc", "gcc", "clang"]
    for name in names:
        command = shlex.split(name, posix=os.name != "nt")
        path = shutil.which(command[0]) if command else None
        if path is None:
            continue
        version = _version([path, *command[1:]])
        for flags in (GCC_FLAGS, ()):
            # Arguments, as those in $CC, change what comes out, so they belong to the identity.
            given = (*command[1:], *flags)
            compiler = Compiler((path, *given), " ".join((version, *given)))
            if _works(compiler):
                return compiler
    return None


def zig_compiler(target: str) -> Compiler:
    """Return zig's C compiler for a target such as "x86_64-linux-gnu.2.17"."""
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError(
            "no C compiler: install one, or the 'ziglang' package (pip install ziglang)"
        )
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target]
    # A cache of our own: zig's runtime for a target is built once, not once per project.
    folder = cache_folder("zig").absolute()
    return Compiler(
        (*command,),
        f"zig {_zig_version()} for {target}",
        (("ZIG_GLOBAL_CACHE_DIR", str(folder)), ("ZIG_LOCAL_CACHE_DIR", str(folder))),
        Runtime(target, _zig_version(), folder),
        _without_runtime() if target == "x86_64-windows-gnu" else (),
    )


def _without_runtime() -> tuple[str, ...]:
    """Return flags for a DLL that takes all it needs from Windows' own ucrtbase.dll.

    MinGW's start-up code and thread library, which zig would add, are a minute's work the first
    time and two thirds of the DLL, and an FMU has no use for them. The macro asks for the few
    lines in their place (fmus/c/ucrt.h).
    """
    package = importlib.util.find_spec("ziglang")
    assert package is not None and package.origin is not None
    headers = Path(package.origin).parent / "lib" / "libc" / "include" / "any-windows-any"
    return ("-nostdlib", "-isystem", str(headers), "-lucrtbase", "-DWITHOUT_C_RUNTIME")


def machine() -> str:
    """Return this machine's platform and processor: binaries for another one do not run here."""
    return f"{host_platform()} on {host.machine().lower()}"


def native_target() -> str:
    """Return the zig target for this machine."""
    arm = host.machine().lower() in {"arm64", "aarch64"}
    targets = {
        "linux64": "aarch64-linux-gnu.2.17" if arm else "x86_64-linux-gnu.2.17",
        "win64": "aarch64-windows-gnu" if arm else "x86_64-windows-gnu",
        "darwin64": "aarch64-macos.11.0" if arm else "x86_64-macos.11.0",
    }
    return targets[host_platform()]


def native_compiler(kind: str = "auto") -> Compiler:
    """Return a compiler for this machine: "system", "zig", or "auto": the first that is there."""
    if kind not in {"auto", "system", "zig"}:
        raise BuildError(f"no compiler '{kind}'; choose from {listing(('auto', 'system', 'zig'))}")
    if kind != "zig":
        compiler = system_compiler()
        if compiler:
            return compiler
        if kind == "system":
            raise BuildError("no working C compiler on this system; set CC or use zig")
    return zig_compiler(native_target())


def _version(command: list[str]) -> str:
    try:
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    except OSError:  # executable, but no program for this machine
        return command[0]
    return (done.stdout or done.stderr or command[0]).partition("\n")[0].strip()


@lru_cache
def _zig_version() -> str:
    from importlib.metadata import version

    return version("ziglang")


def _works(compiler: Compiler) -> bool:
    """Try the compiler: macOS has a `cc` even where no compiler is installed."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "probe.c"
        source.write_text("#include <math.h>\ndouble probe(double x) { return sqrt(x); }\n")
        try:
            compiler.shared_library(source, source.with_suffix(SUFFIXES[host_platform()]))
        except BuildError:
            return False
    return True
