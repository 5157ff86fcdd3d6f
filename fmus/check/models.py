"""Checks of the model-exchange interface: plain runs, then probes on the way."""

import numpy as np

from ...base.errors import FmuError
from .behaviour import check_bounds
from .exchange import Exchanged, against_co_simulation, run_exchange
from .excitation import Excitation
from .instance import MODEL_EXCHANGE, Instance
from .own import OwnValues
from .probes import Probes
from .report import Report, Result, Unchecked
from .stepping import differing
from .subject import Subject

SHORT = 100  # steps of the runs that are repeated


def check_exchange(
    subject: Subject,
    excitation: Excitation,
    base: np.ndarray | None,
    own: OwnValues | None,
    tolerance: float | None,
    report: Report,
) -> np.ndarray | None:
    """Add the findings on model exchange, against the co-simulation's rows if there are any.

    Return what is watched at the communication points, or None if the FMU does not run.
    """
    instance = subject.instance(MODEL_EXCHANGE)
    try:
        run = _run(subject, excitation, instance, report)
        if run is None:
            return None
        if base is not None:
            report.judge(
                "against co-simulation",
                lambda: against_co_simulation(subject, run, base, tolerance),
            )
        report.judge("nominal values", lambda: _nominals(instance))
        report.judge("two instances, reset", lambda: _two(subject, excitation, instance))
    finally:
        instance.close()
    _probe(subject, excitation, own, report)
    return run.before


def _run(
    subject: Subject, excitation: Excitation, instance: Instance, report: Report
) -> Exchanged | None:
    try:
        run = run_exchange(subject, excitation, instance)
    except FmuError as error:
        report.add("runs", [str(error)], "")
        return None
    except Unchecked as reason:
        report.skip("runs", str(reason))
        return None
    outputs = run.before[:, : len(subject.outputs)]
    finite = bool(np.isfinite(outputs).all())
    problems = [] if finite else ["an output is not finite"]
    report.add("runs", problems, f"FMPy's CVode comes through; {excitation.text}")
    check_bounds(subject, outputs, report)
    return run if finite else None


def _nominals(instance: Instance) -> Result:
    names, found = [], instance.get_nominals()
    for i, value in enumerate(found):
        if not (value > 0.0 and np.isfinite(value)):
            names.append(f"state {i + 1} has the nominal value {value:g}, which is not positive")
    return names, f"of {len(found)} states, all positive"


def _two(subject: Subject, excitation: Excitation, first: Instance) -> Result:
    """Run a second instance beside the first, and the first again after a reset."""
    short, stop = excitation.first(SHORT), float(excitation.times[-1])
    if subject.declares(MODEL_EXCHANGE, "canBeInstantiatedOnlyOncePerProcess"):
        raise Unchecked("the FMU declares that it can be instantiated only once (per process)")
    second = subject.instance(MODEL_EXCHANGE, "second")
    try:
        expected = run_exchange(subject, short, second, stop=stop).after
        first.reset()
        found = run_exchange(subject, short, first, stop=stop).after
    finally:
        second.close()
    problems = differing(found, expected, subject.watched)
    return problems, "a second one, and the first after a reset, run to the same bits"


def _probe(subject: Subject, excitation: Excitation, own: OwnValues | None, report: Report) -> None:
    instance = subject.instance(MODEL_EXCHANGE)
    try:
        probes = Probes(subject, excitation, instance, own)
        try:
            run_exchange(subject, excitation, instance, visit=probes.visit)
        except (FmuError, Unchecked) as error:
            report.skip("probes", f"the run that they are made in breaks off: {error}")
        probes.report(report)
    finally:
        instance.close()
