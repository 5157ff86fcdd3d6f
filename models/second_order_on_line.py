"""The identified second-order train with a position, a friction brake and a standstill."""

from .line_breaker import line_breaker
from .plant import Plant
from .rolling import friction_brake, motion, roll


def second_order_train_on_line() -> Plant:
    """Return the plant of `second_order_train`, made to stop at a place.

    Traction gives an acceleration a with a' = wn² (K·notch − v) − 2 ζ wn a, as identified (T-S
    soft switching paper, eq. 12), and v' = a less the friction brake. Without it the speed is
    that of `second_order_train`. `dc_drive_train` has the same equations in physical quantities:
    a = CFΦ i / M; that fixes what the identification leaves open, how the brake enters. Brake,
    line breaker, standstill, and the mass that the brake force acts on are our choice. The default
    inner step of 2 ms keeps the motion within 1e-11 of the exact one (m, m/s).
    """
    with Plant(
        "second_order_train_on_line",
        description="Identified second-order train with position, friction brake and standstill",
        stop=60.0,
    ) as plant:
        notch = plant.input(
            "notch", unit="1", minimum=-10.0, maximum=10.0, description="control, our limit"
        )
        gain = plant.parameter(
            "gain", 2.2, unit="m/s", nominal=1.0, description="steady speed per notch, K"
        )
        wn = plant.parameter(
            "natural_frequency", 0.18, unit="rad/s", minimum=1e-3, description="wn"
        )
        zeta = plant.parameter("damping_ratio", 1.21, unit="1", minimum=0.0, description="ζ")
        mass = plant.parameter(
            "accelerated_mass", 16e3, unit="kg", minimum=1.0, nominal=1e4,
            description="mass that the brake force acts on, rotating masses included; our choice",
        )  # fmt: skip
        train = motion(plant)
        traction = plant.state(
            "traction", unit="m/s2", output=True,
            description="acceleration by traction, before the friction brake",
        )  # fmt: skip
        closed = line_breaker(plant, traction)
        rate = wn * wn * (gain * notch - train.speed) - 2.0 * zeta * wn * traction
        plant.der(traction, closed * rate)
        roll(plant, train, traction, friction_brake(plant, mass))
    return plant
