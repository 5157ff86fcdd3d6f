"""Runs by model exchange: FMPy's, with CVode."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import isclose
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import LOADING, extracted
from .excitation import Excitation
from .gap import Gap
from .instance import Instance
from .report import Result, Unchecked
from .subject import Subject

TOLERANCE = 1e-10  # CVode's, relative; it is not a bound on the run's error, which is larger
TIMEOUT = 60.0  # s


@dataclass(frozen=True)
class Exchanged:
    """Rows of what is watched at the communication points: before and after what happens there."""

    before: np.ndarray
    after: np.ndarray


def run_exchange(
    subject: Subject,
    excitation: Excitation,
    instance: Instance,
    *,
    stop: float | None = None,
    visit: Callable[[float], None] | None = None,
) -> Exchanged:
    """Run a fresh instance to the excitation's end, and return what is watched.

    `stop` (s) is the stop time told to the FMU and to CVode, by default the end. `visit` is
    called with the time after each step of CVode, in continuous-time mode. Raise FmuError for
    what the FMU returns, Unchecked if CVode does not come through.
    """
    from fmpy import simulate_fmu

    _guard(instance)
    times = excitation.times
    end = float(times[-1])
    final = end if stop is None else stop

    def went_on(time: float, recorder: Any) -> bool:
        instance.time = time
        _raise_first(instance)
        if visit is not None:
            holding.visited = True
            visit(time)
            holding.visited = False
        return stop is None or time < end or isclose(time, end)  # the last row comes after

    try:
        with LOADING:
            folder = str(extracted(subject.path))
        instance.time = float(times[0])
        with _held_inputs(instance.fmu) as holding:
            found = simulate_fmu(
                folder,
                validate=False,
                start_time=float(times[0]),
                stop_time=final,
                relative_tolerance=TOLERANCE,
                output_interval=excitation.step,
                fmi_type="ModelExchange",
                input=_signals(subject, excitation, final),  # pyright: ignore[reportArgumentType]
                output=subject.watched,
                timeout=TIMEOUT,
                step_finished=went_on,
                model_description=subject.description,
                fmu_instance=instance.fmu,
            )
    except (FmuError, Unchecked):
        raise
    except Exception as error:  # FMPy raises many kinds, plain Exception among them
        _raise_first(instance)
        words = " ".join(str(error).split())
        if "FMICallException" in type(error).__name__:
            raise FmuError(f"at t = {instance.time:.6g} s {words} {instance.words()}") from error
        raise Unchecked(
            f"CVode does not come through at t = {instance.time:.6g} s: {words}"
        ) from error
    _raise_first(instance)
    return _at_points(subject, times, found)


def _at_points(subject: Subject, times: np.ndarray, found: Any) -> Exchanged:
    """Pick the first and the last row at each communication point."""
    moments = np.asarray(found["time"])
    rows = np.column_stack(
        [np.asarray(found[name], dtype=float) for name in subject.watched] or [moments]
    )
    near = 1e-9 * max(1.0, float(np.max(np.abs(times))))
    first = np.searchsorted(moments, times - near)
    last = np.searchsorted(moments, times + near, side="right") - 1
    if moments[-1] < times[-1] - near:
        raise Unchecked(f"the run by model exchange ends at t = {moments[-1]:.6g} s")
    return Exchanged(rows[first], rows[np.maximum(first, last)])


def _signals(subject: Subject, excitation: Excitation, stop: float) -> np.ndarray | None:
    """Return the inputs as FMPy takes them: a time that stands twice is a jump."""
    names = list(subject.inputs)
    if not names:
        return None
    kinds = {"Real": np.float64, "Boolean": np.bool_}
    dtype = [("time", np.float64)]
    dtype += [(n, kinds.get(subject.variables[n].type, np.int32)) for n in names]
    # FMPy's own arithmetic: a jump must lie where FMPy stops, to the last bit.
    begin, step = float(excitation.times[0]), excitation.step
    rows = [(begin, *excitation.row(0, names))]
    for k in excitation.changes():
        if k == len(excitation.times) - 1:
            break  # what is set at the end moves nothing
        time = begin + k * step
        rows += [(time, *excitation.row(k - 1, names)), (time, *excitation.row(k, names))]
    rows.append((max(stop, float(excitation.times[-1])) + 1.0, *rows[-1][1:]))
    return np.array(rows, dtype=dtype)


def _guard(instance: Instance) -> None:
    """Keep the first failure of the calls that CVode makes: it would print and go on."""
    fmu = instance.fmu
    fmu.first_failure = None

    def guarded(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            try:
                return function(*arguments)
            except Exception as error:
                if fmu.first_failure is None:
                    fmu.first_failure = f"{error} {instance.words()}"
                return None

        return call

    for name in ("setTime", "setContinuousStates", "getDerivatives", "getEventIndicators"):
        setattr(fmu, name, guarded(getattr(type(fmu), name).__get__(fmu)))


@dataclass
class _Holding:
    """Whether the FMU is in continuous-time mode, and whether somebody visits it there."""

    continuous: bool = False
    visited: bool = False


@contextmanager
def _held_inputs(fmu: Any) -> Iterator[_Holding]:
    """Let inputs change in event mode only: they are held in between.

    FMPy sets them at each look at the event indicators as well, and where one jumps it sets the
    value from before the jump once more after it.
    """
    modes = {"enterContinuousTimeMode": True, "enterEventMode": False}
    setters = ("fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean")
    holding = _Holding()

    def entering(function: Callable[..., Any], is_continuous: bool) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            holding.continuous = is_continuous
            return function(*arguments)

        return call

    def in_event_mode(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            is_held = holding.continuous and not holding.visited
            return 0 if is_held else function(*arguments)

        return call

    for name, is_continuous in modes.items():
        setattr(fmu, name, entering(getattr(type(fmu), name).__get__(fmu), is_continuous))
    for name in setters:
        setattr(fmu, name, in_event_mode(getattr(type(fmu), name).__get__(fmu)))
    try:
        yield holding
    finally:
        for name in (*modes, *setters):
            delattr(fmu, name)


def _raise_first(instance: Instance) -> None:
    failure = getattr(instance.fmu, "first_failure", None)
    if failure is not None:
        raise FmuError(f"at t = {instance.time:.6g} s {failure}")


def against_co_simulation(
    subject: Subject, exchanged: Exchanged, base: np.ndarray, tolerance: float | None
) -> Result:
    """Compare with the run by co-simulation at the communication points."""
    gap = Gap()
    gap.add(subject, base, exchanged.before, exchanged.after)
    return gap.judge(f"CVode (rtol {TOLERANCE:g}) agrees", subject, tolerance)
