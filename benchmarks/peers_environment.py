"""Where the peers run: a virtual environment for each, made once in railcosim's cache folder.

One for all is not possible: CoFmuPy asks for another FMPy than PathSim's block.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from peers_job import Job, result

from railcosim.base.cache import cache_folder

PACKAGES = {
    "libcosimpy": ("libcosimpy==0.0.6",),
    "ecospy": ("ecospy==0.7.2", "tbb==2023.2.0"),
    "cofmupy": ("cofmupy==1.0.0", "fmpy==0.3.20", "numpy==2.4.6"),
    "pathsim": ("pathsim==0.27.1", "pathsim-fmi==0.1.1", "fmpy==0.3.32", "numpy==2.4.6"),
}
PIP = ("--quiet", "--disable-pip-version-check", "--retries", "1")


class NotInstalledError(Exception):
    """A peer that cannot be had here, with the reason."""


class FailedError(Exception):
    """A run that failed, with the last line it wrote."""


def python(peer: str) -> str:
    """Return the interpreter of a peer's environment, which is made if it is not there yet."""
    packages = PACKAGES[peer]
    key = hashlib.sha256(repr((packages, sys.version)).encode()).hexdigest()[:12]
    folder = cache_folder("benchmarks") / f"{peer}-{key}"
    program = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    complete = folder / "complete"
    if not complete.exists():
        print(f"installing {', '.join(packages)} …", file=sys.stderr, flush=True)
        shutil.rmtree(folder, ignore_errors=True)
        _call(sys.executable, "-m", "venv", str(folder))
        try:
            _call(str(program), "-m", "pip", "install", *PIP, *packages)
        except NotInstalledError:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        complete.touch()
    return str(program)


def _call(*command: str) -> None:
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode:
        raise NotInstalledError(_last_line(ran.stderr) or f"{command[2]} failed")


def run(peer: str, interpreter: str, job: Job) -> dict:
    """Run peers_PEER.py in a process of its own and return what it measured."""
    script = Path(__file__).with_name(f"peers_{peer}.py")
    environment = dict(os.environ)
    # tbb's wheel puts libtbb there, where nothing else looks for it.
    libraries = str(Path(interpreter).parent.parent / "lib")
    before = environment.get("LD_LIBRARY_PATH")
    environment["LD_LIBRARY_PATH"] = f"{libraries}{os.pathsep}{before}" if before else libraries
    # Most contenders leave their extracted FMUs behind.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        environment |= {"TMPDIR": folder, "TEMP": folder, "TMP": folder}
        ran = subprocess.run(
            [interpreter, str(script)],
            input=job.text(),
            capture_output=True,
            text=True,
            env=environment,
            check=False,
        )
    if ran.returncode:
        raise FailedError(_last_line(ran.stderr) or f"exit code {ran.returncode}")
    return result(ran.stdout)


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR:")]  # pip warns after its error
    return (errors or lines or [""])[-1]
