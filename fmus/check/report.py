"""What a check finds, and its text."""

from dataclasses import dataclass, field

from ..info import table


@dataclass(frozen=True)
class Finding:
    """One rule: passed True or False, or None where it could not be checked, and why."""

    rule: str
    passed: bool | None
    detail: str


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


@dataclass
class Report:
    """All findings on one FMU, and the comparison with a reference."""

    name: str
    findings: list[Finding] = field(default_factory=list)
    comparisons: list[Comparison] = field(default_factory=list)
    reference: str = ""

    def add(self, rule: str, problems: list[str], good: str) -> None:
        """Add a finding that passes if there are no problems."""
        self.findings.append(Finding(rule, not problems, "; ".join(problems) or good))

    def skip(self, rule: str, why: str) -> None:
        """Add a rule that could not be checked."""
        self.findings.append(Finding(rule, None, why))

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(f.passed is not False for f in self.findings) and all(
            c.passed for c in self.comparisons
        )

    def __str__(self) -> str:
        words = {True: "pass", False: "FAIL", None: "–"}
        lines = [self.name]
        lines += table([(words[f.passed], f.rule, f.detail) for f in self.findings])
        if self.comparisons:
            lines += ["", f"  against {self.reference}"]
            rows = [("variable", "unit", "max error", "at t / s", "tolerance", "")]
            for c in self.comparisons:
                numbers = (f"{c.error:.3g}", f"{c.time:g}", f"{c.tolerance:.3g}")
                rows.append((c.variable, c.unit, *numbers, words[c.passed]))
            lines += table(rows, right=(2, 3, 4))
        failed = sum(f.passed is False for f in self.findings)
        failed += sum(not c.passed for c in self.comparisons)
        lines += ["", "passed" if not failed else f"{failed} of the checks failed"]
        return "\n".join(lines)
