"""What a check finds, and its text."""

import pickle
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from ...base.errors import FmuError
from ..info import table

WIDTH = 100  # columns of the text
LISTED = 3  # problems of one rule that are spelled out


class Unchecked(Exception):  # noqa: N818  (not an error: a rule that says why it cannot judge)
    """Raised by a rule that cannot judge, with the reason."""


class Nothing(Exception):  # noqa: N818
    """Raised by a rule that has nothing to check in this FMU, with the reason."""


class Verdict(Enum):
    """How a rule came out."""

    PASS = "pass"
    FAIL = "FAIL"
    WARNING = "warn"
    UNCHECKED = "could not be checked"
    NOTHING = "nothing to check"  # the FMU does not claim it, or has nothing of the kind

    @property
    def word(self) -> str:
        """How the report prints it."""
        return self.value if len(self.value) == 4 else "–"


@dataclass(frozen=True)
class Finding:
    """One rule's verdict, with the problems or what was checked, and the part it belongs to."""

    rule: str
    verdict: Verdict
    detail: str
    part: str = ""

    @property
    def passed(self) -> bool | None:
        """True or False; None where the rule has no verdict, or only a warning."""
        return {Verdict.PASS: True, Verdict.FAIL: False}.get(self.verdict)


@dataclass(frozen=True)
class Comparison:
    """One variable against its reference: largest error, when, and what is allowed."""

    variable: str
    unit: str
    error: float
    time: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance (a NaN is not)."""
        return self.error <= self.tolerance


Result = tuple[list[str], str]  # a rule's problems, and what is good if there are none


@dataclass
class Report:
    """All findings on one FMU, and the comparison with a reference."""

    name: str
    findings: list[Finding] = field(default_factory=list)
    comparisons: list[Comparison] = field(default_factory=list)
    reference: str = ""
    part: str = ""  # what the findings added next belong to
    file: Path | None = None  # where each finding is written as well, should the process end

    def add(self, rule: str, problems: list[str], good: str) -> None:
        """Add a finding that passes if there are no problems."""
        verdict = Verdict.FAIL if problems else Verdict.PASS
        self._add(rule, verdict, _joined(problems) or good)

    def warn(self, rule: str, problems: list[str], good: str) -> None:
        """Add a finding whose problems are no failure."""
        verdict = Verdict.WARNING if problems else Verdict.PASS
        self._add(rule, verdict, _joined(problems) or good)

    def skip(self, rule: str, why: str) -> None:
        """Add a rule that could not be checked."""
        self._add(rule, Verdict.UNCHECKED, why)

    def undeclared(self, rule: str, attribute: str) -> None:
        """Add a capability that the FMU does not declare."""
        self.nothing(rule, f"not declared ({attribute})")

    def nothing(self, rule: str, why: str) -> None:
        """Add a rule for which there is nothing to check."""
        self._add(rule, Verdict.NOTHING, why)

    def judge(self, rule: str, run: Callable[[], Result]) -> bool:
        """Add what a rule finds: an FMU that breaks it off fails. Return whether it passed."""
        try:
            self.add(rule, *run())
        except Unchecked as reason:
            self.skip(rule, str(reason))
        except Nothing as reason:
            self.nothing(rule, str(reason))
        except FmuError as error:
            self.add(rule, [str(error)], "")
        return self.findings[-1].passed is True

    def _add(self, rule: str, verdict: Verdict, detail: str) -> None:
        self.findings.append(Finding(rule, verdict, detail, self.part))
        if self.file is not None:
            with self.file.open("ab") as stream:
                pickle.dump(self.findings[-1], stream)

    @property
    def failures(self) -> int:
        """How many rules and comparisons failed."""
        failed = sum(f.verdict is Verdict.FAIL for f in self.findings)
        return failed + sum(not c.passed for c in self.comparisons)

    @property
    def unchecked(self) -> int:
        """How many rules could not be checked."""
        return sum(f.verdict is Verdict.UNCHECKED for f in self.findings)

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return not self.failures

    def __str__(self) -> str:
        lines = [self.name, *self._findings()]
        if self.comparisons:
            lines += ["", *_wrapped(f"  against {self.reference}", 2)]
            rows = [("variable", "unit", "max error", "at t / s", "tolerance", "")]
            for c in self.comparisons:
                numbers = (f"{c.error:.3g}", f"{c.time:g}", f"{c.tolerance:.3g}")
                rows.append((c.variable, c.unit, *numbers, "pass" if c.passed else "FAIL"))
            lines += table(rows, right=(2, 3, 4))
        return "\n".join([*lines, "", self._verdict()])

    def _findings(self) -> list[str]:
        lines: list[str] = []
        width = max((len(f.rule) for f in self.findings), default=0)
        part = ""
        for f in self.findings:
            if f.part != part:
                lines += ["", f"  {f.part}"]
                part = f.part
            head = f"  {f.verdict.word:4}  {f.rule:{width}}  "
            lines += _wrapped(f"{head}{f.detail}", len(head))
        return lines

    def _verdict(self) -> str:
        failed, unchecked = self.failures, self.unchecked
        count = len(self.findings) + len(self.comparisons)
        text = "passed" if not failed else f"{failed} of {count} checks failed"
        return f"{text}; {unchecked} could not be checked" if unchecked else text


def _joined(problems: list[str]) -> str:
    shown = "; ".join(problems[:LISTED])
    more = len(problems) - LISTED
    return f"{shown}; and {more} more" if more > 0 else shown


def _wrapped(text: str, indent: int) -> list[str]:
    return textwrap.wrap(
        text, WIDTH, subsequent_indent=" " * indent, break_on_hyphens=False, drop_whitespace=True,
        break_long_words=False, replace_whitespace=False,
    )  # fmt: skip
