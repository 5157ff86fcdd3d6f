"""The step that the FMU of a plant with SemiImplicitEuler makes, against the same in Python."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models import Plant
from railcosim.models.solver import SemiImplicitEuler
from tests.instances import FMU2Named

H = 2.0**-6  # s


def plant(*, left: bool = False) -> Plant:
    """A plant whose positions need the step's end: time, inputs, and the others' new values.

    With `left` its functions are CasADi's C, not loops.
    """
    solver = SemiImplicitEuler(inner_step=H, positions=("x", "z"))
    with Plant("needs_the_end", solver=solver) as made:
        u = made.input("u", unit="1", size=3)
        k = made.parameter("k", 2.0, unit="1")
        x = made.state("x", unit="1", size=3, output=True)
        v = made.state("v", unit="1/s", size=3, start=(1.0, -0.5, 0.25), output=True)
        z = made.state("z", unit="1", start=0.5, output=True)
        held = made.memory("held", unit="1", start=1.0)
        drive = u - k * x + made.time
        made.der(v, ca.solve(ca.DM.eye(3), drive) if left else drive)
        made.friction(v, 0.25 + 0.125 * ca.fabs(v))
        made.der(x, v + u * made.time)
        made.der(z, x[0] - z * held)
        made.update(held, held + z)
    return made


@pytest.mark.parametrize("left", [False, True])
def test_positions_are_evaluated_at_the_end(left: bool, tmp_path: Path) -> None:
    """Inputs ramp within the communication step; the positions' own old values count."""
    slave = FMU2Named(build(plant(left=left)), tmp_path)
    slave.initialize()
    x, v, z, held = np.zeros(3), np.array([1.0, -0.5, 0.25]), 0.5, 1.0
    start, rate = np.array([0.5, -1.0, 0.0]), np.array([4.0, 8.0, -2.0])
    references = [slave.vr[f"u[{i}]"] for i in (1, 2, 3)]
    for k in range(4):
        slave.setReal(references, [*start])
        slave.setRealInputDerivatives(references, [1, 1, 1], [*rate])
        slave.doStep(k * 4 * H, 4 * H)
        for j in range(4):
            t, u = (4 * k + j) * H, start + rate * j * H
            most = H * (0.25 + 0.125 * np.abs(v))
            moved = v + H * (u - 2.0 * x + t)
            v = moved - np.clip(moved, -most, most)
            t, u = t + H, start + rate * (j + 1) * H
            x, z = x + H * (v + u * t), z + H * (x[0] - z * held)
            held += z
        found = [slave.get(f"{name}[{i}]") for name in "xv" for i in (1, 2, 3)]
        np.testing.assert_allclose(found, [*x, *v], rtol=1e-14, atol=1e-15)
        assert slave.get("z") == pytest.approx(z, rel=1e-14)
    slave.freeInstance()


@pytest.mark.parametrize("what", ["drive", "limit", "position"])
def test_what_is_no_number_is_named(what: str, tmp_path: Path) -> None:
    """The root of a number below zero, in one of three elements, after 0.5 s."""
    solver = SemiImplicitEuler(inner_step=H, positions=("x",))
    with Plant(f"no_number_{what}", solver=solver) as made:
        wrong = {name: ca.MX.zeros(3) for name in ("drive", "limit", "position")}
        wrong[what] = ca.vertcat(0.0, ca.sqrt(0.5 - made.time), 0.0)
        v = made.state("v", unit="m/s", size=3, start=1.0, output=True)
        x = made.state("x", unit="m", size=3)
        made.der(v, wrong["drive"] - 0.1 * v)
        made.der(x, v + wrong["position"])
        made.friction(v, wrong["limit"] + 0.1)
    slave = FMU2Named(build(made), tmp_path)
    slave.initialize()
    name = "x[2]" if what == "position" else "v[2]"
    slave.fails(lambda: slave.run(1.0, 2.0**-3), f"{name} is not finite at t = 0.5")
    slave.freeInstance()
