"""Dry friction of a state: held at exactly zero, and Moreau's scheme against closed forms."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Model

from railcosim.base.errors import DeclarationError
from railcosim.cosim.fmu.log import callbacks, close_log, open_log
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.models import Plant
from railcosim.models.solver import DormandPrince, Rodas, RungeKutta4, SemiImplicitEuler
from tests.instances import FMU2Named
from tests.unit.fmus.state_continuation import continued

ROOT = Path(__file__).parents[3]
GRAVITY = 9.81
STEPS = [2.0**-k for k in (7, 8, 9, 10)]  # s, exact, so that times add up without rounding
FINE = 2.0**-12


def block(size: int | None = None, *, solver: Any = None) -> Plant:
    """A block on an incline, drawn by a spring: m v' = force − k x − c v − m g i ± friction."""
    moving = SemiImplicitEuler(inner_step=STEPS[-1], positions=("x",))
    with Plant("block", stop=8.0, step=2.0**-6, solver=solver or moving) as plant:
        force = plant.input("force", unit="N", size=size, minimum=-20.0, maximum=20.0)
        mass = plant.parameter("mass", 2.0, unit="kg", minimum=0.1, size=size)
        incline = plant.parameter("incline", 0.0, unit="1", size=size)
        spring = plant.parameter("spring", 0.0, unit="N/m", size=size)
        dry = plant.parameter("dry", 4.0, unit="N", size=size)
        wet = plant.parameter("wet", 0.0, unit="N.s/m", size=size)
        v = plant.state("v", unit="m/s", size=size, output=True)
        x = plant.state("x", unit="m", size=size)
        plant.der(x, v)
        plant.der(v, (force - spring * x) / mass - GRAVITY * incline)
        plant.friction(v, (dry + wet * ca.fabs(v)) / mass)
    return plant


@pytest.fixture(scope="module")
def fmu() -> Path:
    return build(block())


@pytest.fixture(scope="module")
def vector() -> Path:
    solver = SemiImplicitEuler(inner_step=FINE, positions=("x",))
    return build(block(3, solver=solver))


@pytest.fixture
def start(fmu: Path, tmp_path: Path) -> Callable[..., FMU2Named]:
    """Return a function that returns an initialized block with its values."""
    count = iter(range(1000))

    def started(inner_step: float = STEPS[-1], **values: float) -> FMU2Named:
        slave = FMU2Named(fmu, tmp_path / str(next(count)))
        for name, value in {"solver.inner_step": inner_step, **values}.items():
            slave.set(name, value)
        slave.initialize()
        return slave

    return started


def after(slave: FMU2Named, stop: float) -> tuple[float, float]:
    """Return speed and position at `stop`, by steps of 1/8 s."""
    slave.run(stop, 0.125)
    found = slave.get("v"), slave.get("x")
    slave.freeInstance()
    return found


def orders(errors: list[float]) -> list[float]:
    """Return the order of convergence between each two steps, of which one is half the other."""
    return [math.log2(a / b) for a, b in pairwise(errors)]


# Sticking


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_it_stands_at_exactly_zero_up_to_the_limit_and_departs_above(start, way: float) -> None:
    """At the limit itself it stands; the next number above moves it."""
    standing = start(force=4.0 * way)
    assert after(standing, 4.0) == (0.0, 0.0)
    moved = after(start(force=math.nextafter(4.0, 5.0) * way), 4.0)
    assert way * moved[0] > 0.0
    # Constant acceleration: the speed is exact, the position ends half a step further.
    v, x = after(start(force=6.0 * way), 4.0)
    assert v == pytest.approx(way * 4.0, rel=1e-13)
    assert x == pytest.approx(way * 0.5 * 4.0 * (4.0 + STEPS[-1]), rel=1e-13)


@pytest.mark.parametrize("incline", [0.1, -0.1])
def test_on_an_incline_the_limit_is_that_of_the_sum(start, incline: float) -> None:
    """2 kg on 0.1 are drawn down with 1.962 N, of 4 N that friction can hold."""
    weight = 2.0 * GRAVITY * incline
    for force in (0.0, weight + 3.999, weight - 3.999):
        assert after(start(force=force, incline=incline), 1.0) == (0.0, 0.0)
    for way in (1.0, -1.0):
        v, _ = after(start(force=weight + way * 4.001, incline=incline), 1.0)
        assert v == pytest.approx(way * 0.0005, rel=1e-9)


def test_standing_its_rate_is_zero_and_moving_it_is_the_sum(start) -> None:
    for force, v, rate in ((3.0, 0.0, 0.0), (5.0, 0.0, 0.5), (5.0, 1.0, 0.5), (5.0, -1.0, 4.5)):
        slave = start(force=force, v=v)
        assert slave.get("der(v)") == rate
        slave.freeInstance()


# Motion, against closed forms


def test_a_stop_is_the_analytic_one_with_order_one(start) -> None:
    """v' = −(a + b v): the stop is at t = ln(1 + b v0/a)/b, x = (v0 − a t)/b; then it rests."""
    a, b, v0 = 2.0, 0.25, 10.0
    time = math.log(1.0 + b * v0 / a) / b
    place = (v0 - a * time) / b
    errors = []
    for h in STEPS:
        slave = start(h, dry=2.0 * a, wet=2.0 * b, v=v0)
        n = 0
        while slave.get("v") > 0.0:
            slave.doStep(n * h, h)
            n += 1
        # The scheme's speed errs by h b v0/2 at most, which the stop takes 1/a times as long.
        assert n * h == pytest.approx(time, abs=h * (1.0 + 0.5 * b * v0 / a))
        assert slave.get("v") == 0.0
        stood = slave.get("x")
        errors.append(abs(stood - place))
        slave.doStep(n * h, 100.0)
        assert (slave.get("v"), slave.get("x")) == (0.0, stood)
        slave.freeInstance()
    assert errors[-1] < 0.51 * v0 * STEPS[-1] + v0 * b * STEPS[-1]
    assert orders(errors) == pytest.approx([1.0] * 3, abs=0.05)


def test_a_reversal_goes_through_zero_with_order_one(start) -> None:
    """5 m/s against 8 m/s², of which 2 are friction; back with 4 m/s²."""
    turn = 5.0 / 8.0
    way = 0.5 * 5.0 * turn
    errors = []
    for h in STEPS:
        v, x = after(start(h, force=-12.0, v=5.0), 3.0)
        assert v == pytest.approx(-4.0 * (3.0 - turn), abs=8.0 * h)
        errors.append(abs(x - (way - 2.0 * (3.0 - turn) ** 2)))
    assert errors[-1] < 20.0 * STEPS[-1]
    assert orders(errors) == pytest.approx([1.0] * 3, abs=0.1)


def test_on_a_spring_each_swing_loses_twice_the_dead_band(start) -> None:
    """Dead band ±dry/k = ±0.08 m: from 1 m it comes to rest at 1 − 2·6·0.08 = 0.04 m."""
    errors = []
    for h in STEPS:
        v, x = after(start(h, spring=50.0, x=1.0), 10.0)
        assert v == 0.0
        errors.append(abs(x - 0.04))
    # The swings' lengths err by less than the first order, since the scheme is symplectic.
    assert errors[-1] < 0.2 * STEPS[-1]
    assert min(orders(errors)) > 0.9


def test_a_limit_below_zero_counts_as_zero(start) -> None:
    v, _ = after(start(dry=-4.0, force=1.0), 2.0)
    assert v == pytest.approx(1.0, rel=1e-14)


def test_a_vector_is_its_elements_one_by_one(start, vector: Path, tmp_path: Path) -> None:
    values = {
        "v": (2.0, 0.0, -3.0), "x": (0.0, 0.5, 0.01), "force": (-1.0, 5.0, 9.0),
        "dry": (4.0, 1.0, 0.0), "spring": (0.0, 20.0, 3.0), "mass": (1.0, 2.0, 3.0),
    }  # fmt: skip
    whole = FMU2Named(vector, tmp_path / "vector")
    for name, column in values.items():
        for i, value in enumerate(column, 1):
            whole.set(f"{name}[{i}]", value)
    whole.initialize()
    whole.run(3.0, 0.125)
    for i in range(3):
        one = start(FINE, **{name: column[i] for name, column in values.items()})
        assert after(one, 3.0) == (whole.get(f"v[{i + 1}]"), whole.get(f"x[{i + 1}]"))
    whole.freeInstance()


# What is refused


def declare(statement: Callable[[Plant, Any, Any], object], **options: Any) -> Plant:
    with Plant("cart", **options) as plant:
        plant.input("force", unit="N")
        v = plant.state("v", unit="m/s", output=True)
        x = plant.state("x", unit="m", size=2)
        plant.der(v, 0.0)
        plant.der(x, v)
        statement(plant, v, x)
    return plant


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        (lambda p, v, x: p.friction(x, 1.0), "'x' has dry friction, so it is no position"),
        (lambda p, v, x: (p.friction(v, 1.0), p.friction(v, 2.0)), r"friction\(v\) is given twice"),
        (lambda p, v, x: p.friction(p.variables("input")[0].symbol, 1.0), "not input 'force'"),
        (lambda p, v, x: p.friction(3.0, 1.0), r"friction\(\) needs a declared state"),
        (lambda p, v, x: p.friction(v, x), r"friction\(v\)"),
        (lambda p, v, x: p.friction(v, "much"), "not a CasADi MX expression"),
        (lambda p, v, x: p.friction(v, math.nan), "NaN"),
    ],
)
def test_a_mistake_is_named(statement: Any, message: str) -> None:
    with pytest.raises(DeclarationError, match=message) as caught:
        declare(statement, solver=SemiImplicitEuler(positions=("x",)))
    assert "plant 'cart'" in str(caught.value)


@pytest.mark.parametrize("solver", [None, RungeKutta4(), DormandPrince(), Rodas()])
def test_other_solvers_are_refused_with_the_remedy(solver: Any) -> None:
    """When the plant is declared with one, and when its FMU is to have one."""
    message = r"plant '\w+': dry friction\(v\) needs the solver SemiImplicitEuler\(…\)"
    with pytest.raises(DeclarationError, match=message):
        declare(lambda p, v, x: p.friction(v, 1.0), solver=solver)
    if solver is not None:
        with pytest.raises(DeclarationError, match=message):
            build(block(), solver=solver)


def test_a_finished_plant_takes_no_friction() -> None:
    plant = block()
    with pytest.raises(DeclarationError, match="block"):
        plant.friction(plant.variables("state")[0].symbol, 1.0)


def test_there_is_no_model_exchange(fmu: Path, tmp_path: Path) -> None:
    description: Any = read_model_description(str(fmu))
    assert description.modelExchange is None
    extract(str(fmu), str(tmp_path))
    slave = FMU2Model(
        guid=description.guid, modelIdentifier="block", unzipDirectory=str(tmp_path),
        instanceName="slave",
    )  # fmt: skip
    number, log = open_log()
    with pytest.raises(Exception, match="instantiate"):
        slave.instantiate(callbacks=callbacks(number))
    close_log(number)
    assert "this model has dry friction, which only its own solver takes" in log[-1]
    assert "Co-Simulation" in log[-1]


# The FMU around it


def test_a_state_goes_on_with_the_same_bits_here_and_in_another_process(start, fmu: Path) -> None:
    """Saved while it slides, stands and swings; the spring stops it several times."""
    slave = start(spring=50.0, x=1.0, wet=0.3)
    names = [v.name for v in slave.description.modelVariables if v.causality != "independent"]
    generator = np.random.default_rng(3)
    time, cases, expected, standing = 0.0, [], [], 0
    for _ in range(30):
        slave.set("force", float(generator.uniform(-15.0, 15.0)))
        step = float(generator.uniform(0.01, 0.4))
        slave.doStep(time, step)
        time += step
        standing += slave.get("v") == 0.0
        state = slave.getFMUstate()
        ahead = [
            (float(generator.uniform(0.01, 0.4)), {"force": float(generator.uniform(-15.0, 15.0))})
            for _ in range(3)
        ]
        data = slave.serializeFMUstate(state)
        expected.append(continued(slave, time, ahead, names))
        slave.setFMUstate(state)
        assert continued(slave, time, ahead, names) == expected[-1]
        slave.setFMUstate(state)
        slave.freeFMUstate(state)
        cases.append({"state": bytes(data).hex(), "time": time, "inputs": ahead})
    assert 0 < standing < 30
    slave.freeInstance()
    job = json.dumps({"fmu": str(fmu), "cases": cases, "names": names})
    done = subprocess.run(
        [sys.executable, "-m", "tests.unit.fmus.state_continuation"],
        input=job, capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == expected


@pytest.mark.parametrize("v", [0.7, -0.7])
def test_directional_derivatives_are_finite_differences_away_from_zero(start, v: float) -> None:
    point = {"v": v, "x": 0.3, "spring": 20.0, "wet": 0.5, "force": 2.0, "incline": 0.1}
    middle = start(**point)
    for known in ("v", "x", "force"):
        there, here = (start(**{**point, known: point[known] + way}) for way in (1e-4, -1e-4))
        found = middle.getDirectionalDerivative([middle.vr["der(v)"]], [middle.vr[known]], [1.0])
        expected = (there.get("der(v)") - here.get("der(v)")) / 2e-4
        assert found[0] == pytest.approx(expected, rel=1e-8)
        there.freeInstance()
        here.freeInstance()
    middle.freeInstance()


def test_held_it_does_not_answer_to_the_force_and_beyond_the_limit_it_does(start) -> None:
    slave = start(force=2.0)
    derivative = [slave.vr["der(v)"]], [slave.vr["force"]], [1.0]
    assert slave.getDirectionalDerivative(*derivative) == [0.0]
    slave.set("force", 5.0)
    assert slave.getDirectionalDerivative(*derivative) == [0.5]
    slave.freeInstance()


def test_its_fmu_passes_the_check(vector: Path) -> None:
    """Under random forces, which move the blocks and let them stand."""
    report = check(vector, tolerance=1e-2)
    assert report.passed, str(report)
    assert not report.unchecked, str(report)
    assert "dry friction" in next(f.detail for f in report.findings if f.part == "reference")
