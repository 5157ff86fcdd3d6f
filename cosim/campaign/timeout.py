"""A limit to the time of one run."""

import ctypes
import faulthandler
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_GRACE = 1.0  # s, for Python code to take notice before the process is ended


class TimedOutError(BaseException):
    """A run took too long. No Exception, so that work which catches those does not go on."""


def words_for(timeout: float) -> str:
    """Return the error of a run that took too long."""
    return f"the run did not end within {timeout:g} s (timeout)"


@contextmanager
def limited(timeout: float | None, *, fatal: bool) -> Iterator[None]:
    """Raise TimedOutError in the body when `timeout` (s) is over; None lets it take its time.

    That stops Python code. Code of an FMU that does not return can only be ended together with its
    process: with `fatal` that happens some seconds later.
    """
    if timeout is None:
        yield
        return
    thread, lock, active = threading.get_ident(), threading.Lock(), [True]

    def strike() -> None:
        with lock:
            if active[0]:
                _raise_in(thread)

    timer = threading.Timer(timeout, strike)
    timer.daemon = True
    sink = open(os.devnull, "w") if fatal else None  # noqa: SIM115, PTH123
    try:
        if sink is not None:  # a thread of C: it acts also if the FMU's caller holds the GIL
            faulthandler.dump_traceback_later(timeout + _GRACE, exit=True, file=sink)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            with lock:
                active[0] = False
            if sink is not None:
                faulthandler.cancel_dump_traceback_later()
    except TimedOutError:
        raise TimedOutError(words_for(timeout)) from None
    finally:
        if sink is not None:
            sink.close()


def _raise_in(thread: int) -> None:
    """Raise TimedOutError in another thread, at its next Python instruction."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(
        ctypes.c_ulong(thread), ctypes.py_object(TimedOutError)
    )
