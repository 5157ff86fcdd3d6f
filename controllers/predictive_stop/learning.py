"""Learning from stop to stop: what lasts of a train's parameters, apart from what does not."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from .braking_model import BrakingModel, Samples
from .prior import COUNT, INDEX, OWN, Prior

STEPS = 6  # of Gauss–Newton after a stop
# Shares of a parameter's variance that change slowly and by the day; the rest is of each stop
# alone. The mass is that of the load, friction that of the brake shoes. Our choice.
FRICTION, MASS, OTHERS = (0.50, 0.30), (0.25, 0.60), (0.80, 0.0)
KEPT = (0.998, 0.85)  # of the slow and the daily part, from one stop to the next


@dataclass(frozen=True, slots=True)
class Learning:
    """What stops of one train at one station have taught.

    The parameters of stop k are θ_k = nominal + Σ_i x_i,k + w_k with parts x_i,k+1 = a_i x_i,k + …
    that are stationary, of covariances `parts`, and `rest` that of w. A Kalman filter over the
    parts x = (x_1, x_2, …): with H = (I, I, …), the stop's prior is m = nominal + H x̂,
    P = H P_x Hᵀ + W, and its estimate's m⁺ and P⁺ give

        G = P_x Hᵀ P⁻¹,  x̂ ← x̂ + G (m⁺ − m),  P_x ← P_x − G (P − P⁺) Gᵀ

    (as Rauch, Tung and Striebel hand a later estimate back), then x̂ ← A x̂, P_x ← A P_x Aᵀ + Q
    with Q = parts − A parts Aᵀ. Speed, position and wheel scale begin anew at each stop.
    """

    nominal: Prior
    kept: tuple[float, ...]
    parts: tuple[tuple[tuple[float, ...], ...], ...]
    rest: tuple[tuple[float, ...], ...]
    estimate: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    stops: int = 0

    @classmethod
    def begin(
        cls,
        nominal: Prior,
        *,
        friction: tuple[float, ...] = FRICTION,
        mass: tuple[float, ...] = MASS,
        others: tuple[float, ...] = OTHERS,
        kept: tuple[float, ...] = KEPT,
    ) -> Self:
        """Return what is known before the first stop: nothing but the nominal prior.

        `friction`, `mass` and `others` are shares of variances, one for each of `kept`. The air
        brake's gain varies with friction and mass, the electric one with P1 and mass; g and Ke
        have no covariance but by the mass.
        """
        whole = np.array(nominal.covariance)
        g, k = INDEX["electric_gain"], INDEX["air_gain"]
        of_mass = np.zeros((COUNT, COUNT))
        common = whole[g, k]
        ratio = nominal.mean[g] / nominal.mean[k]
        of_mass[g, k] = of_mass[k, g] = common
        of_mass[g, g], of_mass[k, k] = common * ratio, common / ratio
        of_friction = np.zeros((COUNT, COUNT))
        of_friction[k, k] = whole[k, k] - of_mass[k, k]
        own = [INDEX[name] for name in OWN]
        of_others = whole - of_mass - of_friction
        of_others[own, :] = of_others[:, own] = 0.0
        parts = [
            f * of_friction + m * of_mass + o * of_others
            for f, m, o in zip(friction, mass, others, strict=True)
        ]
        n = COUNT * len(parts)
        covariance = np.zeros((n, n))
        for i, part in enumerate(parts):
            covariance[COUNT * i : COUNT * (i + 1), COUNT * i : COUNT * (i + 1)] = part
        rest = whole - sum(parts)
        return cls(
            nominal, kept, tuple(_rows(p) for p in parts), _rows(rest), (0.0,) * n,
            _rows(covariance),
        )  # fmt: skip

    @property
    def prior(self) -> Prior:
        """What is believed of the next stop."""
        H = self._sum()
        mean = np.array(self.nominal.mean) + H @ np.array(self.estimate)
        covariance = H @ np.array(self.covariance) @ H.T + np.array(self.rest)
        return Prior.of(mean, covariance)

    def updated(self, mean: Any, covariance: Any) -> Self:
        """Return what is known after a stop at which the estimate was m⁺ with covariance P⁺."""
        H, prior = self._sum(), self.prior
        x, Px, P = (np.array(a) for a in (self.estimate, self.covariance, prior.covariance))
        G = np.linalg.solve(P, H @ Px).T
        own = [INDEX[name] for name in OWN]
        change = np.asarray(mean) - np.array(prior.mean)
        change[own] = 0.0  # they are not learnt; G has zeros there
        x = x + G @ change
        Px = Px - G @ (P - np.asarray(covariance)) @ G.T
        A = np.repeat(self.kept, COUNT)
        Px = A[:, None] * Px * A
        for i, part in enumerate(self.parts):
            where = slice(COUNT * i, COUNT * (i + 1))
            Px[where, where] += (1.0 - self.kept[i] ** 2) * np.array(part)
        covariance = _rows(0.5 * (Px + Px.T))
        return type(self)(
            self.nominal, self.kept, self.parts, self.rest, tuple((A * x).tolist()), covariance,
            self.stops + 1,
        )  # fmt: skip

    def after(self, model: BrakingModel, theta: tuple[float, ...], samples: Samples) -> Self:
        """Return what is known after a stop with these samples, at standstill at the end.

        θ is where the estimation begins: the estimate at the stop.
        """
        i = INDEX["speed"]
        prior = self.prior.starting(theta[i], theta[i + 1])
        found = model.estimate(theta, samples, prior, steps=STEPS)
        return self.updated(found.theta, np.linalg.inv(found.information))

    def _sum(self) -> np.ndarray:
        return np.tile(np.eye(COUNT), len(self.parts))


def _rows(matrix: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in np.asarray(matrix).tolist())
