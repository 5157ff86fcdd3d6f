"""A plant's own equations as one step of a fixed-step method, with forward sensitivities.

A delayed command that is held between samples jumps inside a step. Each step therefore sees the
straight line with the same mean and the same first moment, and the mean of the right side over
the phases of braking that the step has a part in: smooth in the delays, and of second order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ...models import coarse_metro_train, metro_train
from ...models.metro_precise import AIR, BLENDING, ELECTRIC
from ...models.plant import Plant


@dataclass(frozen=True)
class Equations:
    """One step x⁺ = F(x, z, p) of a plant, and the same with sensitivities.

    `states`, `signals` and `parameters` name the elements of x, z and p. `advance` is F.
    `advance_with` takes (X, z, ż, p) with X = [x, ∂x/∂θ…], one column for each of `directions`;
    ż holds ∂z/∂θ of the signals in `moving`, which are (direction, signal) pairs.
    """

    states: tuple[str, ...]
    signals: tuple[str, ...]
    parameters: tuple[str, ...]
    directions: tuple[str, ...]
    moving: tuple[tuple[str, str], ...]
    advance: ca.Function
    advance_with: ca.Function


COMMAND = ("{}_mean", "{}_tilt")  # over the step: the mean, and the rise from the middle to the end
PHASES = ("blending", "faded", "since_onset")  # shares of the step; s from onset to the middle
K1K2 = ("air_numerator", "air_denominator")


def precise_equations() -> Equations:
    """Return the steps of `metro_train`; the directions are T1, T2, P1, T3, onset, T4, K1 and K2.

    T3 acts here on the command alone, and `onset` is the instant at which the air brake comes on.
    """
    plant = metro_train(gradients=1)
    names = ("speed", "motors", "air")
    parameters = (
        "electric_lag", "electric_coefficient", "air_lag", *K1K2, "mass_ratio", "fade_rate",
        "fade_reference", "davis_a", "davis_b", "davis_c",
    )  # fmt: skip
    signals = _signals("electric", "air", phases=PHASES)

    def rates(x: Any, z: Mapping[str, Any], p: Mapping[str, Any]) -> Any:
        values = {**dict(zip(names, x, strict=True)), **p, "standstill": 0.0}
        values |= {n: z[n] for n in ("electric_command", "air_command")}
        values["gradient_change"] = z["gradient"]
        values["air_gain"] = _dependent(plant, "air_gain", p)
        values |= {"changeover_time": 0.0, "air_delay": 0.0, "time": z["since_onset"]}
        share = {BLENDING: z["blending"], AIR: z["faded"]}
        share[ELECTRIC] = 1.0 - z["blending"] - z["faded"]
        return sum(s * _rates(plant, names, {**values, "phase": f}) for f, s in share.items())

    moving = tuple(
        (direction, signal)
        for direction, found in (
            ("electric_delay", _command("electric")),
            ("air_delay", _command("air")),
            ("onset", PHASES),
        )
        for signal in found
    )
    directions = (
        "electric_delay", "electric_lag", "electric_coefficient", "air_delay", "onset", "air_lag",
        *K1K2,
    )  # fmt: skip
    return _equations(names, signals, parameters, directions, moving, rates)


def coarse_equations() -> Equations:
    """Return the steps of `coarse_metro_train`; the directions are delay, lag and mass ratio."""
    plant = coarse_metro_train(gradients=1)
    names = ("speed", "effort")
    parameters = ("lag", "largest_deceleration", "mass_ratio", "davis_a", "davis_b", "davis_c")

    def rates(x: Any, z: Mapping[str, Any], p: Mapping[str, Any]) -> Any:
        values = {**dict(zip(names, x, strict=True)), **p, "standstill": 0.0}
        values |= {"command": z["_command"], "gradient_change": z["gradient"]}
        return _rates(plant, names, values)

    moving = tuple(("delay", signal) for signal in _command(""))
    directions = ("delay", "lag", "mass_ratio")
    return _equations(names, _signals(""), parameters, directions, moving, rates)


def _command(name: str) -> tuple[str, ...]:
    return tuple(text.format(name) for text in COMMAND)


def _signals(*commands: str, phases: tuple[str, ...] = ()) -> tuple[str, ...]:
    return (*(s for name in commands for s in _command(name)), *phases, "gradient", "step")


def _dependent(plant: Plant, name: str, values: Mapping[str, Any]) -> Any:
    return _evaluated(plant, [plant.dependents[name]], values)[0]


def _rates(plant: Plant, states: Sequence[str], values: Mapping[str, Any]) -> Any:
    """Return the states' time derivatives with these values; what is not among them has its start.

    None of the rest acts on these states: the position only with more than one gradient.
    """
    return ca.vertcat(*_evaluated(plant, [plant.derivatives[n] for n in states], values))


def _evaluated(plant: Plant, expressions: list[Any], values: Mapping[str, Any]) -> list[Any]:
    known = {v.name: v for v in plant.variables()}
    symbols = ca.symvar(ca.veccat(*expressions))
    given = [
        values[s.name()] if s.name() in values else ca.DM(list(known[s.name()].start or (0.0,)))
        for s in symbols
    ]
    found = ca.Function("found", symbols, expressions).call(given)
    return [ca.SX(e) for e in found]


def _equations(
    states: tuple[str, ...],
    signals: tuple[str, ...],
    parameters: tuple[str, ...],
    directions: tuple[str, ...],
    moving: tuple[tuple[str, str], ...],
    rates: Any,
) -> Equations:
    """Return the step of the classical Runge-Kutta method and its derivatives."""
    x, z, p = (ca.SX.sym(n, len(v)) for n, v in (("x", states), ("z", signals), ("p", parameters)))
    named = dict(zip(signals, ca.vertsplit(z), strict=True))
    constants = dict(zip(parameters, ca.vertsplit(p), strict=True))
    stems = [s.removesuffix("_mean") for s in signals if s.endswith("_mean")]

    def slope(y: Any, place: float) -> Any:
        """Return the rates at a place of the step: −1 its beginning, 0 its middle, 1 its end."""
        commands = {f"{s}_command": named[f"{s}_mean"] + place * named[f"{s}_tilt"] for s in stems}
        return rates(ca.vertsplit(y), {**named, **commands}, constants)

    h = named["step"]
    k1 = slope(x, -1.0)
    k2 = slope(x + 0.5 * h * k1, 0.0)
    k3 = slope(x + 0.5 * h * k2, 0.0)
    k4 = slope(x + h * k3, 1.0)
    after = x + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    advance = ca.Function("advance", [x, z, p], [ca.cse(after)])

    tangents, z_dot = ca.SX.sym("S", len(states), len(directions)), ca.SX.sym("zd", len(moving))
    seeds_z = ca.SX(len(signals), len(directions))
    for i, (direction, signal) in enumerate(moving):
        seeds_z[signals.index(signal), directions.index(direction)] = z_dot[i]
    seeds_p = ca.SX(len(parameters), len(directions))
    for i, direction in enumerate(directions):
        if direction in parameters:
            seeds_p[parameters.index(direction), i] = 1.0
    seeds = ca.vertcat(tangents, seeds_z, seeds_p)
    grown = ca.jtimes(after, ca.vertcat(x, z, p), seeds)
    block = ca.cse(ca.horzcat(after, grown))
    with_tangents = ca.Function("advance_with", [ca.horzcat(x, tangents), z, z_dot, p], [block])
    return Equations(states, signals, parameters, directions, moving, advance, with_tangents)


def over_steps(advance: ca.Function, steps: int) -> ca.Function:
    """Return the first state (and its derivatives) after each of `steps` steps.

    Of `advance` the last argument, the parameters, is the same for all.
    """
    accumulated = advance.mapaccum(steps)
    arguments = [
        ca.MX.sym(f"a{i}", advance.size1_in(i), accumulated.size2_in(i))
        for i in range(advance.n_in() - 1)
    ]
    p = ca.MX.sym("p", advance.size1_in(advance.n_in() - 1))
    found = accumulated(*arguments, ca.repmat(p, 1, steps))
    return ca.Function("over_steps", [*arguments, p], [found[0, :]])
