"""A second process that goes on from serialized states.

Run as `python -m railcosim.fmus.check.worker JOB RESULT`; both files are pickles between a
parent and its own child.
"""

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu_file import read_description
from .child import end_of, run_module
from .continuation import Continuation, run_from_bytes
from .subject import Subject

TIMEOUT = 120.0  # s


def run_elsewhere(
    subject: Subject, interface: str, tasks: Sequence[Continuation]
) -> list[np.ndarray | str]:
    """Return what each task gives in a fresh process: its rows, or what failed.

    Raise FmuError if that process does not come to its end.
    """
    with tempfile.TemporaryDirectory(prefix="railcosim-") as folder:
        job, result = Path(folder, "job"), Path(folder, "result")
        job.write_bytes(pickle.dumps((subject.path, interface, list(tasks))))
        try:
            done = run_module(__name__, job, result, timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            raise FmuError(f"the second process did not end within {TIMEOUT:g} s") from None
        if done.returncode or not result.exists():
            words = done.stderr.strip().splitlines()
            raise FmuError(f"the second process {end_of(done.returncode)}: {' '.join(words[-1:])}")
        return pickle.loads(result.read_bytes())


def main(job: str, result: str) -> None:
    """Run the tasks of a job, each in an instance of its own that is not initialized."""
    path, interface, tasks = pickle.loads(Path(job).read_bytes())
    subject = Subject(path, read_description(path))
    found = []
    only_once = subject.declares(interface, "canBeInstantiatedOnlyOncePerProcess")
    instance = None
    for task in tasks:
        if instance is None or not only_once:
            if instance is not None:
                instance.close()
            instance = subject.instance(interface)
        found.append(run_from_bytes(instance, task))
    if instance is not None:
        instance.close()
    Path(result).write_bytes(pickle.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
