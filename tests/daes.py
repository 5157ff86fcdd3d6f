"""Small models as CasADi users write them, with a `casadi.DaeBuilder`."""

from contextlib import suppress

import casadi as ca


def damper() -> ca.DaeBuilder:
    """m v' = F - c v - k s, with every kind of parameter, and outputs of every kind."""
    dae = ca.DaeBuilder("damper")
    dae.add("t", "independent")
    force = dae.add("force", "input", {"unit": "N", "start": 1.0, "min": -50, "max": 50})
    mass = dae.add("mass", "parameter", "fixed", {"unit": "kg", "start": 2.0, "min": 0.1})
    stiffness = dae.add("stiffness", "parameter", "tunable", {"unit": "N/m", "start": 8.0})
    damping = dae.add("damping", "parameter", "tunable", {"unit": "N.s/m", "start": 0.5})
    half = dae.add("half", "local", "constant", {"start": 0.5})
    position = dae.add(
        "position", "output", {"unit": "m", "start": 1.0, "description": "from rest", "nominal": 2}
    )
    speed = dae.add("speed", {"unit": "m/s"})
    pull = dae.add("pull", "output", {"unit": "N", "min": -100})
    energy = dae.add("energy", "output", {"unit": "J"})
    dae.eq(pull, stiffness * position + damping * speed)  # first: casadi/casadi issue 4096
    dae.eq(energy, half * (mass * speed**2 + stiffness * position**2))
    dae.eq(dae.der(position), speed)
    dae.eq(dae.der(speed), (force - pull) / mass)
    dae.set_stop_time(4.0)
    dae.set_step_size(0.02)
    return dae


def ball() -> ca.DaeBuilder:
    """A bouncing ball that counts, with the restitution as a parameter."""
    dae = ca.DaeBuilder("ball")
    restitution = dae.add("restitution", "parameter", "tunable", {"start": 0.8})
    height = dae.add("height", "output", {"unit": "m", "start": 5.0})
    speed = dae.add("speed", "output", {"unit": "m/s"})
    bounces = dae.add("bounces", "output", {"type": "Int32", "start": 0})
    dae.eq(dae.der(height), speed)
    dae.eq(dae.der(speed), -9.81)
    dae.when(
        height < 0,
        [dae.reinit("speed", -restitution * speed), dae.assign("bounces", bounces + 1)],
    )
    dae.set_start_time(0.0)
    dae.set_stop_time(6.0)
    return dae


def thermostat() -> ca.DaeBuilder:
    """Two conditions that change one Boolean, and a clock that moves a stored real."""
    dae = ca.DaeBuilder("thermostat")
    t = dae.add("t", "independent")
    warmth = dae.add("warmth", "output", {"unit": "K", "start": 290.0, "nominal": 300})
    heating = dae.add("heating", "output", {"type": "Boolean", "start": True})
    tick = dae.add("tick", "local", "discrete", {"unit": "s", "start": 10.0})
    dae.add("seen", "output", "discrete", {"unit": "K"})
    dae.eq(dae.der(warmth), ca.if_else(heating, 0.3, 0) - 0.01 * (warmth - 280))
    dae.when(warmth > 295, [dae.assign("heating", 0)])
    dae.when(warmth < 289, [dae.assign("heating", 1)])
    dae.when(t > tick, [dae.assign("tick", tick + 10), dae.assign("seen", warmth)])
    dae.set_stop_time(60.0)
    return dae


def chain() -> ca.DaeBuilder:
    """Vectors, dependents, a quadrature, a Function, explicit algebraic equations."""
    dae = ca.DaeBuilder("chain")
    t = dae.add("t", "independent")
    u = dae.add("u", "input", {"dimension": [3], "unit": "N", "start": [1.0, 2.0, 3.0]})
    m = dae.add("m", "parameter", "fixed", {"dimension": [3], "unit": "kg", "start": [1, 2, 3]})
    k = dae.add("k", "parameter", "tunable", {"unit": "1/s", "start": 0.7})
    twice = dae.add("twice", "calculatedParameter", "tunable", {"unit": "1/s"})
    thrice = dae.add("thrice", "calculatedParameter", "tunable", {"unit": "1/s"})
    v = dae.add("v", "output", {"dimension": [3], "unit": "m/s", "start": [0.5, 0.0, -0.5]})
    work = dae.add("work", "output", {"unit": "J"})
    power = dae.add("power", "output", {"unit": "W"})
    drag = dae.add("drag", {"dimension": [3]})
    net = dae.add("net", {"dimension": [3]})
    jerk = dae.add("jerk", "output", {"dimension": [3], "unit": "m/s2"})
    # CasADi 3.8.2 takes the equation of a dependent parameter, and then complains.
    with suppress(RuntimeError):
        dae.eq(twice, 2 * k)
    with suppress(RuntimeError):
        dae.eq(thrice, twice + k)
    s = ca.SX.sym("s", 3)
    shape = ca.Function("shape", [s], [s * ca.fabs(s)])
    dae.eq(jerk, 2.0 * dae.der(v))  # before der(v) is known: an algebraic variable der_v
    dae.eq(dae.der(v), net / m)
    dae.eq(0, net - (u * ca.sin(t) - drag))
    dae.eq(drag, thrice * shape(v))
    dae.eq(power, ca.dot(u, v))
    dae.eq(dae.der(work), power)
    dae.set_category("work", "q")
    dae.set_stop_time(3.0)
    return dae


ALL = (damper, ball, thermostat, chain)
