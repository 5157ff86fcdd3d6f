"""The air brake of the heavy-haul train's Newmark reference: pipe and cylinders, in numpy."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...models.consist import Consist

Array = NDArray[Any]
FINENESS = 0.1  # longest step of the integration over the shortest time constant


class AirBrake:
    """Brake pipe and cylinders, one of each per vehicle.

    The pipe is a cascade of first-order lags, r_i' = (r_up − r_i)/T_i with T_i = length_i over the
    wave's speed: the application's where r_up > r_i, else the release's. `up` is the neighbour on
    the side of the group of locomotives whose wave would arrive first, at its first locomotive the
    group's command. Radio delays count here only for who is first: the reductions given are taken
    as they come.

    An end-of-train device has a second cascade s, from the last vehicle forwards, and the reduction
    is the larger of r and s. The device does not recharge: s falls along with r, and what the
    vehicle behind, b, hands on is what its s is over its r: s_i' = min(r_i', 0) + (t_i − s_i)/T_i,
    t_i = max(r_i, min(r_i, r_b) + max(s_b − r_b, 0)), and at the last one max(r_i, command).

    The cylinder follows c(r) · largest pressure, first order, application and release each with
    its time constant. All but c(r) (public page) is our choice.

    The classical Runge–Kutta method (order 4) in steps of at most a tenth of the shortest time
    constant: error in r some 1e-7 of the change.
    """

    def __init__(self, consist: Consist) -> None:
        self.size = consist.size
        length = np.array([each.length for each in consist.vehicles])
        self.times = (length / consist.release_speed, length / consist.application_speed)
        self.cylinder_times = (consist.release_time, consist.application_time)
        self.shortest = min(*(each.min() for each in self.times), *self.cylinder_times)
        self.up = _upstream(consist, length)
        services: dict[Any, list[int]] = {}
        for i, vehicle in enumerate(consist.vehicles):
            if vehicle.brake:
                services.setdefault(vehicle.brake.service, []).append(i)
        self.services = [(np.array(at), *np.array(s).T) for s, at in services.items()]
        self.largest = np.array([v.brake.cylinder_pressure if v.brake else 0.0
                                 for v in consist.vehicles])  # fmt: skip
        self.groups, self.device = len(consist.groups), consist.end_of_train is not None
        # Pressure in the cylinder (Pa), the pipe's reduction from the locomotives and, with a
        # device, from it (kPa).
        self.state = np.zeros((3 if self.device else 2, self.size))

    @property
    def pressure(self) -> Array:
        """The cylinders' pressures (Pa)."""
        return self.state[0]

    @property
    def reduction(self) -> Array:
        """The pipe's reduction at the vehicles (kPa)."""
        return self.state[1:].max(axis=0)

    def advance(self, step: float, before: Array, after: Array) -> None:
        """Go on by `step` (s) while the sources' reductions (kPa) go linearly from `before`.

        Sources are the groups of locomotives and, if there is one, the end-of-train device.
        """
        parts = math.ceil(step / (FINENESS * self.shortest) - 1e-9)
        h = step / parts
        state = self.state
        for part in range(parts):
            here, middle, there = (
                before + (after - before) * (part + share) / parts for share in (0.0, 0.5, 1.0)
            )
            k1 = self._rates(state, here)
            k2 = self._rates(state + 0.5 * h * k1, middle)
            k3 = self._rates(state + 0.5 * h * k2, middle)
            k4 = self._rates(state + h * k3, there)
            state = state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        self.state = state

    def _rates(self, state: Array, sources: Array) -> Array:
        pressure, pipe = state[0], state[1]
        rates = np.empty_like(state)
        upstream = np.concatenate((pipe, sources[: self.groups]))[self.up]
        rates[1] = self._approach(upstream - pipe, self.times)
        if self.device:
            over = np.append(np.maximum(state[2] - pipe, 0.0)[1:], sources[-1])
            shared = np.append(np.minimum(pipe[:-1], pipe[1:]), 0.0)
            with_device = np.maximum(pipe, shared + over)
            rates[2] = self._approach(with_device - state[2], self.times)
            rates[2] += np.minimum(rates[1], 0.0)
        reduction = state[1:].max(axis=0)
        settled = np.zeros(self.size)
        for at, reductions, coefficients in self.services:
            settled[at] = np.interp(reduction[at], reductions, coefficients)
        rates[0] = self._approach(settled * self.largest - pressure, self.cylinder_times)
        return rates

    @staticmethod
    def _approach(lack: Array, times: Sequence[Any]) -> Array:
        """Return a lag's rate, with its times for falling and rising."""
        return lack / np.where(lack > 0.0, times[1], times[0])


def _upstream(consist: Consist, length: Array) -> NDArray[np.intp]:
    """Return for each vehicle which one feeds it from the locomotives; n + k is group k."""
    n = consist.size
    at = [group[0] for group in consist.groups]
    delays = [0.0] + [consist.radio_delay] * (len(at) - 1)
    along = np.concatenate(([0.0], np.cumsum(length)))
    index = np.arange(n)
    arrivals = []
    for source, delay in zip(at, delays, strict=True):
        first, last = np.minimum(index, source), np.maximum(index, source)
        arrivals.append(delay + (along[last + 1] - along[first]) / consist.application_speed)
    nearest = np.argmin(arrivals, axis=0)
    side = np.sign(np.array(at)[nearest] - index)
    return np.where(side == 0, n + nearest, index + side)
