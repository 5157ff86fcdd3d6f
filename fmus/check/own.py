"""Checks of our FMUs against the equations they carry: values and derivatives, to rounding."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from .derivatives import MOST
from .equations import OwnEquations
from .excitation import SEED, Excitation
from .instance import Instance
from .places import Initial, elsewhere, nearby
from .report import Report, Result, Unchecked
from .stepping import Stepper
from .subject import Subject

EXACT = 1e-12  # relative: the same operations, but for the library's functions
POINTS = 20  # along a run
START_PLACES = 10  # in initialization mode, at random values of everything
_KINDS = {"x": "states", "u": "inputs", "p": "parameters", "d": "discrete"}


@dataclass
class OwnValues:
    """Derivatives, outputs and their derivatives against the equations, collected over places."""

    subject: Subject
    equations: OwnEquations
    problems: dict[str, str] = field(default_factory=dict)
    worst: float = 0.0
    places: int = 0

    @cached_property
    def _forward(self) -> Any:
        return self.equations.function.forward(1)

    @cached_property
    def unknowns(self) -> list[str]:
        """Derivatives, then computed outputs."""
        return [*self.subject.derivatives, *self.equations.names["outputs"]]

    def visit(self, instance: Instance, time: float, generator: np.random.Generator) -> None:
        """Compare where the instance stands."""
        names = self.equations.names
        given = {key: instance.read(names[kind]) for key, kind in _KINDS.items()}
        expected = self.equations.function(t=time, **given)
        rows = np.concatenate([np.array(expected[key]).ravel() for key in ("dx", "y")])
        if not np.isfinite(rows).all():
            return
        self.places += 1
        found = instance.read(self.unknowns)
        sizes = [self.subject.size(n, v) for n, v in zip(self.unknowns, rows, strict=True)]
        self._compare("{} is {:.17g}, by its equations {:.17g}", found, rows, np.array(sizes))
        self._directional(instance, {"t": time, **given}, rows, generator)

    def _directional(
        self, instance: Instance, given: dict[str, Any], rows: np.ndarray, generator: Any
    ) -> None:
        if not self.subject.declares(instance.interface, "providesDirectionalDerivative"):
            return
        n, names = len(self.subject.states), self.equations.names
        columns = [(key, i) for key in "xup" for i in range(len(names[_KINDS[key]]))]
        for k in generator.permutation(len(columns))[:MOST]:
            key, i = columns[k]
            known = names[_KINDS[key]][i]
            seed = np.zeros(len(given[key]))
            seed[i] = 1.0
            out = {"out_dx": rows[:n], "out_y": rows[n:]}
            result = self._forward(**given, **out, **{f"fwd_{key}": seed})
            exact = np.concatenate([np.array(result[f"fwd_{y}"]).ravel() for y in ("dx", "y")])
            found = instance.directional(self.unknowns, [known], [1.0])
            text = f"∂{{}}/∂{known} is {{:.17g}}, by its equations {{:.17g}}"
            self._compare(text, found, exact, np.abs(exact) + 1e-300)

    def slopes(self, instance: Instance, time: float) -> None:
        """Compare the output derivatives where the instance stands with inputs at rest."""
        names = self.equations.names
        given = {key: instance.read(names[kind]) for key, kind in _KINDS.items()}
        expected = self.equations.function(t=time, **given)
        dx, y = (np.array(expected[key]).ravel() for key in ("dx", "y"))
        result = self._forward(t=time, **given, out_dx=dx, out_y=y, fwd_t=1.0, fwd_x=dx)
        exact = np.array(result["fwd_y"]).ravel()
        found = instance.get_slopes(names["outputs"])
        sizes = np.maximum(np.abs(exact), float(np.max(np.abs(dx), initial=0.0)))
        self.places += 1
        keep = len(self.subject.states)
        text = "d{}/dt is {:.17g}, by its equations {:.17g}"
        self._compare(text, found, exact, sizes + 1e-300, keep)

    def _compare(
        self, text: str, found: np.ndarray, exact: np.ndarray, sizes: np.ndarray, first: int = 0
    ) -> None:
        error = np.abs(found - exact) / sizes
        self.worst = max(self.worst, float(np.max(error, initial=0.0)))
        for i in np.flatnonzero(~(error <= EXACT)):
            name = self.unknowns[first + i]
            self.problems.setdefault(name, text.format(name, found[i], exact[i]))

    def result(self) -> Result:
        """Return the rule's result over all places."""
        if not self.places:
            raise Unchecked("the equations give no finite values anywhere")
        text = f"derivatives and outputs at {self.places} places are what the equations give"
        return list(self.problems.values()), f"{text}, to {self.worst:.1g} (allowed {EXACT:g})"


def check_equations(
    subject: Subject, equations: OwnEquations, excitation: Excitation, report: Report
) -> None:
    """Add the finding at points of a co-simulation, and at random start values and modes."""
    report.judge("equations", lambda: _along(subject, equations, excitation))


def _along(subject: Subject, equations: OwnEquations, excitation: Excitation) -> Result:
    own, generator = OwnValues(subject, equations), np.random.default_rng(SEED + 10)
    stepper = Stepper(subject, excitation)
    try:
        place = Initial(subject, stepper.instance, float(excitation.times[0]))
        for _ in range(START_PLACES):
            own.visit(stepper.instance, place.time, generator)
            values = nearby(place, generator)
            for i, name in enumerate(place.knowns):
                if not place.is_real(name) and generator.random() < 0.5:
                    values[i] = elsewhere(place, i, generator)
            place.move(values)
        stepper.instance.reset()
        stepper.begin()
        points = generator.integers(0, len(excitation.times), POINTS)
        for point in sorted(set(points.tolist())):
            while stepper.place < point and stepper.step():
                pass
            own.visit(stepper.instance, float(excitation.times[stepper.place]), generator)
        return own.result()
    finally:
        stepper.close()
