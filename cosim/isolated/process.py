"""An FMU's process, seen from the process that started it."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from time import monotonic

from ...base.errors import FmuError
from .messages import REPLY
from .page import Page
from .waiting import waiting

_SLICE = 1.0  # s; after so long without an answer it is checked that the process still lives
_GRACE = 5.0  # s, for a process to be gone after its last word
_BUFFER = 1 << 16

# Windows gives the reason as the exit code.
_EXCEPTIONS = {
    0xC0000005: "an access violation",
    0xC000001D: "an illegal instruction",
    0xC0000094: "a division by zero",
    0xC00000FD: "a stack overflow",
    0xC0000374: "a corrupted heap",
    0xC0000409: "an abort",
}


class LostError(Exception):
    """The process does not answer any more; the text is how that came."""


class Process:
    """A Python process that answers requests, one at a time.

    It is in a process group of its own, so that Ctrl-C in a terminal reaches the one that started
    it only, and it ends when that one does, however that ends.
    """

    def __init__(self) -> None:
        self.page, where, inherited = Page.create()
        try:
            self._popen = _start(where, inherited)
        except OSError as error:
            self.page.close()
            raise FmuError(f"cannot start {sys.executable}: {error.strerror or error}") from error
        finally:
            for file in inherited:
                os.close(file)
        self._owner = os.getpid()
        assert self._popen.stdin is not None and self._popen.stdout is not None
        self._to, answers = self._popen.stdin.fileno(), self._popen.stdout.fileno()
        self._poll, self._read = waiting(answers)
        self._reply = bytearray(_BUFFER)
        self._buffers = [self._reply]
        self.reply = memoryview(self._reply)
        self.busy = False  # a request is under way: what comes next is its answer

    @property
    def pid(self) -> int:
        """The process id."""
        return self._popen.pid

    def exchange(self, request: bytes | memoryview, timeout: float | None) -> int:
        """Send a request and wait for its reply, which is in `reply`; return its status.

        Raise LostError after `timeout` (s; None waits for ever), or when the process has ended.
        """
        self.busy = True
        try:
            sent = os.write(self._to, request)
            while sent < len(request):
                sent += os.write(self._to, request[sent:])
        except OSError:
            raise LostError(self._ended()) from None
        if not self._poll(1e3 * (_SLICE if timeout is None or timeout > _SLICE else timeout)):
            self._wait(timeout)
        got = self._read(self._buffers)
        if got < REPLY.size:
            raise LostError(self._ended())
        length, status = REPLY.unpack_from(self._reply)
        if got < length:
            self._rest(got, length, timeout)
        self.busy = False
        return status

    def _wait(self, timeout: float | None) -> None:
        """Wait on after the first slice."""
        began = monotonic() - min(_SLICE, timeout or _SLICE)
        while True:
            # If it left a process of its own behind, its pipe is still open.
            if self._popen.poll() is not None and not self._poll(0.0):
                raise LostError(self._ended())
            left = _SLICE if timeout is None else began + timeout - monotonic()
            if left <= 0.0:
                self._stop()
                raise LostError(f"did not return within {timeout:g} s (timeout)")
            if self._poll(1e3 * min(left, _SLICE)):
                return

    def _rest(self, got: int, length: int, timeout: float | None) -> None:
        """Read what is left of a long reply."""
        if length > len(self._reply):
            longer = bytearray(length)
            longer[:got] = self._reply[:got]
            self._reply, self.reply, self._buffers = longer, memoryview(longer), [longer]
        while got < length:
            if not self._poll(1e3 * _SLICE):
                self._wait(timeout)
            more = self._read([self.reply[got:length]])
            if not more:
                raise LostError(self._ended())
            got += more

    def _ended(self) -> str:
        """Say how the process ended; one that only closed its pipe is ended."""
        try:
            code = self._popen.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self._stop()
            return "did not return: its process broke off the connection"
        self._stop()
        return f"did not return: its process {end_of(code)}"

    def _stop(self) -> None:
        """End the process, and those that it started, at once."""
        if self._popen.poll() is None:
            self._popen.kill()
        if os.name != "nt":
            with suppress(OSError):
                os.killpg(self._popen.pid, signal.SIGKILL)
        self._popen.wait()

    def finish(self) -> None:
        """Let a process end that has said its last word."""
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(_GRACE)
        self.kill()

    def kill(self) -> None:
        """Leave nothing of the process."""
        if os.getpid() != self._owner:
            return  # a fork of the process that it belongs to
        if self._popen.poll() is None:
            self._stop()
        self._to = -1  # a closed file's number may become another file's
        for pipe in (self._popen.stdin, self._popen.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()
        self.page.close()


def _start(where: str, inherited: tuple[int, ...]) -> "subprocess.Popen[bytes]":
    windows = sys.platform == "win32"
    flags = subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW if windows else 0
    # -P: no module of the working directory in place of the standard library's. What this process
    # finds the other one finds, installed or not.
    path = os.pathsep.join(p for p in sys.path if p)
    return subprocess.Popen(
        [sys.executable, "-P", "-m", f"{__package__}.host", where, str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        bufsize=0,
        env={**os.environ, "PYTHONPATH": path},
        creationflags=flags,
        process_group=None if windows else 0,
        pass_fds=inherited,
    )


def end_of(code: int) -> str:
    """Say how a process ended, by its exit code."""
    if code < 0:
        try:
            return f"was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"was ended by signal {-code}"
    if code in _EXCEPTIONS:
        return f"was ended by {_EXCEPTIONS[code]} (0x{code:08X})"
    return f"ended with exit code {code}"
