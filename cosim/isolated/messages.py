"""Messages between an IsolatedInstance and its process.

A request has a fixed head and then numbers, laid out as the FMU's arrays, or JSON and bytes. It
gets one reply, so that at most one message is under way. Both ends are the same Python on the same
machine: numbers travel as they lie in memory, bit for bit.
"""

import json
import struct
from collections.abc import Sequence
from ctypes import c_double, c_int
from typing import Any

REQUEST = struct.Struct("=IIdd")  # length with this head, operation, time, step or handle
REPLY = struct.Struct("=II")  # length with this head, status
NUMBER = struct.Struct("=IId")  # the reply that is one number
_JSON = struct.Struct("=I")  # length of the JSON text; bytes follow it

START, CLOSE, CALL, PUT, PUT_SLOPES, FETCH, ADVANCE, ADVANCE_SLOPED, SAVE, RESTORE, RELEASE = range(
    11
)
DONE, FAILED = 0, 1

_TYPES = {"d": c_double, "i": c_int}

# What is the same at both ends, told once: (kind, size) of each array, (array, index) of each port.
Kinds = list[tuple[str, int]]
Places = list[tuple[int, int]]


def places_of(slots: Sequence[tuple[Any, int, Any]]) -> tuple[list[Any], Places]:
    """Return the arrays that slots lie in, and each slot's array and index."""
    arrays: dict[int, Any] = {}
    for array, _, _ in slots:
        arrays.setdefault(id(array), array)
    order = list(arrays)
    return list(arrays.values()), [(order.index(id(array)), i) for array, i, _ in slots]


def kinds_of(arrays: Sequence[Any]) -> Kinds:
    """Return the type code and size of each ctypes array."""
    return [(array._type_._type_, len(array)) for array in arrays]


def spans(kinds: Kinds, offset: int) -> tuple[list[slice], int]:
    """Return the bytes of each array, one after another from an offset, and where they end."""
    found = []
    for kind, size in kinds:
        end = offset + size * struct.calcsize(kind)
        found.append(slice(offset, end))
        offset = end + -end % 8
    return found, offset


def views(kinds: Kinds, buffer: bytearray, offset: int) -> list[Any]:
    """Return ctypes arrays that lie in a buffer."""
    return [
        (_TYPES[kind] * size).from_buffer(buffer, span.start) if size else (_TYPES[kind] * 0)()
        for (kind, size), span in zip(kinds, spans(kinds, offset)[0], strict=True)
    ]


def pack_json(value: Any, data: bytes = b"") -> bytes:
    """Return a JSON value and bytes as a message's body."""
    text = json.dumps(value, default=_plain).encode()
    return b"".join((_JSON.pack(len(text)), text, data))


def unpack_json(body: bytes | memoryview) -> tuple[Any, bytes]:
    """Return what `pack_json` packed."""
    (size,) = _JSON.unpack_from(body)
    end = _JSON.size + size
    return json.loads(bytes(body[_JSON.size : end])), bytes(body[end:])


def _plain(value: Any) -> Any:
    """Return numpy's numbers and arrays as Python's."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be sent to the FMU's process")
