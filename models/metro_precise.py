"""A metro train with an electric brake that hands over to an air brake at low speed."""

from typing import Any, NamedTuple

import casadi as ca

from ..base.railway import KILOMETRES_PER_HOUR
from .metro_motion import (
    commanded_mass,
    resistance,
    stand,
    traction_limit,
)
from .plant import Plant
from .rolling import lag
from .solver import RungeKutta4

# By how much (m/s) a train must be faster than the changeover speed to count as fast: so rounding,
# where it has just come up to that speed, is no coming down to it.
ABOVE = 1e-6
# The mode `phase`
SLOW, ELECTRIC, WAITING, BLENDING, AIR = range(5)


def metro_train(*, gradients: int = 16, probe: bool = False) -> Plant:
    """Return the precise braking model (precise braking paper, eqs. 1 to 10, as differential ones).

    v' = w B_e + B_p − r; T2 B_e' = P1 u_e/μ − B_e; T4 B_p' = K φ(v) min(u_p, 0)/μ − B_p once the
    air brake is on, else −B_p. u_e and u_p are the command (m/s²) after the transmission delays T1
    and T3, which are `Delay` blocks of the diagram. φ = (V + 150)/(2V + 150), V in km/h. At the
    first v ≤ V_sw since departure (`changeover`) a timer of T3 begins; at its end the air brake
    comes on, and the electric brake fades by w = max(0, 1 − k_bra (t − t_sw − T3)/0.7).

    With `probe` there is a third input `air_probe` u_a, after a delay T3 of its own, by which the
    air brake can be tried out before its time: K φ(v) min(u_a, 0)/μ is added to what is demanded
    of it, whether it is on or not.

    The paper's equations hold for one step from rest and name no command; the ordinary
    differential equations, the command as a factor, w's reference of 0.7 m/s², V_sw, k_bra, and
    K = K1/K2 (85.16 cm/s², only the ratio acts) are our reading. So are the traction (u > 0,
    by the motors, limited by force and power), the holding brake, and that a train which has
    braked electrically without reaching V_sw changes over at its first brake command. The probe
    is our choice.
    """
    with Plant(
        "metro_train",
        description="Metro train with electric brake, blending and air brake",
        stop=40.0,
        solver=RungeKutta4(inner_step=0.01),
    ) as plant:
        electric_command, air_command = (
            plant.input(
                f"{name}_command", unit="m/s2", minimum=-2.0, maximum=2.0,
                description=f"acceleration demanded of the {what}, after its transmission delay",
            )
            for name, what in (("electric", "motors"), ("air", "air brake (negative)"))
        )  # fmt: skip
        air_probe = _probe(plant) if probe else None
        mass, ratio = commanded_mass(plant)
        position = plant.state("position", unit="m", nominal=100.0, output=True,
                               description="place of the train's front on the line")  # fmt: skip
        speed = plant.state(
            "speed", unit="m/s", nominal=10.0, output=True, description="train speed"
        )
        changeover = _changeover(plant, speed, electric_command)
        motors = _electric(plant, electric_command, ratio, traction_limit(plant, speed, mass))
        air = _air(plant, air_command, air_probe, ratio, speed, changeover)
        share = _blending(plant, changeover)
        r = resistance(plant, position, speed, gradients=gradients)
        plant.der(position, speed)
        standstill = stand(plant, speed, traction=motors, net=share * motors + air - r)
        _below_changeover(plant, electric_command, changeover, standstill)
        _outputs(plant, mass, speed, share * motors, r)
    return plant


def _probe(plant: Plant) -> Any:
    """Declare the input by which the air brake is tried out."""
    return plant.input(
        "air_probe", unit="m/s2", minimum=-2.0, maximum=2.0,
        description="demanded of the air brake as well, whether it is on or not (negative), after "
        "its transmission delay; our choice",
    )  # fmt: skip


class Changeover(NamedTuple):
    """The handing over from the electric to the air brake."""

    phase: Any
    time: Any
    onset: Any


def _changeover(plant: Plant, speed: Any, command: Any) -> Changeover:
    """Declare the phases of braking and the events between them."""
    switch = plant.parameter(
        "changeover_speed", 12.0 / KILOMETRES_PER_HOUR, unit="m/s", minimum=0.1,
        description="speed V_sw at which the changeover begins; our choice",
    )  # fmt: skip
    delay = plant.parameter(
        "air_delay", 0.8, unit="s", minimum=0.0,
        description="T3, timer between changeover and air brake; paper, table 1",
    )  # fmt: skip
    phase = plant.mode(
        "phase", start=SLOW, minimum=SLOW, maximum=AIR, output=True,
        description="0 slow, 1 electric, 2 waiting for the air brake, 3 blending, 4 air brake",
    )  # fmt: skip
    time = plant.memory(
        "changeover_time", unit="s", output=True, description="when the changeover began last"
    )
    onset = time + delay
    plant.event(
        "fast", speed - switch - ABOVE, direction="rising", when=phase == SLOW,
        changes={phase: ELECTRIC},
        description="the speed has risen above the changeover speed",
    )  # fmt: skip
    plant.event(
        "changeover", speed - switch, direction="falling", when=phase == ELECTRIC,
        changes={phase: WAITING, time: plant.time},
        description="the speed has come down to the changeover speed",
    )  # fmt: skip
    plant.time_event("air_brake_on", onset, when=phase == WAITING, changes={phase: BLENDING})
    return Changeover(phase, time, onset)


def _below_changeover(plant: Plant, command: Any, changeover: Changeover, standstill: Any) -> None:
    """Declare what happens to a train that drives off, or brakes, below the changeover speed."""
    phase = changeover.phase
    plant.event(
        "brake_while_slow", command, direction="falling",
        when=ca.logic_and(phase == SLOW, standstill == 0),
        changes={phase: WAITING, changeover.time: plant.time},
        description="braking begins before the changeover speed was reached; our choice",
    )  # fmt: skip
    stopped = ca.logic_and(phase >= WAITING, standstill == 1)
    plant.event(
        "traction_again", command - 0.1, direction="rising",
        when=ca.logic_or(phase == AIR, stopped), changes={phase: SLOW},
        description="traction is demanded (above 0.1 m/s2) at standstill, or after the motors' "
        "brake has faded: the air brake releases; our choice",
    )  # fmt: skip


def _electric(plant: Plant, command: Any, ratio: Any, limit: Any) -> Any:
    """Declare the motors; return the acceleration that they would give without blending."""
    coefficient = plant.parameter(
        "electric_coefficient", 0.85, unit="1", minimum=0.0,
        description="P1, electric brake over what is commanded; paper, table 1",
    )  # fmt: skip
    time_constant = lag(plant, "electric_lag", 0.83, "T2, response of the motors; paper, table 1")
    motors = plant.state(
        "motors", unit="m/s2", description="acceleration by the motors, before blending"
    )
    demanded = ca.fmin(coefficient * command / ratio, limit)
    plant.der(motors, (demanded - motors) / time_constant)
    return motors


def _air(
    plant: Plant, command: Any, probe: Any, ratio: Any, speed: Any, changeover: Changeover
) -> Any:
    """Declare the air brake; return its acceleration (negative)."""
    numerator = plant.parameter(
        "air_numerator", 1.0142, unit="1", minimum=0.0, description="K1; paper, table 1"
    )
    denominator = plant.parameter(
        "air_denominator", 0.01191, unit="1", minimum=1e-6, nominal=0.01,
        description="K2; paper, table 1",
    )  # fmt: skip
    gain = plant.dependent(
        "air_gain", numerator / denominator / 100.0, unit="m/s2",
        description="K = K1/K2, full air brake at standstill; the paper's is in cm/s2",
    )  # fmt: skip
    time_constant = lag(plant, "air_lag", 1.741, "T4, response of the air brake; paper, table 1")
    air = plant.state(
        "air", unit="m/s2", output=True, description="acceleration by the air brake (negative)"
    )
    v = KILOMETRES_PER_HOUR * speed
    friction = (v + 150.0) / (2.0 * v + 150.0)  # of the brake shoes, over that at standstill
    demanded = gain * friction * ca.fmin(command, 0.0) / ratio
    on = changeover.phase >= BLENDING
    asked = ca.if_else(on, demanded, 0.0)
    if probe is not None:
        asked = asked + gain * friction * ca.fmin(probe, 0.0) / ratio
    plant.der(air, (asked - air) / time_constant)
    plant.output(
        "air_brake_on", ca.if_else(on, 1.0, 0.0), unit="1", description="1 with the air brake on"
    )
    return air


def _blending(plant: Plant, changeover: Changeover) -> Any:
    """Declare how the electric brake fades; return its share w."""
    slope = plant.parameter(
        "fade_rate", 0.3, unit="m/s3", minimum=0.01,
        description="k_bra, slope at which the electric brake leaves; our choice",
    )  # fmt: skip
    reference = plant.parameter(
        "fade_reference", 0.7, unit="m/s2", minimum=0.01,
        description="braking that leaves within reference/rate; our choice",
    )  # fmt: skip
    phase, onset = changeover.phase, changeover.onset
    plant.time_event(
        "motors_off", onset + reference / slope, when=phase == BLENDING, changes={phase: AIR}
    )
    fading = 1.0 - slope * (plant.time - onset) / reference
    return ca.if_else(phase == BLENDING, fading, ca.if_else(phase == AIR, 0.0, 1.0))


def _outputs(plant: Plant, mass: Any, speed: Any, electric: Any, r: Any) -> None:
    """Declare what a run shows beside the motion."""
    plant.output("electric", electric, unit="m/s2", description="acceleration by the motors")
    plant.output("resistance", r, unit="m/s2", description="deceleration by resistance, gradients")
    energy = plant.state(
        "traction_energy", unit="J", nominal=1e7, output=True,
        description="work of the traction at the wheel",
    )  # fmt: skip
    plant.der(energy, mass * ca.fmax(electric, 0.0) * speed)
