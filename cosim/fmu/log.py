"""What FMUs log: the last lines of each instance, and the callbacks that bring them here."""

from collections import deque
from ctypes import byref
from functools import lru_cache
from itertools import count
from typing import Any

STATUS = ("fmi2OK", "fmi2Warning", "fmi2Discard", "fmi2Error", "fmi2Fatal", "fmi2Pending")
LOG_LINES, LOG_LENGTH = 20, 1000


def status_word(status: int) -> str:
    """Return a status as FMI spells it."""
    return STATUS[status] if 0 <= status < len(STATUS) else f"status {status}"


# One logger for all instances: FMPy's proxy, which formats the messages, remembers only one.
_logs: dict[int, deque[str]] = {}
_numbers = count(1)


def open_log() -> tuple[int, deque[str]]:
    """Return a number for a new instance, and the lines that it will have logged."""
    number = next(_numbers)
    _logs[number] = deque(maxlen=LOG_LINES)
    return number, _logs[number]


def close_log(number: int) -> None:
    """Forget an instance's lines."""
    _logs.pop(number, None)


def _log(environment: int, name: bytes, status: int, category: bytes, message: bytes) -> None:
    lines = _logs.get(environment or 0)
    if lines is not None:
        text = (message or b"")[: LOG_LENGTH + 1].decode(errors="replace")
        cut = f"{text[:LOG_LENGTH]}…" if len(text) > LOG_LENGTH else text
        lines.append(f"[{status_word(status)}] {cut}")


@lru_cache(maxsize=1)
def _parts() -> tuple[Any, Any, Any]:
    from fmpy import calloc, fmi2, free

    return (
        fmi2.fmi2CallbackLoggerTYPE(_log),
        fmi2.fmi2CallbackAllocateMemoryTYPE(calloc),
        fmi2.fmi2CallbackFreeMemoryTYPE(free),
    )


def callbacks(number: int) -> Any:
    """Return the callback functions for the instance with this number."""
    from fmpy import fmi2

    logger, allocate, free = _parts()
    made = fmi2.fmi2CallbackFunctions(logger, allocate, free)
    made.componentEnvironment = number
    # FMPy's helper that formats messages is a binary of its own, not there on every processor;
    # without it messages arrive as the FMU wrote them.
    proxy = getattr(fmi2, "addLoggerProxy", None)
    if proxy is not None:
        proxy(byref(made))
    return made
