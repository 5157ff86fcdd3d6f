"""A metro train as existing models have it: one first-order lag for all braking."""

import casadi as ca

from .metro_motion import commanded_mass, resistance, stand, traction_limit
from .plant import Plant
from .rolling import lag
from .solver import RungeKutta4


def coarse_metro_train(*, gradients: int = 16) -> Plant:
    """Return the "existing" model of the precise braking paper (eq. 28, figure 4).

    T a' = u − a with |u| ≤ 1.0 m/s² (100 cm/s²; the printed 10 would need 980 m to stop) and
    T = 0.65 s; v' = a − r. The input delay of 0.3 s is a `Delay` of the diagram. Traction (u > 0)
    is limited by force and power as in `metro_train`. `gradients` is the number of stretches of
    the line that it has room for.
    """
    with Plant(
        "coarse_metro_train",
        description="Metro train whose braking is one first-order lag",
        stop=40.0,
        solver=RungeKutta4(inner_step=0.01),
    ) as plant:
        command = plant.input(
            "command", unit="m/s2", minimum=-2.0, maximum=2.0,
            description="acceleration demanded, after the transmission delay; negative brakes",
        )  # fmt: skip
        time_constant = lag(plant, "lag", 0.65, "time constant of the brake system; paper, 3.1")
        largest = plant.parameter(
            "largest_deceleration", 1.0, unit="m/s2", minimum=0.0,
            description="largest braking; paper, 3.1, read as 100 cm/s2",
        )  # fmt: skip
        mass, ratio = commanded_mass(plant)
        position = plant.state("position", unit="m", nominal=100.0, output=True,
                               description="place of the train's front on the line")  # fmt: skip
        speed = plant.state(
            "speed", unit="m/s", nominal=10.0, output=True, description="train speed"
        )
        effort = plant.state(
            "effort", unit="m/s2", output=True, description="acceleration by traction or brake"
        )
        r = resistance(plant, position, speed, gradients=gradients)
        bounded = ca.fmin(ca.fmax(command, -largest), traction_limit(plant, speed, mass))
        plant.der(effort, (bounded / ratio - effort) / time_constant)
        plant.der(position, speed)
        stand(plant, speed, traction=effort, net=effort - r)
    return plant
