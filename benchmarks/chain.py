"""A heavy-haul train of n vehicles in one plant: the size that benchmarks and tests export.

Vehicle i pulls vehicle i + 1 through coupler i, a stiffening spring beside a viscous damper:

    F_i = k·d·(1 + s·d²) + c·(v_i − v_{i+1}),   d = x_i − x_{i+1}
    m_i v_i' = T_i + F_{i−1} − F_i − R_i,        x_i' = v_i

Positions count from each vehicle's place in the unloaded train at rest. R is Davis' resistance,
which turns with the speed's sign within ±`resistance.threshold`, plus the grade.
"""

import casadi as ca

from railcosim.models import Plant

GRAVITY = 9.81  # m/s²
KMH = 3.6


def chain(n: int, *, name: str = "chain", wagon: float = 100e3, locomotive: float = 200e3) -> Plant:
    """Return a train of one locomotive and n − 1 wagons, with masses in kg.

    A 25 t axle HXD1 before loaded C80 wagons. The draft gear's curve passes 2.27 MN at 0.166 m, as
    two MT-2 gears in series do; there is no friction in it, and no slack.
    """
    coupler, vehicle = _coupler(), _vehicle()
    with Plant(name, description=f"A train of {n} vehicles", stop=60.0, step=0.1) as plant:
        traction = plant.input("traction", unit="N", maximum=760e3, minimum=-461e3)
        mass = plant.parameter(
            "vehicle[].mass", [locomotive] + [wagon] * (n - 1), unit="kg", minimum=1.0, size=n
        )
        stiffness = plant.parameter("coupler.stiffness", 5e6, unit="N/m")
        stiffening = plant.parameter("coupler.stiffening", 63.0, unit="1/m2")
        damping = plant.parameter("coupler.damping", 5e4, unit="N.s/m")
        davis = _davis(plant)
        grade = plant.parameter("grade", 0.0, unit="1", description="climb per length")
        speed = plant.state("vehicle[].speed", unit="m/s", size=n)
        position = plant.state("vehicle[].position", unit="m", size=n)
        force = coupler.map(n - 1)(
            position[:-1], position[1:], speed[:-1], speed[1:], stiffness, stiffening, damping
        ).T
        pull = ca.vertcat(traction, force) - ca.vertcat(force, 0.0)
        plant.der(speed, vehicle.map(n)(pull, speed, mass, *davis, grade).T)
        plant.der(position, speed)
        plant.output("coupler.maximum", ca.mmax(force), unit="N")
        plant.output("coupler.first", force[0], unit="N")
        plant.output("head.speed", speed[0], unit="m/s")
        plant.output("head.position", position[0], unit="m")
        plant.output("rear.position", position[n - 1], unit="m")
    return plant


def _davis(plant: Plant) -> list[ca.MX]:
    """Declare the resistance of loaded wagons, (0.92 + 0.0048 V + 0.000125 V²) N/kN, V in km/h."""
    return [
        plant.parameter("resistance.constant", 0.92e-3, unit="1"),
        plant.parameter("resistance.linear", 0.0048e-3 * KMH, unit="s/m"),
        plant.parameter("resistance.quadratic", 0.000125e-3 * KMH**2, unit="s2/m2"),
        plant.parameter("resistance.threshold", 0.1, unit="m/s", minimum=1e-3),
    ]


def _coupler() -> ca.Function:
    """Return (x, x behind, v, v behind, k, s, c) -> force, tension positive."""
    x, behind, v, v_behind, k, s, c = symbols = ca.vertsplit(ca.SX.sym("coupler", 7))
    d = x - behind
    return ca.Function("coupler", symbols, [k * d * (1.0 + s * d * d) + c * (v - v_behind)])


def _vehicle() -> ca.Function:
    """Return (pull, v, m, a, b, c, threshold, grade) -> acceleration."""
    pull, v, m, a, b, c, threshold, grade = symbols = ca.vertsplit(ca.SX.sym("vehicle", 8))
    sign = v / ca.sqrt(v * v + threshold * threshold)
    davis = (a + b * ca.fabs(v) + c * v * v) * sign
    return ca.Function("vehicle", symbols, [pull / m - GRAVITY * (davis + grade)])
