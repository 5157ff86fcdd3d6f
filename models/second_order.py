"""The identified second-order train of the soft-switching study."""

from .plant import Plant


def second_order_train() -> Plant:
    """Return speed over control as G(s) = K wn² / (s² + 2 ζ wn s + wn²).

    With the defaults this is 0.07128 / (s² + 0.4356 s + 0.0324), identified by experiment
    (T-S soft switching paper, eq. 12; its reference 16). K = 2.2 m/s per unit of control,
    wn = 0.18 rad/s, ζ = 1.21. The limit |u| ≤ 10 is our choice: 22 m/s at full control.

    As in the paper u = 0 is not coasting: it brakes by the model's own damping.
    """
    with Plant(
        "second_order_train",
        description="Train speed as an identified second-order system",
        stop=60.0,
    ) as plant:
        u = plant.input(
            "u", unit="1", minimum=-10.0, maximum=10.0, description="control (notch), our limit"
        )
        gain = plant.parameter(
            "gain", 2.2, unit="m/s", nominal=1.0, description="steady speed per unit of control, K"
        )
        wn = plant.parameter(
            "natural_frequency", 0.18, unit="rad/s", minimum=1e-3, description="wn"
        )
        zeta = plant.parameter("damping_ratio", 1.21, unit="1", minimum=0.0, description="ζ")
        speed = plant.state(
            "speed", unit="m/s", nominal=10.0, output=True, description="train speed"
        )
        acceleration = plant.state(
            "acceleration", unit="m/s2", output=True, description="rate of change of the speed"
        )
        plant.der(speed, acceleration)
        plant.der(acceleration, wn * wn * (gain * u - speed) - 2.0 * zeta * wn * acceleration)
    return plant
