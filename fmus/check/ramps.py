"""Checks of input derivatives: does an input move within a step as it is told to?"""

from dataclasses import dataclass

import numpy as np

from .continuation import saved
from .excitation import COARSE, SEED, Excitation, draw
from .instance import CO_SIMULATION, Instance
from .report import Nothing, Result, Unchecked
from .stepping import Stepper, signal_size, together
from .subject import Subject

STEPS = 100  # of the ramps
PARTS = 16  # small steps with held inputs that stand for a ramp over one step
SHARE = 0.2  # of a held input's error, that an interpolated one may have


@dataclass(frozen=True)
class _Ramps:
    """Inputs on straight lines from point to point: values at the points, slopes after them."""

    excitation: Excitation
    names: list[str]  # those that move
    slopes: np.ndarray  # one row for each step

    def at(self, k: int, offset: float = 0.0) -> list[float]:
        """Return all inputs at `offset` (s) after point k."""
        row = {name: float(values[k]) for name, values in self.excitation.inputs.items()}
        for name, slope in zip(self.names, self.slopes[k], strict=True):
            row[name] += slope * offset
        return list(row.values())

    def span(self, k: int) -> tuple[float, float]:
        """Return the begin and end of step k in s."""
        return float(self.excitation.times[k]), float(self.excitation.times[k + 1])


def check_input_derivatives(subject: Subject, excitation: Excitation) -> Result:
    """Judge the FMU's interpolation of inputs; raise Unchecked if nothing shows it."""
    ramps = _ramps(subject, excitation)
    problems, good = _judge(
        subject,
        fine=_run(subject, ramps, parts=PARTS),
        moved=_run(subject, ramps, slopes=True),
        held=_run(subject, ramps),
        parted=_run(subject, ramps, parts=PARTS, moving=False),
    )
    lasting = _lasts(subject, ramps)
    good += "; acts until it is set again" if lasting else "; acts for one step"
    if lasting and subject.is_ours:
        problems.append("a derivative that was not set again still acts in the next step")
    if subject.declares(CO_SIMULATION, "canGetAndSetFMUstate"):
        good += ", belongs to the state"
        if not _is_in_state(subject, ramps):
            problems.append("input derivatives do not belong to the FMU state")
    return problems, good


def _ramps(subject: Subject, excitation: Excitation) -> _Ramps:
    part = excitation.first(STEPS)
    names = subject.continuous(subject.inputs)
    if not names:
        raise Nothing("the FMU has no continuous input")
    if len(part.times) < 3:
        raise Unchecked("needs two steps; give a longer --stop")
    generator = np.random.default_rng(SEED + 8)
    inputs, slopes = dict(part.inputs), np.empty((len(part.times) - 1, len(names)))
    knots = np.append(part.times[::COARSE], part.times[-1] + COARSE * part.step)
    for i, name in enumerate(names):
        heights = draw(subject.variables[name], len(knots), generator)
        inputs[name] = np.interp(part.times, knots, heights)
        slopes[:, i] = np.diff(inputs[name]) / np.diff(part.times)
    return _Ramps(Excitation(part.times, inputs, "ramps"), names, slopes)


def _judge(
    subject: Subject,
    *,
    fine: np.ndarray,
    moved: np.ndarray,
    held: np.ndarray,
    parted: np.ndarray,
) -> Result:
    """An interpolated input must come much nearer to the ramp than a held one does.

    But for what the solver's shorter steps do, which inputs held over them all show (`parted`).
    Counts and places, which jump, are left out.
    """
    same = together(fine, moved, subject.columns(subject.markers))
    problems, worst, told = [], 0.0, False
    for i, name in enumerate(subject.outputs):
        plain, error, steps = (
            float(np.max(np.abs(a[same, i] - b[same, i]), initial=0.0))
            for a, b in ((held, fine), (moved, fine), (parted, held))
        )
        jumps = not np.mod(np.array([fine[:, i], moved[:, i], held[:, i]]), 1.0).any()
        if jumps or plain <= max(1e-9 * signal_size(fine[:, i]), steps):
            continue
        told = True
        share = max(error - steps, 0.0) / plain
        worst = max(worst, share)
        if not share <= SHARE:
            had = error / plain
            problems.append(f"{name} has {had:.2g} of the error on a ramp that held inputs have")
    if not told:
        raise Unchecked("no output shows whether an input moves within a step")
    return problems, f"leave {worst:.1g} of the error on a ramp that held inputs have"


def _step(
    instance: Instance,
    row: list[float] | None,
    names: list[str],
    slopes: np.ndarray | None,
    span: tuple[float, float],
) -> tuple[float, ...]:
    """Set inputs and slopes, unless they are None, and make a step; return what is watched."""
    if row is not None:
        instance.inputs(row)
        instance.put()
    if slopes is not None:
        instance.set_slopes(names, slopes)
    instance.time = span[0]
    instance.call("doStep", span[0], span[1] - span[0])
    instance.fetch()
    return instance.outputs()


def _run(
    subject: Subject, ramps: _Ramps, *, slopes: bool = False, parts: int = 1, moving: bool = True
) -> np.ndarray:
    """Run along the ramps: with input derivatives, or held in each of the parts of a step.

    Without `moving` they are held over the whole step, also if it is made in parts.
    """
    stepper = Stepper(subject, ramps.excitation)
    try:
        stepper.begin()
        for k in range(len(ramps.slopes)):
            begin, end = ramps.span(k)
            step, row = end - begin, ()
            for part in range(parts):
                offset = (part + 0.5) / parts * step if parts > 1 and moving else 0.0
                last = part + 1 == parts
                span = (
                    begin + part / parts * step,
                    end if last else begin + (part + 1) / parts * step,
                )
                chosen = ramps.slopes[k] if slopes else None
                row = _step(stepper.instance, ramps.at(k, offset), ramps.names, chosen, span)
            stepper.rows.append(row)
        return np.array(stepper.rows)
    finally:
        stepper.close()


def _lasts(subject: Subject, ramps: _Ramps) -> bool:
    """Whether input derivatives that were set once act in a second step, too."""
    ends = []
    for second in (None, np.zeros(len(ramps.names))):
        stepper = Stepper(subject, ramps.excitation)
        try:
            stepper.begin()
            instance = stepper.instance
            _step(instance, ramps.at(0), ramps.names, ramps.slopes[0], ramps.span(0))
            ends.append(_step(instance, ramps.at(1), ramps.names, second, ramps.span(1)))
        finally:
            stepper.close()
    return ends[0] != ends[1]


def _is_in_state(subject: Subject, ramps: _Ramps) -> bool:
    """Whether a saved state holds the input derivatives that were set before."""
    stepper = Stepper(subject, ramps.excitation)
    try:
        stepper.begin()
        instance = stepper.instance
        instance.inputs(ramps.at(0))
        instance.put()
        instance.set_slopes(ramps.names, ramps.slopes[0])
        with saved(instance) as state:
            ends = [_step(instance, None, [], None, ramps.span(0))]
            instance.set_slopes(ramps.names, -2.0 * ramps.slopes[0])
            instance.restore(state)
            ends.append(_step(instance, None, [], None, ramps.span(0)))
        return ends[0] == ends[1]
    finally:
        stepper.close()
