"""One instance of an FMI 2.0 co-simulation FMU through FMPy, from loading to freeing."""

import os
from collections.abc import Sequence
from contextlib import suppress
from ctypes import byref, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...base.errors import FmuError
from .calls import TYPES, Call, Functions, Group, PortArrays, slots
from .file import (
    LOADING,
    binary_of,
    extracted,
    is_ours,
    read_description,
    require_co_simulation,
)
from .library import slave_class
from .log import callbacks, close_log, open_log, status_word
from .retry import repeat

DISCARD, FATAL = 2, 4


class FmuInstance(PortArrays):
    """One instance of an FMU, from instantiation to free; all failures are FmuError.

    `inputs` and `outputs` name the ports, each with an array slot: `slots(names)`.

    A step that the FMU discards is repeated in smaller ones where the FMU can restore its state
    (see `retry`). FMUs made by railcosim discard none, so their state is not saved for it.
    """

    def __init__(
        self,
        name: str,
        path: Path,
        inputs: Sequence[str],
        outputs: Sequence[str],
        *,
        guid: str | None = None,
    ) -> None:
        self.name = name
        self.path = path
        self.description = read_description(path)
        self._by_name = {v.name: v for v in self.description.modelVariables}
        self._number, self._log = open_log()
        self.given: set[str] = set()  # the variables that `set` has set
        self.time = 0.0
        self._fatal = False
        self._running = False  # between initialization and an error: fmi2Terminate is allowed
        self._kept: c_void_p | None = None
        self.sloped = False  # whether the latest step had slopes
        self._in = Group.of([self._by_name[n] for n in inputs])
        self._out = Group.of([self._by_name[n] for n in outputs])
        self.input_slots = slots(inputs, self._in)
        self.output_slots = slots(outputs, self._out)
        try:
            with LOADING:
                self._load(self.description.guid if guid is None else guid)
            self._instantiate()
        except BaseException:
            close_log(self._number)
            raise
        self.component = c_void_p(self.fmu.component)
        self._capabilities()
        self._prepare()

    def _load(self, guid: str) -> None:
        slave = slave_class()
        identifier = require_co_simulation(self.path, self.description)
        library = binary_of(self.path, self.description)
        try:
            here = Path.cwd()
        except OSError:
            raise FmuError("the working directory is gone; change to one that exists") from None
        try:
            self.fmu: Any = slave(
                guid=guid,
                modelIdentifier=identifier,
                unzipDirectory=str(extracted(self.path)),
                libraryPath=str(library),
                instanceName=self.name,
            )
        except Exception as error:
            words = str(error).replace("\n", " ")
            raise FmuError(f"block '{self.name}': {self.path} cannot be loaded: {words}") from error
        finally:
            os.chdir(here)  # FMPy changes it and, on failure, does not change it back

    def _instantiate(self) -> None:
        try:
            self.fmu.instantiate(callbacks=callbacks(self._number))
        except Exception as error:
            self.fmu.freeLibrary()
            raise self._error("fmi2Instantiate returned no instance") from error

    def _capabilities(self) -> None:
        declared = self.description.coSimulation or self.description.modelExchange
        self.can_restore = bool(declared.canGetAndSetFMUstate)
        self.can_serialize = self.can_restore and bool(declared.canSerializeFMUstate)
        self.gives_directional = bool(declared.providesDirectionalDerivative)
        self.takes_slopes = bool(getattr(declared, "canInterpolateInputs", False))
        self.is_ours = is_ours(self.description)
        self.retries = self.can_restore and not self.is_ours

    @property
    def steps_inline(self) -> bool:
        """Whether a step is no more than the calls in `puts`, `step` and `gets`."""
        return not self.retries

    def _prepare(self) -> None:
        """Look every function up once: the steps then cost no more than their calls."""
        functions = Functions(self.fmu.dll, self.fmu.component, holds_gil=self.is_ours)
        self._functions = functions
        self.puts = [group.call(functions, "Set") for group in self._in]
        self.gets = [group.call(functions, "Get") for group in self._out]
        self.clock, self.span = c_double(), c_double()  # of steps made inline, by `step`
        # An FMU that can restore its state may be asked to: it must not forget what was before.
        step = (self.clock, self.span, 0 if self.can_restore else 1)
        self.step = functions.call("fmi2DoStep", *step)
        self._prepare_slopes(functions)

    def _prepare_slopes(self, functions: Functions) -> None:
        real = next((group for group in self._in if group.suffix == "Real"), None)
        # For each port its place among the slopes, None for one that is no real.
        self.slope_slots = [
            i if real is not None and array is real.values else None
            for array, i, _ in self.input_slots
        ]
        self.slope_values = (c_double * (real.size if real is not None else 0))()
        self.slope_puts = []
        if real is not None and self.takes_slopes:
            orders = (c_int * real.size)(*([1] * real.size))
            arguments = (byref(real.references), c_size_t(real.size), byref(orders))
            put = functions.call(
                "fmi2SetRealInputDerivatives", *arguments, byref(self.slope_values)
            )
            self.slope_puts = [put]

    def gets_of(self, places: Sequence[int]) -> list[Call]:
        """Return the calls that get the outputs at these places, one for each type of them.

        They may get outputs that lie between.
        """
        calls = []
        for group in self._out:
            slots = (self.output_slots[place] for place in places)
            found = [i for array, i, _ in slots if array is group.values]
            if found:
                span = (min(found), max(found) + 1)
                calls.append(group.call_between(self._functions, "Get", *span))
        return calls

    # Steps

    def _each(self, calls: list[Any], time: float | None = None) -> None:
        for function, arguments, name in calls:
            status = function(*arguments)
            if status > 1:
                self.fail(name, status, time)

    def put(self) -> None:
        """Set the inputs."""
        self._each(self.puts)

    def put_slopes(self) -> None:
        """Set the inputs' first derivatives."""
        self._each(self.slope_puts)

    def fetch(self) -> None:
        """Get the outputs."""
        self._each(self.gets)

    def advance(self, t: float, h: float) -> None:
        """Set the inputs, step from t to t + h (s) and get the outputs."""
        self._each(self.puts, t)
        self.sloped = False
        self._step(t, h)

    def advance_sloped(self, t: float, h: float) -> None:
        """Step as `advance`, with the inputs' first derivatives as `slopes` wrote them."""
        self._each(self.puts, t)
        self._each(self.slope_puts, t)
        self.sloped = True
        self._step(t, h)

    def _step(self, t: float, h: float) -> None:
        if self.retries:
            self._kept = self.save(self._kept)
        status = self.try_step(t, h)
        if status == DISCARD and self.retries:
            repeat(self, self._kept, t, h)
        elif status > 1:
            self.fail(self.step[2], status, t)
        self._each(self.gets, t + h)

    def try_step(self, t: float, h: float) -> int:
        """Call fmi2DoStep from t over h (s) and return its status, whatever it is."""
        inline = self.span.value  # what steps made inline count on
        self.clock.value, self.span.value = t, h
        function, arguments, _ = self.step
        status = function(*arguments)
        self.span.value = inline
        return status

    # Life

    def set(self, name: str, value: Any) -> None:
        """Set one variable, before or in initialization mode, or a tunable parameter or input."""
        variable = self._by_name[name]
        self.given.add(name)
        if variable.type == "String":
            self._call("setString", [variable.valueReference], [str(value)])
        else:
            suffix, _ = TYPES[variable.type]
            number = float(value) if suffix == "Real" else int(value)
            self._call(f"set{suffix}", [variable.valueReference], [number])

    def enter_initialization(self, start: float, stop: float | None) -> None:
        """Set up the experiment and enter initialization mode."""
        self.time = start
        self._call("setupExperiment", startTime=start, stopTime=stop)
        self._call("enterInitializationMode")

    def exit_initialization(self) -> None:
        """Leave initialization mode: the instance stands at the start time."""
        self._call("exitInitializationMode")
        self._running = True

    def reset(self) -> None:
        """Bring the instance back to where it was after instantiation."""
        self._running = False
        self._call("reset")

    def renew(self) -> None:
        """Bring the instance back to where a fresh one is, after `finish`."""
        self.reset()
        self.given.clear()
        self._log.clear()
        self.sloped = False

    def finish(self) -> str | None:
        """End the run without freeing the instance; return what went wrong in that, if anything."""
        if not self._running:
            return None
        self._running = False
        try:
            self._call("terminate")
        except FmuError as error:
            return str(error)
        return None

    def close(self) -> str | None:
        """Terminate and free the instance; return what went wrong in that, if anything."""
        if self._kept is not None and not self._fatal:
            with suppress(FmuError):
                self.release(self._kept)
        trouble = self.finish()
        if not self._fatal:
            with suppress(Exception):
                self.fmu.freeInstance()
        close_log(self._number)
        return trouble

    # State

    def save(self, into: Any = None) -> c_void_p:
        """Return a handle on a copy of the state; `into` is one to use again."""
        handle = c_void_p() if into is None else into
        self._state_call("fmi2GetFMUstate", byref(handle))
        return handle

    def restore(self, handle: Any) -> None:
        """Bring the FMU back to a saved state, also after an error."""
        self._state_call("fmi2SetFMUstate", handle)
        self._running = True

    def release(self, handle: Any) -> None:
        """Free a saved state."""
        self._state_call("fmi2FreeFMUstate", byref(handle))

    def _state_call(self, name: str, argument: Any) -> None:
        status = getattr(self.fmu.dll, name)(self.component, argument)
        if status > 1:
            self.fail(name, status)

    def to_bytes(self, handle: Any) -> bytes:
        """Return a saved state as bytes."""
        return self._call("serializeFMUstate", handle)

    def from_bytes(self, data: bytes) -> Any:
        """Return a handle on the state that these bytes are."""
        return self._call("deSerializeFMUstate", data)

    # Derivatives

    def directional(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float] | np.ndarray
    ) -> np.ndarray:
        """Return the directional derivatives of the unknowns along the seed."""
        rows, columns = ([self._by_name[n].valueReference for n in s] for s in (unknowns, knowns))
        return np.array(
            self._call("getDirectionalDerivative", rows, columns, [float(s) for s in seed])
        )

    # Failing

    def _call(self, function: str, *args: Any, **kwargs: Any) -> Any:
        from fmpy.fmi1 import FMICallException

        try:
            return getattr(self.fmu, function)(*args, **kwargs)
        except FMICallException as error:
            self.fail(error.function, error.status)

    def fail(
        self, function: str, status: int, time: float | None = None, remedy: str = ""
    ) -> NoReturn:
        """Raise FmuError for a status that an FMI function returned at a time (s)."""
        self._running = False
        self._fatal = status == FATAL
        at = self.time if time is None else time
        what = f"{function} at t = {at:.9g} s returned {status_word(status)}"
        if status == DISCARD and function == "fmi2DoStep" and not remedy:
            remedy = self._about_discard()
        raise self._error(f"{what}{remedy}")

    def _about_discard(self) -> str:
        reached = c_double()
        kind = 2  # fmi2LastSuccessfulTime
        known = self.fmu.dll.fmi2GetRealStatus(self.component, kind, byref(reached)) <= 1
        until = f" after {reached.value:.9g} s" if known else ""
        if self.can_restore:
            return until
        return f"{until}; it cannot restore its state, so no smaller step can be tried"

    def _error(self, what: str) -> FmuError:
        log = "; ".join(self._log)
        return FmuError(f"block '{self.name}': {what}: {log or 'the FMU logged nothing'}")
