"""Block states as JSON and back, bit for bit: numbers, texts, tuples, lists and numpy arrays."""

import math
from typing import Any

_PLAIN = (bool, int, str, type(None))


def encoded(value: Any) -> Any:
    """Return a value as JSON values; raise TypeError for one that is none of those above."""
    import numpy as np

    if type(value) in _PLAIN:
        return value
    if type(value) is float:
        return value if math.isfinite(value) else {"float": value.hex()}
    if type(value) in (tuple, list):
        return {type(value).__name__: [encoded(v) for v in value]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return {"array": value.tobytes().hex(), "type": value.dtype.str, "shape": list(value.shape)}
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return {"number": value.tobytes().hex(), "type": value.dtype.str}
    raise TypeError(f"{value!r} is a {type(value).__name__}")


def decoded(value: Any) -> Any:
    """Return what `encoded` was given."""
    import numpy as np

    if not isinstance(value, dict):
        return value
    match value:
        case {"float": text}:
            return float.fromhex(text)
        case {"tuple": items}:
            return tuple(decoded(v) for v in items)
        case {"list": items}:
            return [decoded(v) for v in items]
        case {"array": data, "type": kind, "shape": shape}:
            return np.frombuffer(bytes.fromhex(data), dtype=kind).reshape(shape).copy()
        case {"number": data, "type": kind}:
            return np.frombuffer(bytes.fromhex(data), dtype=kind)[0]
    raise ValueError(f"{value!r} is no encoded value")
