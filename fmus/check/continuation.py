"""Going on from a saved state, the same way in this process and in another one."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...base.errors import FmuError
from .instance import CO_SIMULATION, Instance

TINY = 0.01  # a model-exchange step, in communication steps: too small for any stiffness to matter


@dataclass(frozen=True)
class Continuation:
    """What to do with an instance from a time (s) on.

    For co-simulation `times` are the communication points, and `inputs` has a row for each step;
    a row that is None is in the FMU's state already. For model exchange `times` are those of
    explicit Euler steps, and the inputs stay.
    """

    times: tuple[float, ...]
    inputs: tuple[tuple[float, ...] | None, ...] = ()
    state: bytes = b""

    def run(self, instance: Instance) -> np.ndarray:
        """Go on, and return a row of what is watched for each step."""
        if instance.interface == CO_SIMULATION:
            return self._steps(instance)
        return self._euler(instance)

    def _steps(self, instance: Instance) -> np.ndarray:
        rows = []
        for k, held in enumerate(self.inputs):
            if held is not None:
                instance.inputs(held)
                instance.put()
            now, then = self.times[k], self.times[k + 1]
            instance.time = now
            instance.call("doStep", now, then - now)
            instance.fetch()
            rows.append(instance.outputs())
        return np.array(rows)

    def _euler(self, instance: Instance) -> np.ndarray:
        rows, z = [], instance.get_indicators()
        for now, then in zip(self.times, self.times[1:], strict=False):
            x = instance.get_states() + (then - now) * instance.get_derivatives()
            instance.call("setTime", then)
            instance.set_states(x)
            asked, _ = instance.call("completedIntegratorStep")
            crossed = (instance.get_indicators() > 0.0) != (z > 0.0)
            if asked or crossed.any():
                instance.handle_events()
            z = instance.get_indicators()
            instance.fetch()
            parts = (instance.get_states(), instance.get_derivatives(), z, instance.outputs())
            rows.append(np.concatenate(parts))
        return np.array(rows)


@contextmanager
def saved(instance: Instance) -> Iterator[object]:
    """Hold the instance's state for the body, and free it after."""
    state = instance.save()
    try:
        yield state
    finally:
        instance.release(state)


def run_from_bytes(instance: Instance, continuation: Continuation) -> np.ndarray | str:
    """Take the serialized state and go on; return the rows, or what failed."""
    try:
        state = instance.from_bytes(continuation.state)
        try:
            instance.restore(state)
            return continuation.run(instance)
        finally:
            instance.release(state)
    except FmuError as error:
        return str(error)
