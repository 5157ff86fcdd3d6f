"""What a peers_*.py gets and gives: a job as JSON on its command line, a result on its output.

Each runs in an environment of its own, so this file needs nothing but Python.
"""

import json
import sys
from dataclasses import asdict, dataclass, field
from typing import Any

MARK = "RESULT "


@dataclass(frozen=True)
class Job:
    """One run: which work, with which FMUs (paths by name), for how many steps of `step` (s).

    The controller is u = gain · (reference − speed). `start` is its output that holds before it
    has been called first, for masters that step it as a slave; `inputs` are what to play to the
    FMU where there is no controller. `options` are the contender's own.
    """

    work: str
    fmus: dict[str, str]
    steps: int
    step: float = 0.001
    gain: float = 4.743
    reference: float = 1.0
    start: float = 0.0
    inputs: list[float] = field(default_factory=list)
    options: dict[str, Any] = field(default_factory=dict)

    def text(self) -> str:
        """Return it as JSON."""
        return json.dumps(asdict(self))


def job() -> Job:
    """Return the job given on standard input."""
    return Job(**json.load(sys.stdin))


def done(seconds: float, final: list[float], **more: Any) -> None:
    """Print CPU seconds of the loop and the final state, in the order the work has."""
    print("\n" + MARK + json.dumps({"seconds": seconds, "final": final, **more}), flush=True)


def result(output: str) -> dict[str, Any]:
    """Return what `done` printed, among whatever else a contender prints."""
    lines = [line for line in output.splitlines() if line.startswith(MARK)]
    return json.loads(lines[-1].removeprefix(MARK))
