"""Small plants for the tests, each with a solution that can be written down."""

import casadi as ca

from railcosim.models import Plant


def integrator(*, start: float = 0.0) -> Plant:
    """x' = u."""
    with Plant("integrator") as plant:
        u = plant.input("u", unit="1/s")
        x = plant.state("x", unit="1", start=start, output=True)
        plant.der(x, u)
    return plant


def everything() -> Plant:
    """Vectors, a tunable parameter, time, computed outputs with and without feedthrough."""
    with Plant("everything", description="one of each", stop=2.0, step=0.01) as plant:
        u = plant.input("u", unit="N", size=2, minimum=-5.0, maximum=5.0)
        m = plant.parameter("m", [1.0, 2.0], unit="kg", minimum=0.1, size=2)
        c = plant.parameter("c", 0.5, unit="N.s/m", tunable=True)
        v = plant.state("v", unit="m/s", size=2, start=[1.0, -1.0], output=True)
        plant.der(v, (u - c * v) / m + 0.1 * ca.sin(plant.time))
        plant.output("power", ca.dot(u, v), unit="W")
        plant.output("momentum", m * v, unit="N.s")
    return plant


def passing(name: str, *, unit: str = "1") -> Plant:
    """y = u at once, beside a lag: direct feedthrough in an FMU."""
    with Plant(name) as plant:
        u = plant.input("u", unit=unit)
        lag = plant.state("lag", unit=unit)
        plant.der(lag, u - lag)
        plant.output("y", 2.0 * u, unit=unit)
    return plant


def blow_up() -> Plant:
    """x' = x², which is infinite at t = 1."""
    with Plant("blow_up") as plant:
        x = plant.state("x", unit="1", start=1.0, output=True)
        plant.der(x, x * x)
    return plant


def pendulum() -> Plant:
    """A nonlinear plant without input, so that the reference must integrate."""
    with Plant("pendulum", stop=5.0, step=0.02) as plant:
        angle = plant.state("angle", unit="rad", start=1.0, output=True)
        rate = plant.state("rate", unit="rad/s")
        plant.der(angle, rate)
        plant.der(rate, -9.81 * ca.sin(angle))
        plant.output("height", 1.0 - ca.cos(angle), unit="m")
    return plant


def tunable() -> Plant:
    """x' = −k x with a bounded tunable k."""
    with Plant("tunable") as plant:
        k = plant.parameter("k", 1.0, unit="1/s", minimum=0.5, tunable=True)
        x = plant.state("x", unit="1", start=1.0, output=True)
        plant.der(x, -k * x)
    return plant


def switching() -> Plant:
    """Constant pieces, whose derivative is zero although they are not linear."""
    with Plant("switching") as plant:
        u = plant.input("u", unit="1", minimum=-5.0, maximum=5.0)
        x = plant.state("x", unit="1", start=1.0, output=True)
        plant.der(x, ca.sign(u))
    return plant


def resting() -> Plant:
    """A signal that is zero but for rounding."""
    with Plant("resting") as plant:
        x = plant.state("x", unit="1", start=0.1, output=True)
        plant.der(x, 0.3 - x * 3.0)
        plant.output("zero", x - 0.1, unit="1")
    return plant


def undefined() -> Plant:
    """An output that is NaN at the start."""
    with Plant("undefined") as plant:
        x = plant.state("x", unit="1")
        plant.der(x, 1.0)
        plant.output("y", ca.log(x - 1.0), unit="1")
    return plant
