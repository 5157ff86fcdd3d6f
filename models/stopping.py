"""A train that is to stop at a mark: brake and traction with a lag, scatter in parameters."""

from typing import Any

import casadi as ca

from .plant import Plant
from .rolling import adhesion_limit, lag, motion, roll
from .solver import RungeKutta4


def stopping_train() -> Plant:
    """Return a train before its stopping mark, which is at position 0.

    `demand` (m/s², positive drives, negative brakes) is followed by one signed effort f with a
    first-order lag: f' = (demand − f)/lag. Traction pushes forwards, v' = r f − drag for f > 0;
    the brake is friction, v' = −effectiveness·r |f| − drag in forward motion for f < 0: it cannot
    push backwards, and holds at standstill. r = nominal mass / mass: the effort is a force,
    expressed as what it gives to the nominal mass. With `emergency` the demand is the emergency
    deceleration, with a lag of its own. Adhesion limits brake and traction.

    The station stop paper gives no train; the structure, numbers, and 6 m/s at 22.5 m before the
    mark (which 0.8 m/s² would just reach) are our choice. An inner step of 1 ms keeps the motion
    within 1e-11 of the exact one (m, m/s) for lags from 0.1 s up.
    """
    with Plant(
        "stopping_train",
        description="Train before a stopping mark, with a lagged brake and traction",
        stop=30.0,
        step=0.1,
        solver=RungeKutta4(inner_step=0.001),
    ) as plant:
        ratio = _mass_ratio(plant)
        effectiveness = plant.parameter(
            "effectiveness", 1.0, unit="1", minimum=0.01, tunable=True,
            description="brake force over the force demanded",
        )  # fmt: skip
        brake_gain = plant.dependent(
            "brake_gain", effectiveness * ratio, unit="1", description="deceleration over effort"
        )
        drag = plant.parameter(
            "drag", 0.0, unit="m/s2", minimum=0.0, nominal=0.01,
            description="constant running resistance",
        )  # fmt: skip
        limit = adhesion_limit(plant)
        train = motion(plant, position=-22.5, speed=6.0)
        effort = plant.state(
            "effort", unit="m/s2", output=True,
            description="traction (positive) or brake (negative), at the nominal mass",
        )  # fmt: skip
        command, time_constant = _commanded(plant)
        # The wheel-slide protection keeps the effort within the adhesion.
        bounded = ca.fmin(ca.fmax(command, -limit / brake_gain), limit / ratio)
        plant.der(effort, (bounded - effort) / time_constant)
        traction = ca.fmin(ratio * ca.fmax(effort, 0.0), limit)
        brake = ca.fmin(brake_gain * ca.fmax(-effort, 0.0), limit)
        _changeover(plant, effort)
        roll(plant, train, traction, brake + drag)
    return plant


def _mass_ratio(plant: Plant) -> Any:
    """Declare the masses, and return what the effort's force gives to the train, over effort."""
    mass = plant.parameter(
        "mass", 2e5, unit="kg", minimum=1.0, nominal=1e5,
        description="train mass, rotating masses included; our choice",
    )  # fmt: skip
    nominal = plant.parameter(
        "nominal_mass", 2e5, unit="kg", minimum=1.0, nominal=1e5,
        description="mass for which demand and effort are accelerations; our choice",
    )  # fmt: skip
    return plant.dependent(
        "traction_gain", nominal / mass, unit="1", description="acceleration over effort"
    )


def _commanded(plant: Plant) -> tuple[Any, Any]:
    """Declare the inputs and lags; return the effort commanded and its time constant."""
    demand = plant.input(
        "demand", unit="m/s2", minimum=-1.2, maximum=1.2,
        description="positive drives, negative brakes; the bounds are our choice",
    )  # fmt: skip
    emergency = plant.input(
        "emergency", unit="1", minimum=0.0, maximum=1.0,
        description="1: emergency brake (from above 0.5)",
    )  # fmt: skip
    service_lag = lag(plant, "lag", 0.35, "time constant of brake and traction; our choice")
    deceleration = plant.parameter(
        "emergency_deceleration", 1.4, unit="m/s2", minimum=0.0,
        description="effort of the emergency brake; our choice",
    )  # fmt: skip
    emergency_lag = lag(
        plant, "emergency_lag", 0.2, "time constant of the emergency brake; our choice"
    )
    applied = emergency > 0.5
    return (
        ca.if_else(applied, -deceleration, demand),
        ca.if_else(applied, emergency_lag, service_lag),
    )


def _changeover(plant: Plant, effort: Any) -> None:
    """Let the solver end a step where traction and brake change over: the slope has a kink there.

    A step across it would cost accuracy.
    """
    changeover = plant.memory(
        "changeover", unit="s", description="when traction and brake changed over last"
    )
    plant.event("changeover", effort, direction="both", changes={changeover: plant.time})
