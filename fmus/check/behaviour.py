"""Checks of co-simulation runs: several instances, threads, reset, communication steps."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import number_of
from .excitation import COARSE, SEED, Excitation
from .gap import BEYOND, SMOOTH, Gap
from .instance import CO_SIMULATION
from .report import Report, Result
from .stepping import Stepper, differing, trajectory
from .subject import Subject

THREADS = 2
SETTLES = 0.75  # of the change by half a step, that a quarter may still make


def check_run(subject: Subject, excitation: Excitation, report: Report) -> np.ndarray | None:
    """Add the findings of a plain run; return its rows, or None if the FMU does not run."""
    try:
        base = trajectory(subject, excitation)
    except FmuError as error:
        report.add("runs", [str(error)], "")
        return None
    outputs = base[:, : len(subject.outputs)]
    finite = bool(np.isfinite(outputs).all())
    report.add("runs", [] if finite else ["an output is not finite"], excitation.text)
    check_bounds(subject, outputs, report)
    return base if finite else None


def check_instances(
    subject: Subject, excitation: Excitation, base: np.ndarray, report: Report
) -> None:
    """Add the findings on several instances and on reset."""
    if subject.declares(CO_SIMULATION, "canBeInstantiatedOnlyOncePerProcess"):
        why = "the FMU declares that it can be instantiated only once (per process)"
        report.skip("two instances", why)
    else:
        report.judge("two instances", lambda: _two(subject, excitation, base))
        report.judge("threads", lambda: _threads(subject, excitation, base))
    report.judge("reset", lambda: _reset(subject, excitation, base))


def check_bounds(subject: Subject, rows: np.ndarray, report: Report) -> None:
    """Warn of outputs that leave their own bounds; say nothing where none has bounds."""
    problems, bounded = [], 0
    for i, name in enumerate(subject.outputs):
        variable = subject.variables[name]
        low = number_of(variable, "min", -np.inf)
        high = number_of(variable, "max", np.inf)
        if low == -np.inf and high == np.inf:
            continue
        bounded += 1
        least, most = rows[:, i].min(), rows[:, i].max()
        if least < low or most > high:
            problems.append(f"{name} runs from {least:.6g} to {most:.6g}, outside [{low}, {high}]")
    if bounded:
        report.warn("bounds", problems, "outputs stay within their min and max")


def _two(subject: Subject, excitation: Excitation, base: np.ndarray) -> Result:
    """Run two instances in turns, the second one step behind."""
    first, second = (Stepper(subject, excitation, f"check{i}") for i in (1, 2))
    try:
        first.begin()
        second.begin()
        first.step()
        while first.step():
            second.step()
        second.finish()
        problems = [
            f"{which}: {problem}"
            for which, stepper in (("first", first), ("second", second))
            for problem in differing(np.array(stepper.rows), base, subject.watched)
        ]
        return problems, "in turns run as one alone does, to the last bit"
    finally:
        first.close()
        second.close()


def _threads(subject: Subject, excitation: Excitation, base: np.ndarray) -> Result:
    with ThreadPoolExecutor(THREADS) as pool:
        runs = list(pool.map(lambda _: trajectory(subject, excitation), range(THREADS)))
    problems = [p for rows in runs for p in differing(rows, base, subject.watched)]
    return problems, f"{THREADS} instances in {THREADS} threads run as one alone, to the last bit"


def _reset(subject: Subject, excitation: Excitation, base: np.ndarray) -> Result:
    stepper = Stepper(subject, excitation)
    try:
        stepper.begin()
        for _ in range(len(excitation.times) // 3):
            stepper.step()
        stepper.instance.reset()
        stepper.begin()
        found = differing(stepper.finish(), base, subject.watched)
        return found, "gives the same run again, to the last bit"
    finally:
        stepper.close()


# Communication steps


def check_steps(
    subject: Subject,
    excitation: Excitation,
    base: np.ndarray,
    tolerance: float | None,
    report: Report,
) -> None:
    """Add the finding on varying communication steps."""
    if not subject.declares(CO_SIMULATION, "canHandleVariableCommunicationStepSize"):
        report.undeclared("communication step", "canHandleVariableCommunicationStepSize")
    elif len(excitation.times) <= COARSE:
        report.skip("communication step", f"needs {COARSE} steps; give a longer --stop")
    else:
        report.judge("communication step", lambda: _steps(subject, excitation, base, tolerance))


def _steps(
    subject: Subject, excitation: Excitation, base: np.ndarray, tolerance: float | None
) -> Result:
    """Compare 1× with 10× and random steps under the same inputs, where those change."""
    under = excitation.held()
    same = all(np.array_equal(under.inputs[n], v) for n, v in excitation.inputs.items())
    fine = base if same else trajectory(subject, under)
    fine = fine[::COARSE]
    runs = {f"{COARSE}×": trajectory(subject, under, COARSE)}
    places, random = _uneven(under)
    runs["random"] = trajectory(subject, random)[places]
    gap = Gap()
    for kind, rows in runs.items():
        n = min(len(rows), len(fine))
        gap.add(subject, fine[:n], rows[:n], rows[:n], f" with {kind} steps")
    if tolerance is not None or gap.worst <= gap.allowed(subject, None):
        return gap.judge(f"1×, {COARSE}× and random steps agree", subject, tolerance)
    return _settling(subject, under, fine, gap.where)


def _settling(subject: Subject, excitation: Excitation, whole: np.ndarray, where: str) -> Result:
    """A solver that follows the communication step must settle as the step shrinks."""
    half, quarter = (
        trajectory(subject, _parted(excitation, parts))[:: COARSE * parts] for parts in (2, 4)
    )
    first, second = Gap(), Gap()
    first.add(subject, half, whole, whole, only_real=True)
    second.add(subject, quarter, half, half, only_real=True)
    text = f"half and quarter steps change the outputs by {first.worst:.2g} and {second.worst:.2g}"
    shrinks = first.worst <= BEYOND and second.worst <= SETTLES * first.worst
    if shrinks or first.worst <= SMOOTH:
        return [], f"{where}, as of a solver that follows the step: {text}, so they settle"
    return [f"{where}, and smaller steps do not settle: {text}"], ""


def _parted(excitation: Excitation, parts: int) -> Excitation:
    """Return the excitation with each step in equal parts."""
    count = len(excitation.times)
    fine = np.interp(np.arange((count - 1) * parts + 1) / parts, np.arange(count), excitation.times)
    held = {name: np.repeat(v, parts)[: len(fine)] for name, v in excitation.inputs.items()}
    return Excitation(fine, held, excitation.text)


def _uneven(excitation: Excitation) -> tuple[list[int], Excitation]:
    """Return the excitation with each ten steps parted at random, and where the tens begin."""
    generator = np.random.default_rng(SEED + 1)
    times, sources, places = [], [], []
    for k in range(0, len(excitation.times), COARSE):
        places.append(len(times))
        times.append(float(excitation.times[k]))
        sources.append(k)
        if k + COARSE < len(excitation.times):
            length = float(excitation.times[k + COARSE]) - times[-1]
            parts = np.sort(generator.uniform(0.02, 0.98, generator.integers(1, COARSE)))
            times += (times[-1] + length * parts).tolist()
            sources += [k] * len(parts)
    held = {name: values[sources] for name, values in excitation.inputs.items()}
    return places, Excitation(np.array(times), held, excitation.text)
