"""Checks of a model-exchange FMU on its way: at random points of CVode's run, and after events."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import FmuError
from .continuation import TINY, Continuation, saved
from .derivatives import Dependencies, Slopes
from .excitation import SEED, Excitation
from .instance import MODEL_EXCHANGE, Instance
from .own import OwnValues
from .places import Continuous
from .report import Report, Result, Unchecked
from .stepping import differing
from .subject import Subject
from .worker import run_elsewhere

POINTS, AFTER_EVENTS = 20, 10
STEPS = 5


@dataclass
class Probes:
    """What is found at points of a run; each rule that broke off says so in `broken`."""

    subject: Subject
    excitation: Excitation
    instance: Instance
    own: OwnValues | None
    generator: np.random.Generator = field(default_factory=lambda: np.random.default_rng(SEED + 7))
    slopes: Slopes = field(default_factory=Slopes)
    dependencies: Dependencies = field(default_factory=Dependencies)
    vectors: dict[str, str] = field(default_factory=dict)
    states: dict[str, str] = field(default_factory=dict)
    tasks: list[tuple[Continuation, np.ndarray]] = field(default_factory=list)
    broken: dict[str, str] = field(default_factory=dict)
    visited: int = 0
    events: int = 0

    def __post_init__(self) -> None:
        last = len(self.excitation.times) - 1
        chosen = self.generator.choice(last, min(POINTS, last), replace=False) + 1
        self._points = set(chosen.tolist())

    def visit(self, time: float) -> None:
        """Probe if this is one of the chosen points, or follows an event."""
        place = (time - float(self.excitation.times[0])) / self.excitation.step
        if abs(place - round(place)) < 1e-6:
            if round(place) not in self._points:
                return
            self._points.discard(round(place))
        elif self.events >= AFTER_EVENTS:
            return
        else:
            self.events += 1
        self.visited += 1
        declares = self.subject.declares
        self._try("states and derivatives", self._vectors)
        if declares(MODEL_EXCHANGE, "canGetAndSetFMUstate"):
            self._try("FMU state", lambda: self._state(time))
        if self.own is not None:
            own = self.own
            self._try("equations", lambda: own.visit(self.instance, time, self.generator))
        if self.subject.states or not self.subject.derivatives:
            self._try("dependencies", lambda: self._at_place(self.dependencies))
            if declares(MODEL_EXCHANGE, "providesDirectionalDerivative"):
                self._try("directional derivatives", lambda: self._at_place(self.slopes))

    def _try(self, rule: str, probe: Callable[[], None]) -> None:
        if rule in self.broken:
            return
        try:
            probe()
        except FmuError as error:
            self.broken[rule] = str(error)

    def _at_place(self, rule: Slopes | Dependencies) -> None:
        place = Continuous(self.subject, self.instance)
        rule.visit(place, self.generator)
        place.recover()

    def _vectors(self) -> None:
        """The vector functions and fmi2GetReal must show the same."""
        for names, vector, what in (
            (self.subject.states, self.instance.get_states(), "fmi2GetContinuousStates"),
            (self.subject.derivatives, self.instance.get_derivatives(), "fmi2GetDerivatives"),
        ):
            for name, a, b in zip(names, self.instance.read(names), vector, strict=False):
                if a != b:
                    text = f"{name} is {b:.17g} by {what}, {a:.17g} by fmi2GetReal"
                    self.vectors.setdefault(name, text)

    def _state(self, time: float) -> None:
        """Go on twice from one state, and once more from its bytes in another process."""
        step = TINY * self.excitation.step
        times = tuple(time + k * step for k in range(STEPS + 1))
        going, instance = Continuation(times), self.instance
        with saved(instance) as state:
            first = going.run(instance)
            instance.restore(state)
            second = going.run(instance)
            instance.restore(state)
            if self.subject.declares(MODEL_EXCHANGE, "canSerializeFMUstate"):
                task = replace(going, state=instance.to_bytes(state))
                self.tasks.append((task, first))
        for problem in self.differences(first, second):
            self.states.setdefault(problem.split()[0], f"{problem} (from t = {time:.6g} s)")

    def differences(self, a: np.ndarray, b: np.ndarray) -> list[str]:
        """Say what differs between two continuations."""
        d = self.subject.description
        states = [f"x[{i}]" for i in range(d.numberOfContinuousStates)]
        slopes = [f"dx[{i}]" for i in range(d.numberOfContinuousStates)]
        indicators = [f"z[{i}]" for i in range(d.numberOfEventIndicators)]
        return differing(a, b, [*states, *slopes, *indicators, *self.subject.watched])

    # Results

    def report(self, report: Report) -> None:
        """Add the findings."""
        declares = self.subject.declares
        where = f"at {self.visited} points of the run"
        if self.events:
            where += f", {self.events} of them after events"
        same = f"vectors and variables show the same {where}"
        self._add(report, "states and derivatives", lambda: (list(self.vectors.values()), same))
        self._add(report, "dependencies", self.dependencies.result)
        if declares(MODEL_EXCHANGE, "providesDirectionalDerivative"):
            self._add(report, "directional derivatives", self.slopes.result)
        else:
            report.undeclared("directional derivatives", "providesDirectionalDerivative")
        self._report_states(report, where)
        if self.own is not None:
            self._add(report, "equations", self.own.result)

    def _report_states(self, report: Report, where: str) -> None:
        declares = self.subject.declares
        if not declares(MODEL_EXCHANGE, "canGetAndSetFMUstate"):
            report.undeclared("FMU state", "canGetAndSetFMUstate")
            report.undeclared("serialized state", "canSerializeFMUstate")
            return
        good = f"restored {where}: goes on to the same bits"
        self._add(report, "FMU state", lambda: (list(self.states.values()), good))
        if not declares(MODEL_EXCHANGE, "canSerializeFMUstate"):
            report.undeclared("serialized state", "canSerializeFMUstate")
        elif report.findings[-1].passed:
            report.judge("serialized state", self._elsewhere)
        else:
            report.skip("serialized state", "needs an FMU state that works")

    def _add(self, report: Report, rule: str, run: Callable[[], Result]) -> None:
        if rule in self.broken:
            report.add(rule, [self.broken[rule]], "")
        else:
            report.judge(rule, run)

    def _elsewhere(self) -> Result:
        if not self.tasks:
            raise Unchecked("no state was saved")
        problems = []
        tasks = [task for task, _ in self.tasks]
        found = run_elsewhere(self.subject, MODEL_EXCHANGE, tasks)
        for (task, expected), rows in zip(self.tasks, found, strict=True):
            at = f"from t = {task.times[0]:.6g} s"
            differences = [rows] if isinstance(rows, str) else self.differences(rows, expected)
            problems += [f"{problem} ({at})" for problem in differences]
        return problems, f"{len(tasks)} states go on in a second process to the same bits"
