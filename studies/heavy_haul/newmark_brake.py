"""The air brake of the heavy-haul train's Newmark reference: pipe and cylinders, in numpy."""

import math
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
    the side of the source whose wave would arrive first, at the source's own vehicle the source.
    Sources are the first locomotive of each group, and the last vehicle if the train has an
    end-of-train device. Radio delays count here only for who is first: the reductions given are
    taken as they come. The cylinder follows c(r) · largest pressure, first order, application and
    release each with its time constant. All but c(r) (public page) is our choice.

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
        self.reduction, self.pressure = np.zeros(self.size), np.zeros(self.size)  # kPa, Pa

    def advance(self, step: float, before: Array, after: Array) -> None:
        """Go on by `step` (s) while the sources' reductions (kPa) go linearly from `before`."""
        parts = math.ceil(step / (FINENESS * self.shortest) - 1e-9)
        h = step / parts
        state = np.stack((self.reduction, self.pressure))
        for part in range(parts):
            here, middle, there = (
                before + (after - before) * (part + share) / parts for share in (0.0, 0.5, 1.0)
            )
            k1 = self._rates(state, here)
            k2 = self._rates(state + 0.5 * h * k1, middle)
            k3 = self._rates(state + 0.5 * h * k2, middle)
            k4 = self._rates(state + h * k3, there)
            state = state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        self.reduction, self.pressure = state

    def _rates(self, state: Array, sources: Array) -> Array:
        reduction, pressure = state
        rise = np.concatenate((reduction, sources))[self.up] - reduction
        rates = np.empty_like(state)
        rates[0] = rise / np.where(rise > 0.0, self.times[1], self.times[0])
        settled = np.zeros(self.size)
        for at, reductions, coefficients in self.services:
            settled[at] = np.interp(reduction[at], reductions, coefficients)
        lack = settled * self.largest - pressure
        rates[1] = lack / np.where(lack > 0.0, self.cylinder_times[1], self.cylinder_times[0])
        return rates


def _upstream(consist: Consist, length: Array) -> NDArray[np.intp]:
    """Return for each vehicle which one feeds it; n + k stands for source k."""
    n = consist.size
    at = [group[0] for group in consist.groups]
    delays = [0.0] + [consist.radio_delay] * (len(at) - 1)
    if consist.end_of_train:
        at.append(n - 1)
        delays.append(consist.end_of_train.radio_delay)
    along = np.concatenate(([0.0], np.cumsum(length)))
    index = np.arange(n)
    arrivals = []
    for source, delay in zip(at, delays, strict=True):
        first, last = np.minimum(index, source), np.maximum(index, source)
        arrivals.append(delay + (along[last + 1] - along[first]) / consist.application_speed)
    nearest = np.argmin(arrivals, axis=0)
    side = np.sign(np.array(at)[nearest] - index)
    return np.where(side == 0, n + nearest, index + side)
