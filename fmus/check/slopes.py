"""Checks of input derivatives (interpolation) and output derivatives in co-simulation."""

import numpy as np

from .equations import OwnEquations
from .excitation import COARSE, SEED, Excitation
from .instance import CO_SIMULATION
from .own import OwnValues
from .ramps import check_input_derivatives
from .report import Nothing, Report, Result, Unchecked
from .stepping import Stepper, changes
from .subject import Subject

POINTS = 10


def check_slopes(
    subject: Subject, excitation: Excitation, equations: OwnEquations | None, report: Report
) -> None:
    """Add the findings on input and output derivatives, where they are declared."""
    if subject.declares(CO_SIMULATION, "canInterpolateInputs"):
        report.judge("input derivatives", lambda: check_input_derivatives(subject, excitation))
    else:
        report.undeclared("input derivatives", "canInterpolateInputs")
    if subject.declares(CO_SIMULATION, "maxOutputDerivativeOrder"):
        report.judge("output derivatives", lambda: _outputs(subject, excitation, equations))
    else:
        report.undeclared("output derivatives", "maxOutputDerivativeOrder")


def _outputs(subject: Subject, excitation: Excitation, equations: OwnEquations | None) -> Result:
    """Compare with central differences over small steps while the inputs are held."""
    own = None if equations is None else OwnValues(subject, equations)
    order = subject.description.coSimulation.maxOutputDerivativeOrder
    real = subject.continuous(subject.outputs)
    if not real:
        raise Nothing("the FMU has no continuous output")
    part = excitation.held()
    places = list(range(COARSE // 2, len(part.times) - 2, COARSE))
    chosen = np.random.default_rng(SEED + 9).permutation(len(places))[:POINTS]
    if not places:
        raise Unchecked(f"needs {COARSE} steps; give a longer --stop")
    variable = subject.declares(CO_SIMULATION, "canHandleVariableCommunicationStepSize")
    h = part.step / (20.0 if variable else 1.0)
    found = _Differences(subject, real, part, h)
    for k in sorted(places[i] for i in chosen):
        found.visit(k, own)
    problems = list(found.problems.values())
    text = f"order 1 at {len(chosen)} points: {found.compared} agree with differences to 1e-3"
    if own is not None:
        problems += own.problems.values()
        text += f", all with the equations to {own.worst:.1g}"
    if not found.compared and own is None:
        raise Unchecked("the outputs are not smooth enough for differences")
    return problems, text + (f"; orders to {order} were not tried" if order > 1 else "")


class _Differences:
    """Output derivatives against differences of five points, h (s) apart."""

    def __init__(
        self, subject: Subject, names: list[str], excitation: Excitation, h: float
    ) -> None:
        self.subject, self.names, self.excitation, self.h = subject, names, excitation, h
        self.problems: dict[str, str] = {}
        self.compared = 0

    def visit(self, k: int, own: OwnValues | None) -> None:
        """Run afresh to two steps before point k, and through it in small steps."""
        stepper, h = Stepper(self.subject, self.excitation), self.h
        instance, middle = stepper.instance, float(self.excitation.times[k])
        try:
            stepper.begin()
            while stepper.place < k - 2:
                stepper.step()
            now = float(self.excitation.times[stepper.place])
            instance.inputs(self.excitation.row(k, stepper.names))
            rows, slopes = [], np.empty(0)
            for j in range(-2, 3):
                then = middle + j * h
                instance.advance(now, then - now) if then > now else instance.fetch()
                now = then
                rows.append(instance.outputs())
                if j == 0:
                    slopes = instance.get_slopes(self.names)
                    if own is not None:
                        own.slopes(instance, now)
        finally:
            stepper.close()
        self._compare(np.array(rows), slopes)

    def _compare(self, rows: np.ndarray, slopes: np.ndarray) -> None:
        if changes(rows, self.subject.columns(self.subject.markers)).any():
            return
        y = rows[:, self.subject.columns(self.names)]
        narrow, wide = (y[3] - y[1]) / (2.0 * self.h), (y[4] - y[0]) / (4.0 * self.h)
        slope, doubt = (4.0 * narrow - wide) / 3.0, np.abs(narrow - wide)
        sizes = np.array([self.subject.size(n) for n in self.names])
        noise = (1e-9 * np.abs(y).max(axis=0) + 1e-12 * sizes) / self.h
        scale = np.fmax(np.abs(slope), np.abs(slopes)) + noise
        decided = (doubt <= 0.1 * scale) | ~np.isfinite(slopes)
        self.compared += int(decided.sum())
        for i in np.flatnonzero(
            decided & ~(np.abs(slopes - slope) <= 1e-3 * scale + doubt + noise)
        ):
            text = f"d{self.names[i]}/dt is {slopes[i]:.6g}, by differences {slope[i]:.6g}"
            self.problems.setdefault(self.names[i], text)
