"""The FMU instance inside its own process: as any other, but it says what it is doing."""

from collections import deque
from collections.abc import Callable
from typing import Any

from ..fmu import log as fmu_log
from ..fmu.calls import Call
from ..fmu.instance import FmuInstance
from .page import Page, marking


class HostedInstance(FmuInstance):
    """An FmuInstance whose running function and log lines stand in a page."""

    def __init__(self, page: Page, name: str, *args: Any) -> None:
        self._page = page
        super().__init__(name, *args)

    def _load(self, guid: str) -> None:
        self._page.mark("loading its library")
        super()._load(guid)
        call: Any = self.fmu._call

        def marked(name: str, *args: Any) -> Any:
            self._page.mark(name)
            return call(name, *args)

        self.fmu._call = marked  # all of FMPy's methods go through it

    def _instantiate(self) -> None:
        self._log = fmu_log._logs[self._number] = _Lines(self._page)
        super()._instantiate()

    def _prepare(self) -> None:
        super()._prepare()
        self.puts = [self._marked(call) for call in self.puts]
        self.gets = [self._marked(call) for call in self.gets]
        self.slope_puts = [self._marked(call) for call in self.slope_puts]
        self.step = self._marked(self.step)

    def _marked(self, call: Call) -> Call:
        function, arguments, name = call
        return _marking(function, self._page, name), arguments, name

    def _state_call(self, name: str, argument: Any) -> None:
        self._page.mark(name)
        super()._state_call(name, argument)


def _marking(function: Any, page: Page, name: str) -> Callable[..., int]:
    memory, mark = page.memory, marking(name)
    place = slice(0, len(mark))

    def call(*arguments: Any) -> int:
        memory[place] = mark
        return function(*arguments)

    return call


class _Lines(deque[str]):
    """The last log lines, here and in the page."""

    def __init__(self, page: Page) -> None:
        super().__init__(maxlen=fmu_log.LOG_LINES)
        self._page = page

    def append(self, line: str) -> None:
        super().append(line)
        self._page.log(line)
