"""Halves of coupled systems, exported to FMUs for the tests of the master algorithms."""

import casadi as ca

from railcosim.models import Plant


def driven_mass() -> Plant:
    """m x'' = −c x − d x' + force: the half of the oscillator that takes a force."""
    with Plant("driven_mass") as plant:
        force = plant.input("force", unit="N")
        m = plant.parameter("m", 1.0, unit="kg")
        c = plant.parameter("c", 10.0, unit="N/m")
        d = plant.parameter("d", 0.1, unit="N.s/m")
        x = plant.state("x", unit="m", output=True)
        v = plant.state("v", unit="m/s", output=True)
        plant.der(x, v)
        plant.der(v, (force - c * x - d * v) / m)
    return plant


def _sprung(plant: Plant) -> ca.MX:
    """Declare a mass behind the coupling spring, whose other end is moved; return its force."""
    far = plant.input("far", unit="m")
    far_speed = plant.input("far_speed", unit="m/s")
    m = plant.parameter("m", 1.0, unit="kg")
    c = plant.parameter("c", 10.0, unit="N/m")
    d = plant.parameter("d", 0.1, unit="N.s/m")
    ck = plant.parameter("ck", 100.0, unit="N/m")
    dk = plant.parameter("dk", 1.0, unit="N.s/m")
    x = plant.state("x", unit="m", output=True)
    v = plant.state("v", unit="m/s", output=True)
    force = ck * (x - far) + dk * (v - far_speed)
    plant.der(x, v)
    plant.der(v, (-c * x - d * v - force) / m)
    return force


def sprung_mass() -> Plant:
    """The other half: takes a displacement, gives the coupling's force, with feedthrough."""
    with Plant("sprung_mass") as plant:
        plant.output("force", _sprung(plant), unit="N")
    return plant


def silent_sprung_mass() -> Plant:
    """The same without the force as an output, so that nothing feeds through."""
    with Plant("silent_sprung_mass") as plant:
        _sprung(plant)
    return plant


def wheel() -> Plant:
    """A quarter car's unsprung mass on its tyre: takes the suspension's force and the road."""
    with Plant("wheel") as plant:
        force = plant.input("force", unit="N")
        road = plant.input("road", unit="m")
        m = plant.parameter("m", 40.0, unit="kg")
        stiffness = plant.parameter("stiffness", 150e3, unit="N/m")
        x = plant.state("x", unit="m", output=True)
        v = plant.state("v", unit="m/s", output=True)
        plant.der(x, v)
        plant.der(v, (stiffness * (road - x) + force) / m)
    return plant


def chassis() -> Plant:
    """A quarter car's sprung mass with the suspension: takes the wheel's motion, gives the force
    that the suspension puts on the wheel.
    """
    with Plant("chassis") as plant:
        wheel_x = plant.input("wheel_x", unit="m")
        wheel_v = plant.input("wheel_v", unit="m/s")
        m = plant.parameter("m", 400.0, unit="kg")
        stiffness = plant.parameter("stiffness", 15e3, unit="N/m")
        damping = plant.parameter("damping", 1e3, unit="N.s/m")
        x = plant.state("x", unit="m", output=True)
        v = plant.state("v", unit="m/s", output=True)
        force = stiffness * (x - wheel_x) + damping * (v - wheel_v)
        plant.der(x, v)
        plant.der(v, -force / m)
        plant.output("force", force, unit="N")
    return plant


# a + b + c = s, 2 a − 3 b + 2 c = 9, a² + b² + c² = 5: each solved for one of its unknowns.


def first_equation() -> Plant:
    """a = s − b − c."""
    with Plant("first_equation") as plant:
        b = plant.input("b", unit="1")
        c = plant.input("c", unit="1")
        s = plant.input("s", unit="1")
        plant.output("a", s - b - c, unit="1")
    return plant


def second_equation() -> Plant:
    """b = (2 a + 2 c − 9) / 3."""
    with Plant("second_equation") as plant:
        a = plant.input("a", unit="1")
        c = plant.input("c", unit="1")
        plant.output("b", (2.0 * a + 2.0 * c - 9.0) / 3.0, unit="1")
    return plant


def third_equation() -> Plant:
    """c = √(5 − a² − b²)."""
    with Plant("third_equation") as plant:
        a = plant.input("a", unit="1")
        b = plant.input("b", unit="1")
        plant.output("c", ca.sqrt(5.0 - a * a - b * b), unit="1")
    return plant


# Linear plants whose matrices are parameters, for random networks.


def _linear(name: str, *, direct: bool) -> Plant:
    with Plant(name) as plant:
        u = ca.vertcat(plant.input("u1", unit="1"), plant.input("u2", unit="1"))
        matrices = {}
        for letter in "abcd" if direct else "abc":
            entries = plant.parameter(letter, [0.0] * 4, unit="1", size=4)
            rows = [[entries[0], entries[1]], [entries[2], entries[3]]]
            matrices[letter] = ca.vertcat(*[ca.horzcat(*row) for row in rows])
        x1 = plant.state("x1", unit="1")
        x2 = plant.state("x2", unit="1")
        x = ca.vertcat(x1, x2)
        rate = matrices["a"] @ x + matrices["b"] @ u
        plant.der(x1, rate[0])
        plant.der(x2, rate[1])
        y = matrices["c"] @ x
        if direct:
            y = y + matrices["d"] @ u
        plant.output("y1", y[0], unit="1")
        plant.output("y2", y[1], unit="1")
    return plant


def linear() -> Plant:
    """x' = A x + B u, y = C x."""
    return _linear("linear", direct=False)


def linear_direct() -> Plant:
    """x' = A x + B u, y = C x + D u."""
    return _linear("linear_direct", direct=True)
