"""Calls of a schedule for those who look on: observers, and the clock on the wall."""

from typing import Any

import numpy as np

from .engine.places import ObserverError
from .plan import Plan
from .results.observer import Observer
from .results.pacing import Pacer
from .schedule.operations import Call


class StopRunError(Exception):
    """An observer asks for the run's end."""


def wait_call(pacer: Pacer) -> Call:
    """Return the call that waits until a tick is due."""
    return Call(function=pacer.wait, arguments=("k",), results=None)


def observer_call(observer: Observer, plan: Plan) -> Call:
    """Return the call of an observer, which may raise StopRunError or ObserverError."""

    def observe(t: float, *values: Any) -> None:
        try:
            ends = observer.function(t, *values)
        except Exception as error:
            raise ObserverError(observer.label) from error
        if isinstance(ends, bool | np.bool_) and ends:
            raise StopRunError

    places = observer.places(plan.signals, plan.name)
    arguments = ("t", *(f"y{j}" for j in places))
    return Call(function=observe, arguments=arguments, results=None, every=observer.every)
