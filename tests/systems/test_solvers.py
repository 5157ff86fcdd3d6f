"""The solvers inside an FMU: their orders, error control, and stiff problems."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.base.errors import DeclarationError, ParameterError
from railcosim.fmus import build
from railcosim.models import Plant
from railcosim.models.solver import DormandPrince, Rodas, RungeKutta4, SemiImplicitEuler, Solver
from tests import hybrid_plants
from tests.instances import FMU2Named


def swinging(solver: Solver) -> Plant:
    """A driven pendulum: nonlinear, and dependent on time."""
    with Plant("swinging", solver=solver) as plant:
        angle = plant.state("angle", unit="rad", start=1.0, output=True)
        rate = plant.state("rate", unit="rad/s", output=True)
        plant.der(angle, rate)
        plant.der(rate, -9.81 * ca.sin(angle) - 0.1 * rate + ca.cos(3.0 * plant.time))
    return plant


def oscillators(solver: Solver, n: int = 4) -> Plant:
    """A chain of masses and springs without damping."""
    with Plant("oscillators", solver=solver) as plant:
        x = plant.state("x", unit="m", size=n, start=[0.1, 0.0, 0.0, -0.05], output=True)
        v = plant.state("v", unit="m/s", size=n)
        plant.der(x, v)
        pull = ca.vertcat(x[1:] - x[:-1], 0.0)
        plant.der(v, 50.0 * (pull - ca.vertcat(0.0, pull[:-1])) - 10.0 * x)
        plant.output(
            "energy", 0.5 * ca.dot(v, v) + 5.0 * ca.dot(x, x) + 25.0 * ca.dot(pull, pull), unit="J"
        )
    return plant


def robertson(solver: Solver) -> Plant:
    """Robertson's reactions: rates from 0.04 to 3e7 (Hairer & Wanner II, IV.1)."""
    with Plant("robertson", stop=4e4, step=400.0, solver=solver) as plant:
        a = plant.state("a", unit="1", start=1.0, output=True)
        b = plant.state("b", unit="1", nominal=1e-5, output=True)
        c = plant.state("c", unit="1", output=True)
        slow, fast, back = 0.04 * a, 3e7 * b * b, 1e4 * b * c
        plant.der(a, -slow + back)
        plant.der(b, slow - back - fast)
        plant.der(c, fast)
    return plant


def van_der_pol(solver: Solver, stiffness: float = 1e-6) -> Plant:
    """Van der Pol's oscillator in the scaling of Hairer & Wanner II, IV.10."""
    with Plant("van_der_pol", stop=2.0, step=0.1, solver=solver) as plant:
        y = plant.state("y", unit="1", start=2.0, output=True)
        z = plant.state("z", unit="1", start=-0.66, output=True)
        plant.der(y, z)
        plant.der(z, ((1.0 - y * y) * z - y) / stiffness)
    return plant


def final(plant: Plant, folder: Path, stop: float, step: float, names: list[str]) -> np.ndarray:
    slave = FMU2Named(build(plant), folder)
    slave.initialize()
    slave.run(stop, step)
    values = np.array([slave.get(name) for name in names])
    slave.freeInstance()
    return values


def swing(t: float, x: np.ndarray) -> list[float]:
    return [x[1], -9.81 * np.sin(x[0]) - 0.1 * x[1] + np.cos(3.0 * t)]


@pytest.fixture(scope="module")
def swung() -> np.ndarray:
    solution = solve_ivp(swing, (0.0, 2.0), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14)
    return solution.y[:, -1]


@pytest.mark.parametrize(
    ("solver", "order"),
    [
        (lambda h: RungeKutta4(inner_step=h), 4.0),
        (lambda h: SemiImplicitEuler(inner_step=h, positions=("angle",)), 1.0),
    ],
)
def test_fixed_steps_converge_with_their_order(tmp_path: Path, swung, solver, order) -> None:
    errors = [
        np.max(
            np.abs(
                final(swinging(solver(h)), tmp_path / str(h), 2.0, 0.1, ["angle", "rate"]) - swung
            )
        )
        for h in (0.02, 0.01, 0.005)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([order, order], abs=0.25)


@pytest.mark.parametrize("solver", [DormandPrince, Rodas])
def test_error_control_keeps_its_tolerance(tmp_path: Path, swung, solver) -> None:
    """The error falls with the tolerance, and stays within a small multiple of it."""
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
        plant = swinging(solver(relative_tolerance=tolerance, absolute_tolerance=tolerance))
        found = final(plant, tmp_path / str(tolerance), 2.0, 2.0, ["angle", "rate"])
        assert np.max(np.abs(found - swung)) < 20.0 * tolerance


@pytest.mark.parametrize("solver", [DormandPrince, Rodas])
def test_the_method_under_the_error_control_has_its_order(tmp_path: Path, swung, solver) -> None:
    """With the tolerance out of the way, equal steps of solver.inner_step show the order."""
    errors = []
    for h in (0.08, 0.04, 0.02):
        plant = swinging(solver(inner_step=h, relative_tolerance=1e3, absolute_tolerance=1e3))
        found = final(plant, tmp_path / str(h), 2.0, 0.08, ["angle", "rate"])
        errors.append(np.max(np.abs(found - swung)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(5.0 if solver is DormandPrince else 4.0, abs=0.6)


def test_semi_implicit_euler_keeps_the_energy(tmp_path: Path) -> None:
    """10,000 periods later the energy is where it was; an explicit Euler step loses it at once."""
    plant = oscillators(SemiImplicitEuler(inner_step=0.005, positions=("x",)))
    slave = FMU2Named(build(plant), tmp_path)
    slave.initialize()
    energies = []
    for k in range(500):
        slave.doStep(k * 10.0, 10.0)
        energies.append(slave.get("energy"))
    slave.freeInstance()
    assert np.ptp(energies) / energies[0] < 0.1
    halves = np.mean(energies[:250]), np.mean(energies[250:])
    assert halves[1] == pytest.approx(halves[0], rel=5e-3)


def test_robertson(tmp_path: Path) -> None:
    names = ["a", "b", "c"]

    def f(t: float, y: np.ndarray) -> list[float]:
        slow, fast, back = 0.04 * y[0], 3e7 * y[1] ** 2, 1e4 * y[1] * y[2]
        return [-slow + back, slow - back - fast, fast]

    exact = solve_ivp(f, (0, 4e4), [1.0, 0.0, 0.0], method="Radau", rtol=1e-11, atol=1e-16).y[:, -1]
    plant = robertson(Rodas(inner_step=1e4, relative_tolerance=1e-7))
    found = final(plant, tmp_path, 4e4, 4e4, names)
    assert found == pytest.approx(exact, rel=1e-6)
    assert np.sum(found) == pytest.approx(1.0, abs=1e-12)  # Rosenbrock methods keep linear sums


def test_a_stiff_van_der_pol(tmp_path: Path) -> None:
    """Against scipy, and in few steps: an explicit method needs millions."""
    e = 1e-6

    def f(t: float, y: np.ndarray) -> list[float]:
        return [y[1], ((1.0 - y[0] ** 2) * y[1] - y[0]) / e]

    exact = solve_ivp(f, (0, 2.0), [2.0, -0.66], method="Radau", rtol=1e-11, atol=1e-12).y[:, -1]
    found = final(van_der_pol(Rodas(relative_tolerance=1e-8)), tmp_path, 2.0, 2.0, ["y", "z"])
    assert found == pytest.approx(exact, rel=1e-5)


def test_a_solver_that_cannot_go_on_says_when(tmp_path: Path) -> None:
    """x' = x² from 1 ends at t = 1."""
    with Plant("ending", solver=DormandPrince()) as plant:
        x = plant.state("x", unit="1", start=1.0, output=True)
        plant.der(x, x * x)
    slave = FMU2Named(build(plant), tmp_path)
    slave.initialize()
    slave.fails(lambda: slave.doStep(0.0, 2.0), "at t = ")
    assert slave.log[-1].split("t = ")[1].startswith(("0.99999", "1.00000"))
    slave.freeInstance()


def test_tolerances_are_parameters_of_the_fmu(tmp_path: Path, swung) -> None:
    slave = FMU2Named(build(swinging(DormandPrince())), tmp_path)
    slave.set("solver.relative_tolerance", 1e-12)
    slave.set("solver.absolute_tolerance", 1e-12)
    slave.initialize()
    slave.doStep(0.0, 2.0)
    assert slave.get("angle") == pytest.approx(swung[0], abs=1e-11)
    slave.reset()
    slave.setupExperiment(tolerance=1e-3, startTime=0.0)
    slave.enterInitializationMode()
    assert slave.get("solver.relative_tolerance") == 1e-3
    slave.freeInstance()


@pytest.mark.parametrize("solver", [DormandPrince(), Rodas()])
def test_events_are_found_by_every_solver(tmp_path: Path, solver: Solver) -> None:
    slave = FMU2Named(build(hybrid_plants.braking(solver=solver)), tmp_path)
    slave.set("solver.relative_tolerance", 1e-11)
    slave.initialize()
    slave.run(60.0, 5.0)
    v0, force, drag, mass = 20.0, 1.06e5, 12.0, 2e5
    stop = mass / np.sqrt(drag * force) * np.arctan(v0 * np.sqrt(drag / force))
    assert slave.get("stopped") == pytest.approx(stop, abs=1e-8)
    assert slave.get("speed") == 0.0
    slave.freeInstance()


@pytest.mark.parametrize("solver", [RungeKutta4(), DormandPrince(), Rodas()])
def test_fast_events_are_no_chattering(tmp_path: Path, solver: Solver) -> None:
    """10 kHz for a second, whatever the longest step is."""
    slave = FMU2Named(build(hybrid_plants.clock(period=1e-4), solver=solver), tmp_path)
    slave.initialize()
    slave.doStep(0.0, 1.00005)
    assert slave.get("ticks") == 10_000
    slave.freeInstance()


def test_steps_recover_after_a_tiny_one(tmp_path: Path) -> None:
    """A step cut short by an event does not make the next ones short: x' = 1 has no error."""
    with Plant("counted", solver=DormandPrince(inner_step=0.1)) as plant:
        x = plant.state("x", unit="1", output=True)
        steps = plant.memory("steps", unit="1", output=True)
        due = plant.memory("due", unit="s", start=0.1 + 1e-13)
        plant.der(x, 1.0)
        plant.update(steps, steps + 1.0)
        plant.time_event("tick", due, changes={due: due + 0.1})
    slave = FMU2Named(build(plant), tmp_path)
    slave.initialize()
    slave.run(10.0, 0.1)
    assert slave.get("steps") < 350
    slave.freeInstance()


def test_a_solver_that_does_not_fit_is_refused() -> None:
    with pytest.raises(DeclarationError, match="positions must be states, not x; states: angle"):
        swinging(SemiImplicitEuler(positions=("x",)))
    with pytest.raises(DeclarationError, match="the solver must be RungeKutta4"):
        swinging("rk4")  # type: ignore[arg-type]  # pyright: ignore
    with pytest.raises(ParameterError, match="relative_tolerance must be a number"):
        DormandPrince(relative_tolerance=0.0)
    with pytest.raises(DeclarationError, match="positions must be states"):
        build(swinging(RungeKutta4()), solver=SemiImplicitEuler(positions=()))
