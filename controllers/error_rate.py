"""What the fuzzy rules' second input, EC, is: the papers leave it open."""

from typing import Any, Literal

from ..cosim.block import Block, require

Rate = Literal["derivative", "difference"]


def require_rate(block: Block, rate: str) -> None:
    """Raise ParameterError unless `rate` is one of the two readings."""
    good = rate in ("derivative", "difference")
    require(block, good, f"rate is 'derivative' or 'difference', not {rate!r}")


def error_rate(change: Any, rate: Rate, period: float) -> Any:
    """Return EC for a change e(k) − e(k−1): "derivative" de/dt, or the "difference" itself."""
    return change / period if rate == "derivative" else change
