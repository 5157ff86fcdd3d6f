"""Work for campaigns that goes wrong, and some that does not.

Workers import it from here; pytest gives test modules names of its own.
"""

import os
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from railcosim import Constant, Diagram, Gain, Run
from railcosim.cosim.campaign import Campaign

POINTS = {"x": list(range(30))}


def with_trouble(
    trouble: Callable[[], object], at: tuple[int, ...], drawn: Mapping, generator: Any
) -> dict[str, float]:
    if drawn["x"] in at:
        trouble()
    return {"noise": generator.normal()}


def troubled(trouble: Callable[[], object], at: tuple[int, ...], **options: Any) -> Campaign:
    return Campaign(name="c", work=partial(with_trouble, trouble, at), draws=POINTS, **options)


def die() -> None:
    os._exit(1)


def die_once(mark: Path) -> None:
    """As if killed from outside: the run itself is innocent."""
    if not mark.exists():
        mark.touch()
        os._exit(1)


def leave() -> None:
    raise SystemExit(3)


def hang() -> None:
    while True:
        pass


def hang_in_c() -> None:
    time.sleep(1000.0)


def line() -> Diagram:
    made = Diagram("line", step=0.1)
    made.add("source", Constant(2.0))
    made.add("gain", Gain(1.0))
    made.connect("source.y", "gain.u")
    return made


def last(run: Run) -> dict[str, float]:
    return {"end": run["gain.y"][-1]}


def slow_or_deadly(drawn: Any, generator: np.random.Generator) -> dict[str, float]:
    if drawn["x"] == 13:
        die()
    time.sleep(0.002)
    return {"noise": generator.normal()}
