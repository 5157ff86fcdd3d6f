"""Requests to an FMU instance, answered one after the other in the instance's own process."""

import os
from ctypes import addressof, c_char, memmove, sizeof
from typing import Any

from . import messages as m
from .page import NOTHING, Page
from .waiting import waiting

_BUFFER = 1 << 16


class ClosedError(Exception):
    """The parent has closed the pipe."""


class Pipes:
    """Requests and replies; a request stays valid until the next."""

    def __init__(self, requests: int, replies: int) -> None:
        self.requests, self.replies = requests, replies
        self.request = bytearray(_BUFFER)
        self._into = [self.request]
        self._poll, self._read = waiting(requests)

    def reserve(self, size: int) -> None:
        """Make room for a request of a size that is to lie at a place that does not move."""
        if size > len(self.request):
            self.request = bytearray(size)
            self._into = [self.request]

    def receive(self) -> bytes | bytearray:
        """Return the next request; raise ClosedError if there will be none."""
        self._poll(None)
        got = self._read(self._into)
        if not got:
            raise ClosedError
        length = m.REQUEST.unpack_from(self.request)[0] if got >= m.REQUEST.size else 0
        if got == length:
            return self.request
        return self._rest(got)

    def _rest(self, got: int) -> bytes | bytearray:
        """Read what is left of a long request, in the reserved place where it fits there."""
        data = bytearray(self.request[:got])
        while len(data) < m.REQUEST.size or len(data) < m.REQUEST.unpack_from(data)[0]:
            self._poll(None)
            more = bytearray(_BUFFER)
            got = self._read([more])
            if not got:
                raise ClosedError
            data += more[:got]
        if len(data) > len(self.request):
            return data
        self.request[: len(data)] = data
        return self.request

    def send(self, reply: bytes | bytearray | memoryview) -> None:
        """Send a reply."""
        sent = os.write(self.replies, reply)
        while sent < len(reply):
            sent += os.write(self.replies, memoryview(reply)[sent:])

    def answer(self, status: int, value: Any, data: bytes = b"") -> None:
        """Send a status with a JSON value and bytes."""
        body = m.pack_json(value, data)
        self.send(m.REPLY.pack(m.REPLY.size + len(body), status) + body)

    def fail(self, error: Exception) -> None:
        """Send an error; what is none of ours is a fault of this process."""
        self.answer(m.FAILED, _told(error))


def _told(error: Exception) -> list[str]:
    from ...base.errors import RailcosimError

    if isinstance(error, RailcosimError):
        return [type(error).__name__, str(error)]
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    where = f" ({trace.tb_frame.f_code.co_filename}:{trace.tb_lineno})" if trace else ""
    return ["", f"{type(error).__name__}: {error}{where}"]


class Server:
    """One FMU instance and the requests to it."""

    def __init__(self, pipes: Pipes, page: Page, instance: Any) -> None:
        self.pipes, self.page, self.instance = pipes, page, instance
        self.handles: dict[int, Any] = {}
        self.numbers = 0
        inputs, self.input_places = m.places_of(instance.input_slots)
        outputs, self.output_places = m.places_of(instance.output_slots)
        inputs.append(instance.slope_values)
        self.kinds = m.kinds_of(inputs), m.kinds_of(outputs)
        spans, size = m.spans(self.kinds[0], m.REQUEST.size)
        pipes.reserve(size)
        start = addressof(c_char.from_buffer(pipes.request))
        self._take = [
            (addressof(array), start + span.start, sizeof(array))
            for array, span in zip(inputs, spans, strict=True)
        ]
        spans, size = m.spans(self.kinds[1], m.REPLY.size)
        self._values = bytearray(size)
        m.REPLY.pack_into(self._values, 0, size, m.DONE)
        start = addressof(c_char.from_buffer(self._values))
        self._give = [
            (start + span.start, addressof(array), sizeof(array))
            for array, span in zip(outputs, spans, strict=True)
        ]

    def introduce(self) -> None:
        """Tell the parent of the instance."""
        instance = self.instance
        self.pipes.answer(
            m.DONE,
            {
                "kinds": self.kinds,
                "inputs": self.input_places,
                "outputs": self.output_places,
                "slopes": instance.slope_slots,
                "can_restore": instance.can_restore,
                "can_serialize": instance.can_serialize,
                "takes_slopes": instance.takes_slopes,
                "gives_directional": instance.gives_directional,
                "is_ours": instance.is_ours,
            },
        )

    def serve(self) -> None:
        """Answer requests until there are none."""
        receive, send, memory = self.pipes.receive, self.pipes.send, self.page.memory
        mark, nothing = slice(0, len(NOTHING)), NOTHING
        unpack, advance = m.REQUEST.unpack_from, self.instance.advance
        while True:
            request = receive()
            size, what, time, number = unpack(request)
            try:
                if what == m.ADVANCE:
                    for target, source, size in self._take:
                        memmove(target, source, size)
                    advance(time, number)
                    for target, source, size in self._give:
                        memmove(target, source, size)
                    memory[mark] = nothing
                    send(self._values)
                elif what == m.CLOSE:
                    self.instance.time = time
                    trouble = self.instance.close()
                    memory[mark] = nothing
                    self.pipes.answer(m.DONE, trouble)
                    return
                else:
                    body = memoryview(request)[m.REQUEST.size : size]
                    self._other(body, what, time, number)
            except Exception as error:
                memory[mark] = nothing
                self.pipes.fail(error)

    def _other(self, body: memoryview, what: int, time: float, number: float) -> None:
        instance = self.instance
        if what == m.CALL:
            instance.time = time
            value, data = self._call(*m.unpack_json(body))
            self.page.mark("")
            self.pipes.answer(m.DONE, value, data)
            return
        if what in (m.PUT, m.PUT_SLOPES, m.ADVANCE_SLOPED):
            for target, source, size in self._take:
                memmove(target, source, size)
        if what == m.ADVANCE_SLOPED:
            instance.advance_sloped(time, number)
        else:
            instance.time = time
            if what in (m.SAVE, m.RESTORE, m.RELEASE):
                number = self._state(what, int(number))
            else:
                {m.PUT: instance.put, m.PUT_SLOPES: instance.put_slopes, m.FETCH: instance.fetch}[
                    what
                ]()
        self.page.mark("")
        if what in (m.FETCH, m.ADVANCE_SLOPED):
            for target, source, size in self._give:
                memmove(target, source, size)
            self.pipes.send(self._values)
        else:
            self.pipes.send(m.NUMBER.pack(m.NUMBER.size, m.DONE, number))

    def _state(self, what: int, number: int) -> int:
        if what == m.SAVE:
            saved = self.instance.save(self.handles.get(number))
            return number if number in self.handles else self._keep(saved)
        if what == m.RESTORE:
            self.instance.restore(self.handles[number])
        else:
            self.instance.release(self.handles.pop(number))
        return number

    def _keep(self, handle: Any) -> int:
        self.numbers += 1
        self.handles[self.numbers] = handle
        return self.numbers

    def _call(self, named: list[Any], data: bytes) -> tuple[Any, bytes]:
        method, *arguments = named
        if method == "to_bytes":
            return None, self.instance.to_bytes(self.handles[arguments[0]])
        if method == "from_bytes":
            return self._keep(self.instance.from_bytes(data)), b""
        return getattr(self.instance, method)(*arguments), b""
