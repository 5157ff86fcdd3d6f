"""A check in a process of its own: an FMU that crashes or hangs ends that process only.

Run as `python -m railcosim.fmus.check.isolated FOLDER`.
"""

import pickle
import sys
import tempfile
from pathlib import Path
from typing import Any

from .child import TIMEOUT, Answer, require_timeout, run_module
from .heartbeat import Heartbeat
from .report import Report
from .serving import serve

_FINDINGS = "findings"


def check_isolated(path: Path, *, timeout: float = TIMEOUT, **options: Any) -> Report:
    """Check as `check` does, in a second process.

    Each call of the FMU may take `timeout` (s; infinity waits for ever). One that takes longer
    ends the process, as a crash does; the report then says so, and has what was found before.
    Raise what `check` raises.
    """
    require_timeout(timeout)
    with tempfile.TemporaryDirectory(prefix="railcosim-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        findings = folder / _FINDINGS
        findings.touch()
        job = path.absolute(), findings, {**options, "timeout": timeout}
        answer = run_module(__name__, folder, job, timeout=timeout)
        if answer.result is None:
            return _broken_off(path, findings, answer)
    report: Report = answer.result
    if answer.fault:
        report.part = "the process"
        _add(report, answer, " after the last check")
    return report


def _broken_off(path: Path, findings: Path, answer: Answer) -> Report:
    """Return a report with what was found before, and with what ended the process."""
    report = Report(path.name)
    with findings.open("rb") as stream:
        while stream.peek(1):
            report.findings.append(pickle.load(stream))
    last = report.findings[-1] if report.findings else None
    report.part = last.part if last is not None else ""
    for call in answer.running:
        report.part = call.part or report.part
    _add(report, answer, f" after '{last.rule}'" if last is not None else "")
    why = "the FMU does not return" if answer.overdue else "the FMU ends the process"
    report.skip("the rest", why)
    return report


def _add(report: Report, answer: Answer, after: str) -> None:
    words = f"the process that ran the FMU {answer.fault}{after}{answer.line}"
    report.add("time-out" if answer.overdue else "crash", [words], "")


def _work(job: Any, heartbeat: Heartbeat) -> Report:
    from .checking import check

    path, findings, options = job
    report = check(path, findings=findings, heartbeat=heartbeat, **options)
    report.file = None
    return report


if __name__ == "__main__":
    serve(Path(sys.argv[1]), _work)
