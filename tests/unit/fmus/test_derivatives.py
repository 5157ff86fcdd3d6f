"""Directional derivatives, input derivatives and output derivatives."""

import zipfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models import Plant
from railcosim.models.solver import DormandPrince, Rodas, RungeKutta4
from tests import hybrid_plants, plants
from tests.instances import FMU2Named


def equations(path: Path) -> ca.Function:
    with zipfile.ZipFile(path) as archive:
        return ca.Function.deserialize(archive.read("resources/equations.casadi").decode())


CASES = [plants.everything, plants.pendulum, hybrid_plants.braking, hybrid_plants.geared]


@pytest.mark.parametrize("plant", CASES)
def test_directional_derivatives_are_casadis_jacobian(tmp_path: Path, plant) -> None:
    """All derivatives and outputs along states, inputs and parameters, at random points."""
    path = build(plant())
    slave = FMU2Named(path, tmp_path)
    function = equations(path)
    structure = slave.description
    dx = [u.variable.name for u in structure.derivatives]
    x = [u.variable.derivative.name for u in structure.derivatives]
    computed = [v.name for v in structure.modelVariables if v.initial == "calculated"]
    y = [n for n in computed if n not in dx and slave_kind(slave, n) == "output"]
    u = [v.name for v in structure.modelVariables if v.causality == "input"]
    p = [
        v.name
        for v in structure.modelVariables
        if v.causality == "parameter" and not v.name.startswith("solver.")
    ]
    jacobian = function.jacobian()
    generator = np.random.default_rng(5)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    for _ in range(5):
        for name in (*x, *u, *p):
            slave.set(name, slave.get(name) * generator.uniform(0.8, 1.25) + 1e-3)
        point = {
            "t": 0.0,
            "x": [slave.get(n) for n in x],
            "u": [slave.get(n) for n in u],
            "p": [slave.get(n) for n in p],
            "d": [0.0] * function.numel_in("d"),
        }
        blocks = jacobian(**point)
        for known, names in (("x", x), ("u", u), ("p", p)):
            for column, name in enumerate(names):
                for unknown, rows in (("dx", dx), ("y", y)):
                    if not rows:
                        continue
                    expected = np.array(blocks[f"jac_{unknown}_{known}"])[:, column]
                    found = slave.getDirectionalDerivative(
                        [slave.vr[r] for r in rows], [slave.vr[name]], [1.0]
                    )
                    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
    slave.freeInstance()


def slave_kind(slave: FMU2Named, name: str) -> str:
    return next(v.causality for v in slave.description.modelVariables if v.name == name)


def test_directional_derivatives_are_finite_differences(tmp_path: Path) -> None:
    slave = FMU2Named(build(plants.everything()), tmp_path)
    slave.initialize()
    slave.doStep(0.0, 0.5)
    unknown = ["der(v[1])", "der(v[2])", "power", "momentum[1]"]
    references = [slave.vr[n] for n in unknown]
    slave.set("u[1]", 2.0)
    for known in ("u[1]", "u[2]", "c"):
        values = []
        for shift in (1e-4, -1e-4):
            before = slave.get(known)
            slave.set(known, before + shift)
            values.append(np.array(slave.getReal(references)))
            slave.set(known, before)
        expected = (values[0] - values[1]) / 2e-4
        found = slave.getDirectionalDerivative(references, [slave.vr[known]], [1.0])
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
    slave.freeInstance()


def test_seeds_add_up(tmp_path: Path) -> None:
    slave = FMU2Named(build(plants.everything()), tmp_path)
    slave.initialize()
    known = [slave.vr[n] for n in ("v[1]", "u[1]", "c")]
    unknown = [slave.vr["der(v[1])"], slave.vr["v[1]"]]
    whole = slave.getDirectionalDerivative(unknown, known, [2.0, -3.0, 0.5])
    parts = [slave.getDirectionalDerivative(unknown, [k], [1.0]) for k in known]
    for i in range(2):
        assert whole[i] == pytest.approx(
            2.0 * parts[0][i] - 3.0 * parts[1][i] + 0.5 * parts[2][i], rel=1e-14
        )
    assert whole[1] == 2.0  # an output that is a state: its seed
    slave.freeInstance()


# Input derivatives


def driven(solver) -> Plant:
    """x' = u − x, with an output that shows the input at once."""
    with Plant("driven", solver=solver) as plant:
        u = plant.input("u", unit="1")
        x = plant.state("x", unit="1", output=True)
        plant.der(x, u - x)
        plant.output("both", 2.0 * u + x, unit="1")
    return plant


SOLVERS = [
    RungeKutta4(inner_step=0.01),
    DormandPrince(relative_tolerance=1e-12, absolute_tolerance=1e-12),
    Rodas(relative_tolerance=1e-11, absolute_tolerance=1e-11),
]


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_ramp_is_followed_within_the_step(tmp_path: Path, solver) -> None:
    """u = 1 + 3 t: x = 3 t − 2 + 2 exp(−t), exact in one large step."""
    slave = FMU2Named(build(driven(solver)), tmp_path)
    slave.initialize()
    slave.set("u", 1.0)
    slave.setRealInputDerivatives([slave.vr["u"]], [1], [3.0])
    slave.doStep(0.0, 2.0)
    expected = 3.0 * 2.0 - 2.0 + 2.0 * np.exp(-2.0)
    assert slave.get("x") == pytest.approx(expected, abs=1e-9)
    assert slave.get("u") == 7.0  # it rests where it arrived
    assert slave.get("both") == pytest.approx(14.0 + expected, abs=1e-9)
    slave.doStep(2.0, 1.0)  # for that one step only
    assert slave.get("u") == 7.0
    assert slave.get("x") == pytest.approx(7.0 + (expected - 7.0) * np.exp(-1.0), abs=1e-9)
    slave.freeInstance()


def test_input_derivatives_are_part_of_the_state(tmp_path: Path) -> None:
    slave = FMU2Named(build(driven(SOLVERS[0])), tmp_path)
    slave.initialize()
    slave.set("u", 1.0)
    slave.setRealInputDerivatives([slave.vr["u"]], [1], [3.0])
    state = slave.getFMUstate()
    slave.doStep(0.0, 1.0)
    expected = slave.get("x")
    slave.setRealInputDerivatives([slave.vr["u"]], [1], [-100.0])
    slave.setFMUstate(state)
    slave.doStep(0.0, 1.0)
    assert slave.get("x") == expected
    slave.freeFMUstate(state)
    slave.freeInstance()


def test_wrong_input_derivatives_are_refused(tmp_path: Path) -> None:
    slave = FMU2Named(build(driven(SOLVERS[0])), tmp_path)
    slave.initialize()
    u, x = slave.vr["u"], slave.vr["x"]
    slave.fails(lambda: slave.setRealInputDerivatives([u], [2], [1.0]), "only order 1")
    slave.fails(lambda: slave.setRealInputDerivatives([x], [1], [1.0]), "is no input")
    slave.fails(lambda: slave.setRealInputDerivatives([u], [1], [np.nan]), "u is not finite")
    slave.fails(lambda: slave.getRealOutputDerivatives([u], [1]), "is no real output")
    slave.fails(lambda: slave.getRealOutputDerivatives([x], [2]), "only order 1")
    slave.freeInstance()


def test_output_derivatives(tmp_path: Path) -> None:
    """Of a state, and of an output that follows a moving input."""
    slave = FMU2Named(build(driven(SOLVERS[0])), tmp_path)
    slave.initialize()
    slave.set("u", 1.0)
    slave.setRealInputDerivatives([slave.vr["u"]], [1], [3.0])
    slave.doStep(0.0, 1.0)
    slope = slave.get("u") - slave.get("x")
    found = slave.getRealOutputDerivatives([slave.vr["x"], slave.vr["both"]], [1, 1])
    assert list(found) == pytest.approx([slope, 2.0 * 3.0 + slope], rel=1e-14)
    slave.freeInstance()


def test_events_are_found_under_a_moving_input(tmp_path: Path) -> None:
    """A standing train is released where the ramp passes the resistance, inside the step."""
    slave = FMU2Named(build(hybrid_plants.braking()), tmp_path)
    for name, value in {"mode": 1, "speed": 0.0, "drag": 0.0}.items():
        slave.set(name, value)
    slave.initialize()
    slave.setRealInputDerivatives([slave.vr["drive"]], [1], [1e5])
    slave.doStep(0.0, 2.0)  # released at 1.06 s, then v' = 1e5 (t − 1.06)/2e5
    assert slave.get("speed") == pytest.approx(0.25 * (2.0 - 1.06) ** 2, rel=1e-9)
    slave.freeInstance()
