"""An FMU instance in a process of its own, with the same face as FmuInstance."""

import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from ...base import errors
from ...base.errors import FmuError
from ..fmu.calls import CONVERSIONS, TYPES, PortArrays
from ..fmu.file import LOADING, binary_of, extracted, read_description
from . import messages as m
from .process import LostError, Process

if TYPE_CHECKING:
    import numpy as np

_START = 60.0  # s that Python has for starting: not the FMU's time
_INTERRUPTED = 1.0  # s that a call has for returning after Ctrl-C

_AFTER_STEP = ("fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean")


class IsolatedInstance(PortArrays):
    """One instance of an FMU whose library only another process loads.

    An FMU that crashes, exits or hangs ends that process and is an FmuError here, like everything
    that FmuInstance raises. `timeout` (s) is for each call of the FMU; None waits for ever. The
    default is far above any step that goes well, so that only what hangs runs into it.

    A step costs one message there and one back, with inputs and outputs.
    """

    steps_inline = False  # there are no functions of the FMU to call here

    def __init__(
        self,
        name: str,
        path: Path,
        inputs: Sequence[str],
        outputs: Sequence[str],
        *,
        timeout: float | None = 60.0,
    ) -> None:
        self.name = name
        self.path = path
        self.timeout = timeout
        self.description = read_description(path)
        self.given: set[str] = set()  # the variables that `set` has set
        self.time = 0.0
        self.sloped = False  # whether the latest step had slopes
        with LOADING:
            binary_of(path, self.description)
            folder = extracted(path)
        self._process = Process()
        self._end = weakref.finalize(self, self._process.kill)
        self._gone = False
        try:
            self._start(folder, list(inputs), list(outputs))
        except BaseException:
            self._end()
            raise

    def _start(self, folder: Path, inputs: list[str], outputs: list[str]) -> None:
        wanted = {
            "path": str(self.path),
            "folder": str(folder),
            "name": self.name,
            "inputs": inputs,
            "outputs": outputs,
        }
        start = None if self.timeout is None else max(_START, self.timeout)
        try:
            self._check(self._process.exchange(self._request(m.START, m.pack_json(wanted)), start))
        except LostError as lost:
            self._gone = True
            words = str(lost).removeprefix("did not return: ")
            raise FmuError(
                f"block '{self.name}': the process for {self.path.name} did not start: {words}"
            ) from None
        told: dict[str, Any] = self._ask(m.START)
        self.can_restore: bool = told["can_restore"]
        self.can_serialize: bool = told["can_serialize"]
        self.takes_slopes: bool = told["takes_slopes"]
        self.gives_directional: bool = told["gives_directional"]
        self.is_ours: bool = told["is_ours"]
        self.slope_slots: list[int | None] = told["slopes"]
        self._lay_out(told, inputs, outputs)

    def _lay_out(self, told: dict[str, Any], inputs: list[str], outputs: list[str]) -> None:
        """Lay the arrays out as they are in the process: inputs in the requests themselves."""
        taken, given = told["kinds"]
        self._size = m.spans(taken, m.REQUEST.size)[1]
        self._request_bytes = bytearray(self._size)
        self._message = memoryview(self._request_bytes)
        *arrays, self.slope_values = m.views(taken, self._request_bytes, m.REQUEST.size)
        self.input_slots = self._slots(inputs, arrays, told["inputs"])
        size = m.spans(given, m.REPLY.size)[1]
        values = bytearray(size)
        self._fetched, self._given = memoryview(values), slice(m.REPLY.size, size)
        self.output_slots = self._slots(
            outputs, m.views(given, values, m.REPLY.size), told["outputs"]
        )

    def _slots(
        self, names: list[str], arrays: list[Any], places: m.Places
    ) -> list[tuple[Any, int, Any]]:
        kinds = {v.name: v.type for v in self.description.modelVariables}
        return [
            (arrays[array], i, CONVERSIONS[TYPES[kinds[name]][0]])
            for name, (array, i) in zip(names, places, strict=True)
        ]

    # Steps

    def _numbers(self, what: int, time: float, number: float) -> None:
        """Send inputs and slopes."""
        m.REQUEST.pack_into(self._request_bytes, 0, self._size, what, time, number)
        try:
            status = self._process.exchange(self._message, self.timeout)
        except LostError as lost:
            self._lose(lost, time, number)
        if status:
            self._check(status)

    def advance(self, t: float, h: float) -> None:
        """Set the inputs, step from t to t + h (s) and get the outputs."""
        self.sloped = False
        self._numbers(m.ADVANCE, t, h)
        self._fetched[self._given] = self._process.reply[self._given]

    def advance_sloped(self, t: float, h: float) -> None:
        """Step as `advance`, with the inputs' first derivatives as `slopes` wrote them."""
        self.sloped = True
        self._numbers(m.ADVANCE_SLOPED, t, h)
        self._fetched[self._given] = self._process.reply[self._given]

    def put(self) -> None:
        """Set the inputs."""
        self._numbers(m.PUT, self.time, 0.0)

    def put_slopes(self) -> None:
        """Set the inputs' first derivatives."""
        self._numbers(m.PUT_SLOPES, self.time, 0.0)

    def fetch(self) -> None:
        """Get the outputs."""
        self._exchange(self._request(m.FETCH))
        self._fetched[self._given] = self._process.reply[self._given]

    # Life

    def set(self, name: str, value: Any) -> None:
        """Set one variable, before or in initialization mode, or a tunable parameter or input."""
        self.given.add(name)
        self._call("set", name, value)

    def enter_initialization(self, start: float, stop: float | None) -> None:
        """Set up the experiment and enter initialization mode."""
        self.time = start
        self._call("enter_initialization", start, stop)

    def exit_initialization(self) -> None:
        """Leave initialization mode: the instance stands at the start time."""
        self._call("exit_initialization")

    def reset(self) -> None:
        """Bring the instance back to where it was after instantiation."""
        self._call("reset")

    def renew(self) -> None:
        """Bring the instance back to where a fresh one is, after `finish`."""
        self._call("renew")
        self.given.clear()
        self.sloped = False

    def finish(self) -> str | None:
        """End the run without freeing the instance; return what went wrong in that, if anything."""
        try:
            return self._call("finish")[0]
        except FmuError as error:
            return str(error)

    def close(self) -> str | None:
        """Terminate and free the instance; return what went wrong in that, if anything."""
        trouble = None
        if not self._gone and self._is_idle():
            try:
                trouble = self._ask(m.CLOSE)
            except FmuError as error:
                trouble = str(error)
            else:
                self._process.finish()
        self._gone = True
        self._end()
        return trouble

    def _is_idle(self) -> bool:
        """Wait a little for a call that was interrupted, so that the FMU can still be freed."""
        if self._process.busy:
            try:
                self._process.exchange(b"", _INTERRUPTED)
            except LostError:
                return False
        return True

    # State

    def save(self, into: Any = None) -> int:
        """Return a handle on a copy of the state; `into` is one to use again."""
        self._exchange(self._request(m.SAVE, number=into or 0))
        return int(m.NUMBER.unpack_from(self._process.reply)[2])

    def restore(self, handle: Any) -> None:
        """Bring the FMU back to a saved state, also after an error."""
        self._exchange(self._request(m.RESTORE, number=handle))

    def release(self, handle: Any) -> None:
        """Free a saved state."""
        self._exchange(self._request(m.RELEASE, number=handle))

    def to_bytes(self, handle: Any) -> bytes:
        """Return a saved state as bytes."""
        return self._call("to_bytes", handle)[1]

    def from_bytes(self, data: bytes) -> Any:
        """Return a handle on the state that these bytes are."""
        return self._call("from_bytes", data=data)[0]

    # Derivatives

    def directional(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: "Sequence[float] | np.ndarray"
    ) -> "np.ndarray":
        """Return the directional derivatives of the unknowns along the seed."""
        import numpy as np

        seed = [float(value) for value in seed]
        return np.array(self._call("directional", list(unknowns), list(knowns), seed)[0])

    # Messages

    def _request(self, what: int, body: bytes = b"", number: float = 0.0) -> bytes:
        size = m.REQUEST.size + len(body)
        return m.REQUEST.pack(size, what, self.time, number) + body

    def _call(self, method: str, *arguments: Any, data: bytes = b"") -> tuple[Any, bytes]:
        self._exchange(self._request(m.CALL, m.pack_json([method, *arguments], data)))
        return self._answer()

    def _ask(self, what: int) -> Any:
        self._exchange(self._request(what))
        return self._answer()[0]

    def _exchange(self, request: bytes) -> None:
        try:
            status = self._process.exchange(request, self.timeout)
        except LostError as lost:
            self._lose(lost, self.time, 0.0)
        self._check(status)

    def _answer(self) -> tuple[Any, bytes]:
        reply = self._process.reply
        return m.unpack_json(reply[m.REPLY.size : m.REPLY.unpack_from(reply)[0]])

    # Failing

    def _check(self, status: int) -> None:
        if status == m.DONE:
            return
        kind, words = self._answer()[0]
        if not kind:
            raise FmuError(
                f"block '{self.name}': the process for {self.path.name} failed in Python: {words}"
            )
        error = getattr(errors, kind, FmuError)
        raise error(words)

    def _lose(self, lost: LostError, time: float, step: float) -> NoReturn:
        """Raise FmuError for a process that does not answer, and let go of it."""
        if self._gone:
            raise FmuError(f"block '{self.name}': its process has ended before") from None
        self._gone = True
        function, lines = self._process.page.running(), self._process.page.lines()
        self._end()
        log = "; ".join(lines) or "the FMU logged nothing"
        if function in _AFTER_STEP:
            time += step
        what = f"{function or 'the time after the last call'} at t = {time:.9g} s {lost}"
        raise FmuError(f"block '{self.name}': {what}: {log}") from None
