"""Lines and trains as data: their types, readers of public formats, and Beijing Line 5.

The readers, and with them pydantic and a YAML parser, are loaded when they are first used.
"""

from typing import TYPE_CHECKING

from ...base.lazy import lazy
from .line import Line, Section, Stop
from .train import Davis, Train

if TYPE_CHECKING:
    from .beijing import SEVEN_RUNS, beijing_line_5, metro_b
    from .files import read_line, read_train
    from .ttobench import write_ttobench

__all__ = [
    "SEVEN_RUNS",
    "Davis",
    "Line",
    "Section",
    "Stop",
    "Train",
    "beijing_line_5",
    "metro_b",
    "read_line",
    "read_train",
    "write_ttobench",
]

__getattr__, __dir__ = lazy(
    __name__,
    {
        **dict.fromkeys(("SEVEN_RUNS", "beijing_line_5", "metro_b"), "beijing"),
        **dict.fromkeys(("read_line", "read_train"), "files"),
        "write_ttobench": "ttobench",
    },
)
