"""A second process that goes on from serialized states.

Run as `python -m railcosim.fmus.check.worker FOLDER`.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import read_description
from .child import run_module
from .continuation import Continuation, run_from_bytes
from .heartbeat import Heartbeat
from .serving import serve
from .subject import Subject


def run_elsewhere(
    subject: Subject, interface: str, tasks: Sequence[Continuation]
) -> list[np.ndarray | str]:
    """Return what each task gives in a fresh process: its rows, or what failed.

    Raise FmuError if that process does not come to its end.
    """
    with tempfile.TemporaryDirectory(prefix="railcosim-", ignore_cleanup_errors=True) as folder:
        job = subject.path, interface, list(tasks)
        try:
            # In this process's group: what ends this one ends that one.
            answer = run_module(__name__, Path(folder), job, timeout=subject.timeout, leads=False)
        except FmuError as error:
            raise FmuError(f"the second process: {error}") from error
    if answer.fault:
        raise FmuError(f"the second process {answer.fault}{answer.line}")
    return answer.result


def _work(job: Any, heartbeat: Heartbeat) -> list[np.ndarray | str]:
    """Run the tasks of a job, each in an instance of its own that is not initialized."""
    path, interface, tasks = job
    subject = Subject(path, read_description(path), heartbeat=heartbeat)
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
    return found


if __name__ == "__main__":
    serve(Path(sys.argv[1]), _work)
