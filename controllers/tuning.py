"""Tuning rules for PID controllers, and the reaction curve that Ziegler-Nichols needs."""

import math

from ..base.errors import ParameterError


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise ParameterError(f"{name} must be a positive number, not {value!r}")


def reaction_curve(*, gain: float, tau1: float, tau2: float) -> dict[str, float]:
    """Return gain, time constant and dead time (s) of gain / ((tau1 s + 1)(tau2 s + 1)).

    Tangent construction at the inflection of the unit step response, which for two different
    time constants (s) lies at t = ln(tau1/tau2) tau1 tau2 / (tau1 − tau2).
    """
    _positive(gain=gain, tau1=tau1, tau2=tau2)
    if tau1 == tau2:
        inflection, slope = tau1, gain / tau1 * math.exp(-1.0)
        value = gain * (1.0 - 2.0 * math.exp(-1.0))
    else:
        inflection = math.log(tau1 / tau2) * tau1 * tau2 / (tau1 - tau2)
        a, b = math.exp(-inflection / tau1), math.exp(-inflection / tau2)
        slope = gain * (a - b) / (tau1 - tau2)
        value = gain * (1.0 - (tau1 * a - tau2 * b) / (tau1 - tau2))
    return {
        "gain": gain,
        "time_constant": gain / slope,
        "dead_time": inflection - value / slope,
    }


def ziegler_nichols(*, gain: float, time_constant: float, dead_time: float) -> dict[str, float]:
    """Return kp, ti, td of Ziegler and Nichols' open-loop rules for PID (1942).

    kp = 1.2 T/(K L), ti = 2 L, td = L/2 for a process with gain K, time constant T and dead time
    L (s).
    """
    _positive(gain=gain, time_constant=time_constant, dead_time=dead_time)
    return {
        "kp": 1.2 * time_constant / (gain * dead_time),
        "ti": 2.0 * dead_time,
        "td": 0.5 * dead_time,
    }


def simc(
    *, gain: float, tau1: float, tau2: float, tau_c: float, dead_time: float = 0.0
) -> dict[str, float]:
    """Return kp, ti, td, filter_time of Skogestad's SIMC rules, in ideal form.

    Series form: Kc = tau1 / (K (tau_c + L)), tau_I = min(tau1, 4 (tau_c + L)), tau_D = tau2;
    ideal form: kp = Kc (1 + tau_D/tau_I), ti = tau_I + tau_D, td = tau_I tau_D / (tau_I + tau_D).
    The derivative filter is tau_D/10. Times in s, tau1 ≥ tau2.
    """
    _positive(gain=gain, tau1=tau1, tau2=tau2, tau_c=tau_c)
    if tau1 < tau2 or dead_time < 0.0:
        raise ParameterError("SIMC needs tau1 ≥ tau2 and a dead time from 0 s")
    closed = tau_c + dead_time
    kc, ti, td = tau1 / (gain * closed), min(tau1, 4.0 * closed), tau2
    return {
        "kp": kc * (1.0 + td / ti),
        "ti": ti + td,
        "td": ti * td / (ti + td),
        "filter_time": td / 10.0,
    }
