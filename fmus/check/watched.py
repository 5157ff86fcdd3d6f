"""An instance for a check whose calls another process watches."""

from collections import deque
from collections.abc import Callable
from ctypes import c_int
from functools import partial
from pathlib import Path
from typing import Any

from ...cosim.fmu import log as fmu_log
from ...cosim.fmu.calls import Call
from .heartbeat import Heartbeat, Place
from .instance import CO_SIMULATION, Instance


class WatchedInstance(Instance):
    """An Instance that says which of the FMU's functions is running, and what the FMU logged."""

    def __init__(
        self, heartbeat: Heartbeat, path: Path, interface: str, *args: Any, **kwargs: Any
    ) -> None:
        self._place = heartbeat.place(interface)
        super().__init__(path, interface, *args, **kwargs)

    def _open(self, kind: Callable[..., Any], **arguments: Any) -> Any:
        place = self._place
        fmu = place.marked(
            "the loading of its library", partial(super()._open, kind, **arguments)
        )()
        fmu._call = _calling(fmu._functions, place)  # all of FMPy's methods use it
        fmu.freeLibrary = place.marked("the unloading of its library", fmu.freeLibrary)
        return fmu

    def _instantiate(self) -> None:
        self._log = fmu_log._logs[self._number] = _Lines(self._place)
        super()._instantiate()

    def _prepare(self) -> None:
        super()._prepare()
        self.puts = [self._marked(call) for call in self.puts]
        self.gets = [self._marked(call) for call in self.gets]
        if self.interface == CO_SIMULATION:
            self.slope_puts = [self._marked(call) for call in self.slope_puts]
            self.step = self._marked(self.step)

    def _marked(self, call: Call) -> Call:
        function, arguments, name = call
        return self._place.marked(name, function, *arguments), (), name

    def _state_call(self, name: str, argument: Any) -> None:
        self._place.marked(name, super()._state_call, name, argument)()

    def _about_discard(self) -> str:
        return self._place.marked("fmi2GetRealStatus", super()._about_discard)()


def _calling(functions: dict[str, Any], place: Place) -> Callable[..., Any]:
    """Return FMPy's way to call a function by name, with marks, in the time that FMPy's takes."""
    from fmpy.fmi1 import FMICallException, fmi1Warning

    numbers, at = place.numbers, place.place
    known = {
        name: (function, place.calls(name), function.restype is c_int)
        for name, function in functions.items()
    }

    def call(name: str, *arguments: Any) -> Any:
        function, calls, has_status = known[name]
        numbers[at] = next(calls)
        try:
            found = function(*arguments)
        finally:
            numbers[at] = 0
        if has_status and found > fmi1Warning:
            raise FMICallException(function=name, status=found)
        return found

    return call


class _Lines(deque[str]):
    """The last log lines; the very last one also for the process that watches."""

    def __init__(self, place: Place) -> None:
        super().__init__(maxlen=fmu_log.LOG_LINES)
        self._place = place

    def append(self, line: str) -> None:
        super().append(line)
        self._place.log(line)
