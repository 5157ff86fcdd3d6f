"""Checks of saving, restoring and serializing the state of a co-simulation FMU."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import FmuError
from .continuation import Continuation
from .excitation import SEED, Excitation
from .instance import CO_SIMULATION, FATAL, Instance
from .report import Report, Result, Unchecked
from .stepping import Stepper, changes, differing
from .subject import Subject
from .worker import run_elsewhere

POINTS, AT_EVENTS = 50, 10  # random points, and points beside events
STEPS = 10  # to go on: an input changes within them
ELSEWHERE = 5  # restored into a second instance of ours


@dataclass(frozen=True)
class _Saved:
    """A state with the point it belongs to, and how to go on from it."""

    state: object
    place: int
    after_inputs: bool
    continuation: Continuation


@dataclass
class _Walk:
    """A run that saved its state at many points, and the rows that it gave."""

    stepper: Stepper
    saved: list[_Saved]
    rows: np.ndarray

    @property
    def instance(self) -> Instance:
        return self.stepper.instance


def check_state(subject: Subject, excitation: Excitation, base: np.ndarray, report: Report) -> None:
    """Add the findings on the FMU's state, where it declares that it has one."""
    rules = (("FMU state", "canGetAndSetFMUstate"), ("serialized state", "canSerializeFMUstate"))
    if not subject.declares(CO_SIMULATION, "canGetAndSetFMUstate"):
        for rule, attribute in rules:
            report.undeclared(rule, attribute)
        return
    if not report.judge("FMU state", lambda: _round_trip(subject, excitation, base)):
        report.skip("serialized state", "needs an FMU state that works")
    elif not subject.declares(CO_SIMULATION, "canSerializeFMUstate"):
        report.undeclared(*rules[1])
    else:
        report.judge("serialized state", lambda: _elsewhere(subject, excitation, base))


def _points(subject: Subject, rows: np.ndarray) -> list[int]:
    """Return random points, and some before and after discrete variables changed."""
    generator = np.random.default_rng(SEED + 2)
    last = len(rows) - 1
    found = set(generator.choice(last, min(POINTS, last), replace=False).tolist())
    if subject.discrete:
        steps = np.flatnonzero(_eventful(subject, rows))
        some = generator.permutation(steps)[: AT_EVENTS // 2]
        found |= {int(k) for k in some} | {int(k) + 1 for k in some if k + 1 < last}
    return sorted(found)


@contextmanager
def _walk(subject: Subject, excitation: Excitation, base: np.ndarray) -> Iterator[_Walk]:
    """Run once through, saving states: every second one between setting inputs and the step."""
    stepper = Stepper(subject, excitation)
    saved: list[_Saved] = []
    try:
        stepper.begin()
        for number, place in enumerate(_points(subject, base)):
            while stepper.place < place:
                stepper.step()
            after_inputs = bool(number % 2)
            if after_inputs:
                stepper.put()
            going = _going_on(stepper, after_inputs)
            saved.append(_Saved(stepper.instance.save(), place, after_inputs, going))
        yield _Walk(stepper, saved, stepper.finish())
    finally:
        for one in saved:
            with suppress(FmuError):
                stepper.instance.release(one.state)
        stepper.close()


def _going_on(stepper: Stepper, after_inputs: bool) -> Continuation:
    places = range(stepper.place, min(stepper.place + STEPS, len(stepper.excitation.times) - 1))
    inputs: list[tuple[float, ...] | None] = [
        tuple(stepper.excitation.row(k, stepper.names)) for k in places
    ]
    if after_inputs:
        inputs[0] = None  # they are in the state
    times = stepper.excitation.times[places.start : places.stop + 1]
    return Continuation(tuple(times.tolist()), tuple(inputs))


def _round_trip(subject: Subject, excitation: Excitation, base: np.ndarray) -> Result:
    with _walk(subject, excitation, base) as walk:
        problems = [
            f"saving disturbs the run: {p}" for p in differing(walk.rows, base, subject.watched)
        ]
        order = np.random.default_rng(SEED + 3).permutation(len(walk.saved))
        errors = 0
        for number, one in enumerate(walk.saved[i] for i in order):
            if number % 3 == 2:
                errors += _provoke(subject, walk.instance, one, excitation.step)
            walk.instance.restore(one.state)
            problems += _compare(walk.instance, one, base, subject)
        if subject.is_ours:
            problems += _second_instance(subject, walk, base)
        after = f", {errors} of them after an error" if errors else ""
        return problems, (
            f"{_count(subject, base, walk.saved)}, half between set and step{after}: goes on to "
            "the same bits"
        )


def _count(subject: Subject, base: np.ndarray, saved: list[_Saved]) -> str:
    """Say how many states there are."""
    random = min(POINTS, len(base) - 1)
    beside = f" and {len(saved) - random} beside events" if len(saved) > random else ""
    return f"states at {random} random points{beside}"


def _eventful(subject: Subject, rows: np.ndarray) -> np.ndarray:
    return changes(rows, subject.columns(subject.markers or subject.discrete))


def _compare(instance: Instance, one: _Saved, base: np.ndarray, subject: Subject) -> list[str]:
    """Go on from the restored state, and say what differs from the run as it was."""
    at = f"from t = {one.continuation.times[0]:.6g} s"
    problems = []
    if not one.after_inputs:
        instance.fetch()
        now = np.array([instance.outputs()])
        problems = differing(now, base[one.place : one.place + 1], subject.watched)
    rows = one.continuation.run(instance)
    expected = base[one.place + 1 : one.place + 1 + len(rows)]
    return [f"{p} ({at})" for p in [*problems, *differing(rows, expected, subject.watched)]]


def _provoke(subject: Subject, instance: Instance, one: _Saved, step: float) -> int:
    """Make a mistake: a step from a wrong time, or backwards. Return 1 if the FMU minds it.

    In ours the model fails as well, by inputs that no number can follow.
    """
    time = one.continuation.times[0]
    if subject.is_ours and subject.inputs:
        instance.restore(one.state)
        instance.inputs([1e306] * len(subject.inputs))
        instance.put()
        return int(instance.try_step(time, step) == FATAL - 1) or _misstep(instance, time, step)
    return _misstep(instance, time, step)


def _misstep(instance: Instance, time: float, step: float) -> int:
    status = instance.try_step(time + 3.0 * step, step)
    if status < FATAL - 1:
        status = instance.try_step(time, -step)
    if status == FATAL:
        raise Unchecked("a step from a wrong time is fatal to the FMU; the rest was not tried")
    return int(status == FATAL - 1)


def _second_instance(subject: Subject, walk: _Walk, base: np.ndarray) -> list[str]:
    """FMI does not promise it, our FMUs do: a state fits every instance of the FMU."""
    other = subject.instance(CO_SIMULATION, "other")
    try:
        problems = []
        for one in walk.saved[:ELSEWHERE]:
            other.restore(one.state)
            problems += [f"second instance: {p}" for p in _compare(other, one, base, subject)]
        return problems
    finally:
        other.close()


def _elsewhere(subject: Subject, excitation: Excitation, base: np.ndarray) -> Result:
    with _walk(subject, excitation, base) as walk:
        saved = walk.saved
        tasks = [
            replace(one.continuation, state=walk.instance.to_bytes(one.state)) for one in saved
        ]
    problems = []
    for one, rows in zip(saved, run_elsewhere(subject, CO_SIMULATION, tasks), strict=True):
        at = f"from t = {one.continuation.times[0]:.6g} s"
        if isinstance(rows, str):
            problems.append(f"{rows} ({at})")
            continue
        expected = base[one.place + 1 : one.place + 1 + len(rows)]
        problems += [f"{p} ({at})" for p in differing(rows, expected, subject.watched)]
    sizes = {len(task.state) for task in tasks}
    size = f"{min(sizes)} to {max(sizes)}" if len(sizes) > 1 else str(max(sizes, default=0))
    return problems, (
        f"{len(tasks)} states of {size} bytes go on in a second process to the same bits"
    )
