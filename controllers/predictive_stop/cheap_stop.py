"""The cheap variant: estimates while braking electrically only, and an aim that is trimmed."""

from dataclasses import replace
from typing import Any

from .controller import PredictiveStop
from .prior import Prior

TAKEN = ("davis", "air_delay", "air_lag", "air_gain", "changeover_speed", "fade_rate")
TRIM = 0.2  # share of a stop's error that the next aim takes back
LARGEST_ERROR = 0.3  # m, of those that a trim believes


def cheap_stop(prior: Prior, **options: Any) -> PredictiveStop:
    """Return a predictive stop that estimates the electric brake and the gradients, down to V_sw.

    The air brake and the running resistance are taken at the prior's mean, so nothing is estimated
    once the air brake is due. `options` are those of PredictiveStop. Our choice.
    """
    taken = prior.known({name: prior[name] for name in TAKEN})
    return PredictiveStop(prior=taken, estimate_above=prior["changeover_speed"], **options)


def trimmed(controller: PredictiveStop, error: float) -> PredictiveStop:
    """Return the controller for the next stop after one with an error (m, positive: past the mark).

    aim ← aim − 0.2 · clip(error, ±0.3 m).
    """
    believed = max(-LARGEST_ERROR, min(LARGEST_ERROR, error))
    plan = controller.plan
    return replace(controller, plan=plan._replace(aim=plan.aim - TRIM * believed))
