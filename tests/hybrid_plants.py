"""Hybrid plants for the tests, each with a solution that can be written down."""

import casadi as ca

from railcosim.models import Plant
from railcosim.models.solver import RungeKutta4, Solver

MOVING, STANDING = 0, 1
COARSE = RungeKutta4(inner_step=0.01)


def braking(*, solver: Solver = COARSE) -> Plant:
    """A train that brakes to standstill and holds there until the drive exceeds the resistance."""
    with Plant("braking", stop=60.0, step=0.1, solver=solver) as plant:
        drive = plant.input("drive", unit="N", minimum=-3e5, maximum=3e5)
        brake = plant.parameter("brake", 1e5, unit="N", minimum=0.0, tunable=True)
        mass = plant.parameter("mass", 2e5, unit="kg", minimum=1.0)
        holding = plant.parameter("holding", 6e3, unit="N", minimum=0.0)
        drag = plant.parameter("drag", 12.0, unit="kg/m", minimum=0.0)
        x = plant.state("position", unit="m", output=True)
        v = plant.state("speed", unit="m/s", start=20.0, output=True, nominal=10.0)
        mode = plant.mode("mode", minimum=0, maximum=1, output=True)
        stopped = plant.memory("stopped", unit="s", start=-1.0, output=True)
        push = drive - (brake + holding + drag * v * v)
        plant.der(x, v)
        plant.der(v, ca.if_else(mode == MOVING, push / mass, 0.0))
        plant.output("acceleration", ca.if_else(mode == MOVING, push / mass, 0.0), unit="m/s2")
        plant.event(
            "stop",
            v,
            direction="falling",
            when=mode == MOVING,
            changes={mode: STANDING, v: 0.0, stopped: plant.time},
        )
        plant.event(
            "release",
            drive - (brake + holding),
            direction="rising",
            when=mode == STANDING,
            changes={mode: MOVING},
        )
    return plant


def ball(*, restitution: float = 0.8, rest: float = 0.0, solver: Solver = COARSE) -> Plant:
    """A bouncing ball; with `rest` > 0 it lies still once it bounces slower than that (m/s)."""
    with Plant("ball", stop=3.0, step=0.01, solver=solver) as plant:
        e = plant.parameter("restitution", restitution, unit="1", minimum=0.0, maximum=1.0)
        h = plant.state("height", unit="m", start=1.0, output=True)
        v = plant.state("speed", unit="m/s", output=True)
        lying = plant.mode("lying", output=True)
        bounces = plant.mode("bounces", output=True)
        plant.der(h, v)
        plant.der(v, ca.if_else(lying == 1, 0.0, -9.81))
        plant.event(
            "bounce",
            h,
            direction="falling",
            when=lying == 0,
            changes={
                v: ca.if_else(ca.fabs(v) < rest, 0.0, -e * v),
                lying: ca.if_else(ca.fabs(v) < rest, 1, 0),
                h: 0.0,
                bounces: bounces + 1,
            },
        )
    return plant


def stick_slip(*, solver: Solver = COARSE) -> Plant:
    """A block on a moving belt, held by a spring: it sticks to F_s, then slips until it sticks."""
    with Plant("stick_slip", stop=20.0, step=0.05, solver=solver) as plant:
        belt = plant.parameter("belt", 0.1, unit="m/s")
        static = plant.parameter("static", 1.5, unit="N")
        kinetic = plant.parameter("kinetic", 1.0, unit="N")
        x = plant.state("position", unit="m", output=True)
        v = plant.state("speed", unit="m/s", output=True, start=0.1)
        sticking = plant.mode("sticking", start=1, output=True)
        plant.der(x, ca.if_else(sticking == 1, belt, v))
        plant.der(v, ca.if_else(sticking == 1, 0.0, kinetic - 4.0 * x))
        plant.event(
            "slip", 4.0 * x - static, direction="rising", when=sticking == 1, changes={sticking: 0}
        )
        plant.event(
            "stick",
            v - belt,
            direction="rising",
            when=sticking == 0,
            changes={sticking: 1, v: belt},
        )
    return plant


def counters(*, frequency: float = 1.0, solver: Solver = COARSE) -> Plant:
    """Counts the crossings of sin(ω t) − level: up, down, and both."""
    with Plant("counters", stop=10.0, step=0.1, solver=solver) as plant:
        w = plant.parameter("w", frequency, unit="rad/s")
        level = plant.parameter("level", 0.0, unit="1")
        x = plant.state("x", unit="1", output=True)
        y = plant.state("y", unit="1", start=1.0)
        up = plant.mode("up", output=True)
        down = plant.mode("down", output=True)
        both = plant.mode("both", output=True)
        last = plant.memory("last", unit="s", output=True)
        plant.der(x, w * y)
        plant.der(y, -w * x)
        plant.event("rise", x - level, direction="rising", changes={up: up + 1})
        plant.event("fall", x - level, direction="falling", changes={down: down + 1})
        plant.event("pass", x - level, direction="both", changes={both: both + 1, last: plant.time})
    return plant


def twins(*, apart: float = 0.0) -> Plant:
    """Two events of one moving state, `apart` seconds from each other; the order is recorded."""
    with Plant("twins", stop=2.0, step=0.1, solver=COARSE) as plant:
        x = plant.state("x", unit="1", output=True)
        order = plant.mode("order", output=True)
        first = plant.memory("first", unit="s", start=-1.0, output=True)
        second = plant.memory("second", unit="s", start=-1.0, output=True)
        plant.der(x, 1.0)
        plant.event(
            "late", x - (0.5 + apart), direction="rising",
            changes={order: 10 * order + 2, second: plant.time},
        )  # fmt: skip
        plant.event(
            "early", x - 0.5, direction="rising",
            changes={order: 10 * order + 1, first: plant.time},
        )  # fmt: skip
    return plant


def chatter() -> Plant:
    """A relay without hysteresis: slides along x = 0 by switching without end."""
    with Plant("chatter", stop=3.0, step=0.1, solver=COARSE) as plant:
        x = plant.state("x", unit="1", start=1.0, output=True)
        side = plant.mode("side", start=1)
        plant.der(x, -1.0 * side)
        plant.event("down", x, direction="falling", when=side == 1, changes={side: -1})
        plant.event("up", x, direction="rising", when=side == -1, changes={side: 1})
    return plant


def clock(*, period: float = 0.3) -> Plant:
    """A sawtooth: x' = 1, back to zero by a time event every period."""
    with Plant("clock", stop=3.0, step=0.1, solver=COARSE) as plant:
        t = plant.parameter("period", period, unit="s", minimum=1e-6)
        x = plant.state("x", unit="s", output=True)
        due = plant.memory("due", unit="s", start=period)
        ticks = plant.mode("ticks", output=True)
        plant.der(x, 1.0)
        plant.time_event("tick", due, changes={x: 0.0, due: due + t, ticks: ticks + 1})
    return plant


def draft_gear(*, solver: Solver = COARSE) -> Plant:
    """A driven coupler with hysteresis in incremental form: F = clip(F + k Δd, lower, upper)."""
    with Plant("draft_gear", stop=4.0, step=0.05, solver=solver) as plant:
        rate = plant.input("rate", unit="m/s", minimum=-0.1, maximum=0.1)
        k = plant.parameter("k", 8e7, unit="N/m")
        d = plant.state("stroke", unit="m", output=True, nominal=0.1)
        last = plant.memory("last_stroke", unit="m")
        stored = plant.memory("stored_force", unit="N", nominal=1e5)
        upper = 2e6 * ca.fabs(d) + 1e4
        force = ca.fmin(ca.fmax(stored + k * (d - last), -upper), upper)
        plant.der(d, rate)
        plant.update(stored, force)
        plant.update(last, d)
        plant.output("force", force, unit="N", nominal=1e5)
    return plant


def fleet(n: int = 5) -> Plant:
    """Vehicles that brake independently, each with its standstill: a vector event."""
    with Plant("fleet", stop=10.0, step=0.1, solver=COARSE) as plant:
        brake = plant.parameter("vehicle[].brake", [1.0 + i for i in range(n)], unit="m/s2", size=n)
        v = plant.state("vehicle[].speed", unit="m/s", start=6.043, size=n, output=True)
        still = plant.mode("vehicle[].still", size=n, output=True)
        plant.der(v, ca.if_else(still == 1, 0.0, -brake))
        plant.event("stop", v, direction="falling", when=still == 0, changes={still: 1, v: 0.0})
    return plant


def geared() -> Plant:
    """Dependent parameters, one made of another, in the equations and in an event."""
    with Plant("geared", stop=2.0, step=0.1) as plant:
        teeth = plant.parameter("teeth", [20.0, 60.0], unit="1", size=2, minimum=1.0)
        load = plant.parameter("load", 2.0, unit="kg.m2", minimum=0.1, tunable=True)
        ratio = plant.dependent("ratio", teeth[1] / teeth[0], unit="1")
        inertia = plant.dependent("inertia", load / (ratio * ratio), unit="kg.m2")
        torque = plant.input("torque", unit="N.m")
        w = plant.state("rate", unit="rad/s", output=True)
        plant.der(w, torque / inertia)
        plant.output("load_rate", w / ratio, unit="rad/s")
    return plant


def rivals(*, resets: bool = False) -> Plant:
    """Two events on one crossing at t = 0.6: the first closes the second's guard, or resets x.

    After the reset x passes 0.6 again at t = 1.2, which then is the second's.
    """
    with Plant("rivals", stop=2.0, step=0.1, solver=COARSE) as plant:
        x = plant.state("x", unit="1", output=True)
        first = plant.mode("first", output=True)
        second = plant.mode("second", output=True)
        plant.der(x, 1.0)
        plant.event(
            "one", x - 0.6, direction="rising", when=first == 0,
            changes={first: 1, x: 0.0} if resets else {first: 1},
        )  # fmt: skip
        plant.event(
            "two", x - 0.6, direction="rising", when=(second == 0) if resets else (first == 0),
            changes={second: second + 1},
        )  # fmt: skip
    return plant
