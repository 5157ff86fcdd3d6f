"""A check in a process of its own: an FMU that crashes ends that process, and the report says so.

Run as `python -m railcosim.fmus.check.isolated JOB RESULT FINDINGS`; the files are pickles between
a parent and its own child.
"""

import pickle
import sys
import tempfile
from pathlib import Path
from typing import Any

from ...base.errors import RailcosimError
from .child import end_of, run_module
from .report import Report


def check_isolated(path: Path, **options: Any) -> Report:
    """Check as `check` does, in a second process.

    Raise what `check` raises. After a crash the report has what was found before.
    """
    with tempfile.TemporaryDirectory(prefix="railcosim-") as folder:
        job, result, findings = (Path(folder, name) for name in ("job", "result", "findings"))
        job.write_bytes(pickle.dumps((path.absolute(), options)))
        findings.touch()
        done = run_module(__name__, job, result, findings, capture=False)
        if result.exists():
            found = pickle.loads(result.read_bytes())
            if isinstance(found, RailcosimError):
                raise found
            return found
        return _broken_off(path, findings, done.returncode)


def _broken_off(path: Path, findings: Path, code: int) -> Report:
    report = Report(path.name)
    with findings.open("rb") as stream:
        while stream.peek(1):
            report.findings.append(pickle.load(stream))
    last = report.findings[-1] if report.findings else None
    report.part = last.part if last is not None else ""
    after = f" after '{last.rule}'" if last is not None else ""
    report.add("crash", [f"the process that ran the FMU {end_of(code)}{after}"], "")
    report.skip("the rest", "the FMU ends the process")
    return report


def main(job: str, result: str, findings: str) -> None:
    """Check, and write the report or the error."""
    from .checking import check

    path, options = pickle.loads(Path(job).read_bytes())
    found: Report | RailcosimError
    try:
        found = check(path, findings=Path(findings), **options)
        found.file = None
    except RailcosimError as error:
        found = error
    Path(result).write_bytes(pickle.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
