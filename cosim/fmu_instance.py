"""One instance of an FMI 2.0 co-simulation FMU through FMPy, from loading to freeing."""

import contextlib
import os
from collections import deque
from collections.abc import Sequence
from ctypes import byref, c_double, c_int, c_uint, c_void_p
from functools import lru_cache
from itertools import count
from pathlib import Path
from typing import Any, NoReturn

from ..base.errors import FmuError
from .fmu_file import LOADING, binary_of, extracted, read_description, require_co_simulation

STATUS = ("fmi2OK", "fmi2Warning", "fmi2Discard", "fmi2Error", "fmi2Fatal", "fmi2Pending")
LOG_LINES = 20
# FMI type -> (FMI function suffix, ctypes type); an enumeration travels as an integer.
TYPES = {
    "Real": ("Real", c_double),
    "Integer": ("Integer", c_int),
    "Enumeration": ("Integer", c_int),
    "Boolean": ("Boolean", c_int),
}


# One logger for all instances: FMPy's proxy, which formats the messages, remembers only one.
_logs: dict[int, deque[str]] = {}
_numbers = count(1)


def _log(environment: int, name: bytes, status: int, category: bytes, message: bytes) -> None:
    lines = _logs.get(environment or 0)
    if lines is not None:
        word = STATUS[status] if 0 <= status < len(STATUS) else str(status)
        lines.append(f"[{word}] {(message or b'').decode(errors='replace')}")


@lru_cache(maxsize=1)
def _callbacks_parts() -> tuple[Any, Any, Any]:
    from fmpy import calloc, fmi2, free

    return (
        fmi2.fmi2CallbackLoggerTYPE(_log),
        fmi2.fmi2CallbackAllocateMemoryTYPE(calloc),
        fmi2.fmi2CallbackFreeMemoryTYPE(free),
    )


def _callbacks(number: int) -> Any:
    from fmpy import fmi2

    logger, allocate, free = _callbacks_parts()
    callbacks = fmi2.fmi2CallbackFunctions(logger, allocate, free)
    callbacks.componentEnvironment = number
    # FMPy's helper that formats messages is a binary of its own, not there on every processor;
    # without it messages arrive as the FMU wrote them.
    proxy = getattr(fmi2, "addLoggerProxy", None)
    if proxy is not None:
        proxy(byref(callbacks))
    return callbacks


class FmuInstance:
    """One instance of an FMU, from instantiation to free; all failures are FmuError.

    `inputs` and `outputs` name the ports, each with an array slot: `slots(names)`.
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
        self._number = next(_numbers)
        self._log = _logs[self._number] = deque(maxlen=LOG_LINES)
        self.time = 0.0
        self._fatal = False
        self._running = False  # between initialization and an error: fmi2Terminate is allowed
        self._in = _Group.of([self._by_name[n] for n in inputs])
        self._out = _Group.of([self._by_name[n] for n in outputs])
        self.input_slots = _slots(inputs, self._in)
        self.output_slots = _slots(outputs, self._out)
        with LOADING:
            self._load(self.description.guid if guid is None else guid)
        callbacks = _callbacks(self._number)
        try:
            self.fmu.instantiate(callbacks=callbacks)
        except Exception as error:
            self.fmu.freeLibrary()
            failure = self._error("fmi2Instantiate returned no instance")
            del _logs[self._number]
            raise failure from error
        self.component = c_void_p(self.fmu.component)  # pyright: ignore[reportArgumentType]
        self._prepare()

    def _load(self, guid: str) -> None:
        from fmpy.fmi2 import FMU2Slave

        identifier = require_co_simulation(self.path, self.description)
        library = binary_of(self.path, self.description)
        try:
            here = Path.cwd()
        except OSError:
            raise FmuError("the working directory is gone; change to one that exists") from None
        try:
            self.fmu = FMU2Slave(
                guid=guid,
                modelIdentifier=identifier,
                unzipDirectory=str(extracted(self.path)),
                libraryPath=str(library),
                instanceName=self.name,
            )
        except Exception as error:
            del _logs[self._number]
            words = str(error).replace("\n", " ")
            raise FmuError(f"block '{self.name}': {self.path} cannot be loaded: {words}") from error
        finally:
            os.chdir(here)  # FMPy changes it and, on failure, does not change it back
        self._dll = self.fmu.dll

    def _prepare(self) -> None:
        """Look every function up once: the steps then cost no more than their calls."""
        functions = self._dll
        puts, gets = (
            [
                (getattr(functions, name), g.references, g.size, g.values, name)
                for g in groups
                for name in [f"fmi2{verb}{g.suffix}"]
            ]
            for verb, groups in (("Set", self._in), ("Get", self._out))
        )
        component, do_step, fail = self.component, functions.fmi2DoStep, self._fail

        def put() -> None:
            for function, references, size, values, name in puts:
                status = function(component, references, size, values)
                if status > 1:
                    fail(name, status)

        def fetch() -> None:
            for function, references, size, values, name in gets:
                status = function(component, references, size, values)
                if status > 1:
                    fail(name, status)

        def advance(t: float, h: float) -> None:
            for function, references, size, values, name in puts:
                status = function(component, references, size, values)
                if status > 1:
                    fail(name, status, t)
            status = do_step(component, t, h, 1)
            if status > 1:
                fail("fmi2DoStep", status, t)
            for function, references, size, values, name in gets:
                status = function(component, references, size, values)
                if status > 1:
                    fail(name, status, t + h)

        self.put, self.fetch, self.advance = put, fetch, advance

    # Life

    def set(self, name: str, value: Any) -> None:
        """Set one variable, before or in initialization mode, or an input."""
        variable = self._by_name[name]
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

    def inputs(self, values: Sequence[float]) -> None:
        """Write input values, in the ports' order, where put() and advance() take them."""
        for (array, i, convert), value in zip(self.input_slots, values, strict=True):
            array[i] = convert(value) if convert else value

    def outputs(self) -> tuple[float, ...]:
        """Return the outputs last fetched, in the ports' order."""
        return tuple(float(array[i]) for array, i, _ in self.output_slots)

    def close(self) -> None:
        """Terminate and free the instance; errors in this are of no more use to anyone."""
        if self._running:
            with contextlib.suppress(Exception):
                self.fmu.terminate()
        if not self._fatal:
            with contextlib.suppress(Exception):
                self.fmu.freeInstance()
        _logs.pop(self._number, None)

    # Failing

    def _call(self, function: str, *args: Any, **kwargs: Any) -> None:
        from fmpy.fmi1 import FMICallException

        try:
            getattr(self.fmu, function)(*args, **kwargs)
        except FMICallException as error:
            self._fail(error.function, error.status)

    def _fail(self, function: str, status: int, time: float | None = None) -> NoReturn:
        self._running = False
        self._fatal = status == STATUS.index("fmi2Fatal")
        word = STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"
        at = self.time if time is None else time
        raise self._error(f"{function} at t = {at:.9g} s returned {word}")

    def _error(self, what: str) -> FmuError:
        log = "; ".join(self._log)
        return FmuError(f"block '{self.name}': {what}: {log or 'the FMU logged nothing'}")


class _Group:
    """Variables of one FMI type, read or written in one call."""

    def __init__(self, kind: str, variables: list[Any]) -> None:
        self.suffix, c_type = TYPES[kind]
        self.names = [v.name for v in variables]
        self.size = len(variables)
        self.references = (c_uint * self.size)(*(v.valueReference for v in variables))
        self.values = (c_type * self.size)()

    @classmethod
    def of(cls, variables: list[Any]) -> "list[_Group]":
        kinds = dict.fromkeys(v.type for v in variables)
        return [cls(kind, [v for v in variables if v.type == kind]) for kind in kinds]


def _slots(names: Sequence[str], groups: list[_Group]) -> list[tuple[Any, int, Any]]:
    """Return (array, index, conversion) of each name; reals need no conversion."""
    convert = {"Real": None, "Integer": round, "Boolean": bool}
    found = {
        name: (group.values, i, convert[group.suffix])
        for group in groups
        for i, name in enumerate(group.names)
    }
    return [found[name] for name in names]
