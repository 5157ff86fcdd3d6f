"""A train on separately excited DC traction motors, the physics behind the identified plant."""

from .line_breaker import line_breaker
from .plant import Plant
from .rolling import friction_brake, motion, roll


def dc_drive_train() -> Plant:
    """Return a separately excited DC traction motor with its share of the train.

    Voltage balance L di/dt + R i = ku·notch − CvΦ v (adaptive fuzzy ATO paper, eq. 1; the notches
    of the handle are voltage steps) and motion M dv/dt = CFΦ i − friction brake (eq. 2 and 3),
    with M = m (1 + γ). Equations (4) and (5), which combine them, are lost in the text; they
    follow as V/N = ku CFΦ/(L M) / (s² + R/L s + CvΦ CFΦ/(L M)). All quantities are those of one
    motor.

    The paper gives no numbers. These are our choice, such that V/N is its identified plant
    0.07128 / (s² + 0.4356 s + 0.0324) exactly. The price is an inductance of 2.5 H, far above a
    real armature's. The friction brake, the line breaker and the standstill are ours as well. The
    default inner step of 2 ms keeps the motion within 1e-11 of the exact one (m, m/s).
    """
    with Plant(
        "dc_drive_train",
        description="Train on separately excited DC traction motors, with a friction brake",
        stop=60.0,
    ) as plant:
        notch = plant.input(
            "notch", unit="1", minimum=-10.0, maximum=10.0,
            description="notch of the handle, our limit",
        )  # fmt: skip
        ku = plant.parameter(
            "voltage_per_notch", 79.2, unit="V", nominal=100.0, description="ku; our choice"
        )
        inductance = plant.parameter(
            "inductance", 2.5, unit="H", minimum=1e-3,
            description="L of the armature circuit; our choice, far above a real armature's",
        )  # fmt: skip
        resistance = plant.parameter(
            "resistance", 1.089, unit="Ohm", minimum=0.0,
            description="R of the armature circuit; our choice",
        )  # fmt: skip
        cv = plant.parameter(
            "emf_constant", 36.0, unit="V.s/m", minimum=0.0,
            description="CvΦ, back electromotive force over speed; our choice",
        )  # fmt: skip
        cf = plant.parameter(
            "force_constant", 36.0, unit="N/A", minimum=0.0,
            description="CFΦ, tractive force over current; equal to CvΦ without losses; our choice",
        )  # fmt: skip
        mass = plant.parameter(
            "mass", 12800.0, unit="kg", minimum=1.0, nominal=1e4,
            description="train mass for each motor, m; our choice",
        )  # fmt: skip
        rotary = plant.parameter(
            "rotary_mass_factor", 1.25, unit="1", minimum=1.0,
            description="1 + γ, accelerated mass over mass; our choice",
        )  # fmt: skip
        accelerated = plant.dependent(
            "accelerated_mass", mass * rotary, unit="kg", description="M = m (1 + γ)"
        )
        train = motion(plant)
        current = plant.state(
            "current", unit="A", nominal=100.0, output=True, description="armature current"
        )
        closed = line_breaker(plant, current)
        voltage = ku * notch - cv * train.speed - resistance * current
        plant.der(current, closed * voltage / inductance)
        friction = friction_brake(plant, accelerated)
        force = cf * current
        plant.output(
            "tractive_force", force, unit="N", nominal=1e4, description="CFΦ i, of one motor"
        )
        roll(plant, train, force / accelerated, friction)
    return plant
