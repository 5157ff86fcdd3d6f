"""The linear map of a diagram against its own runs, and against formulas written down by hand."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import control
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.optimize import brentq

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Gain,
    Hold,
    Ramp,
    Saturation,
    Step,
    Sum,
)
from railcosim.base.errors import DiagramError, FmuError
from railcosim.controllers import PID
from railcosim.cosim.linear.block import LinearBlock, LinearisationError
from railcosim.cosim.linear.linearise import _System
from railcosim.cosim.linear.wiring import wire
from railcosim.fmus import build
from railcosim.models import Plant
from tests import hybrid_plants, plants
from tests.foreign import foreign_fmu

H = 0.05


def speed_loop(fmu: Path, *, delay: Delay | None = None, step: float = H) -> Diagram:
    """A PID that holds the second-order train's speed over a delayed link, from rest."""
    loop = Diagram("speed_hold", step=step)
    loop.add("target", Step(at=5.0, to=1.0, unit="m/s"))
    loop.add("pid", PID(kp=1.2, ti=8.0, td=0.707))
    loop.add("link", delay or Delay(0.4))
    loop.add("train", Fmu(fmu))
    loop.connect("target.y", "pid.reference")
    loop.connect("train.speed", "pid.measurement")
    loop.connect("pid.u", "link.u")
    loop.connect("link.y", "train.u")
    return loop


def linear(diagram: Diagram, at: Any, **options: Any) -> Any:
    """Return the map as Any: python-control declares its matrices as lists."""
    return diagram.linearise(at, **options)


def root(function: Any, low: float, high: float) -> float:
    found: Any = brentq(function, low, high, xtol=1e-14)
    return found


def response(system: Any, w: np.ndarray) -> np.ndarray:
    """Return the outputs, one row each, by the recursion itself."""
    x, rows = np.zeros(system.nstates), []
    for value in w:
        rows.append(system.C @ x + system.D[:, 0] * value)
        x = system.A @ x + system.B[:, 0] * value
    return np.array(rows).T


def largest_gap(diagram: Diagram, at: float, stop: float, source: str = "target.y") -> float:
    """Compare all signals of a linear diagram from rest at `at` on, at every dt of the map."""
    system = linear(diagram, at, inputs=[source])
    run = diagram.run(stop)
    every = round(system.dt / float(diagram.step))
    rows = slice(round(at / float(diagram.step)), None, every)
    found = response(system, run[source][rows])
    names = [label.replace("/", ".") for label in system.output_labels]
    assert names == list(run.columns)
    gap = 0.0
    for name, row in zip(names, found, strict=True):
        assert run[name][0] == 0.0
        gap = max(gap, float(np.max(np.abs(row - run[name][rows]))))
    return gap


# Linear diagrams: the map is exact, so whole trajectories agree


@pytest.mark.parametrize(
    "delay",
    [
        Delay(0.4), Delay(0.0), Delay(0.02), Delay(0.07), Delay(0.05), Delay(0.333),
        Delay(0.02, interpolation="hold"), Delay(0.13, interpolation="hold"),
    ],
    ids=str,
)  # fmt: skip
def test_the_closed_loop_responds_as_the_diagram_runs(train_fmu: Path, delay: Delay) -> None:
    assert largest_gap(speed_loop(train_fmu, delay=delay), 4.0, 30.0) < 1e-12


def test_pythoncontrol_agrees_with_the_run(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu)
    system = linear(loop, 4.0, outputs=["train.speed"])
    assert system.dt == H
    w: Any = loop.run(30.0)["target.y"][80:]
    found = control.forced_response(system, np.arange(len(w)) * H, w).outputs
    assert found == pytest.approx(loop.run(30.0)["train.speed"][80:], abs=1e-12)


def test_several_rates_repeat_after_the_common_multiple(train_fmu: Path) -> None:
    """PID every 5 steps, FMU every 2: the map over 10, at whose multiples the reference steps."""
    loop = Diagram("rates", step=0.01)
    loop.add("target", Step(at=5.0, to=1.0, unit="m/s"))
    loop.add("pid", PID(kp=1.2, ti=8.0, td=0.707))
    loop.add("link", Delay(0.127))
    loop.add("train", Fmu(train_fmu, period=0.02))
    loop.add("hold", Hold(0.1))
    loop.connect("target.y", "pid.reference")
    loop.connect("train.speed", "pid.measurement")
    loop.connect("pid.u", "link.u")
    loop.connect("link.y", "train.u")
    loop.connect("train.acceleration", "hold.u")
    assert linear(loop, 4.0).dt == 0.1
    assert largest_gap(loop, 4.0, 15.0) < 1e-12


def test_an_fmu_with_feedthrough_shows_the_input_of_the_step_before() -> None:
    """Its output is 2 u of the step before, so the loop z = −0.3 holds: y⁺ = 2 · 0.25 (w − y)."""
    loop = Diagram("passing", step=0.1)
    loop.add("target", Step(at=0.5))
    loop.add("error", Sum("+-"))
    loop.add("gain", Gain(0.25))
    loop.add("plant", Fmu(build(plants.passing("passing"))))
    loop.connect("target.y", "error.u1")
    loop.connect("plant.y", "error.u2")
    loop.connect("error.y", "gain.u")
    loop.connect("gain.y", "plant.u")
    system = linear(loop, 0.2)
    assert "plant.u held" in system.state_labels
    assert np.sort(system.poles().real) == pytest.approx([-0.5, math.exp(-0.1)], abs=1e-15)
    assert largest_gap(loop, 0.2, 2.0) < 1e-15


@dataclass(frozen=True)
class Random(Block):
    """A random stable linear block with two inputs and two outputs, with or without feedthrough."""

    seed: int
    feedthrough: bool = True
    period: float | None = None
    inputs = {"a": "1", "b": "1"}
    outputs = {"p": "1", "q": "1"}

    def start(self) -> Any:
        return 0, (0.0, 0.0)

    def matrices(self) -> list[np.ndarray]:
        generator = np.random.default_rng(self.seed)
        return [generator.uniform(-0.3, 0.3, (rows, 3)) for rows in (3, 3, 2, 2)]

    def output(self, x: Any, *u: float) -> Any:
        _, _, C, D = self.matrices()
        y = C @ [x[0], *x[1]] + (D[:, :2] @ u if u else 0.0)
        return tuple(y.tolist())

    def update(self, x: Any, *u: float) -> Any:
        A, B, _, _ = self.matrices()
        first, *others = (A @ [x[0], *x[1]] + B[:, :2] @ u).tolist()
        return first, tuple(others)

    def step(self, x: Any, *u: float) -> Any:
        return self.output(x, *u), self.update(x, *u)


@pytest.mark.parametrize("seed", range(12))
def test_random_linear_diagrams(seed: int, train_fmu: Path) -> None:
    """Blocks of several rates, with and without feedthrough, delays and an FMU, wired at random."""
    generator = np.random.default_rng(seed)
    diagram = Diagram("random", step=0.1)
    diagram.add("target", Step(at=1.2))
    periods = [None, 0.1, 0.2, 0.4] if seed % 2 else [None]
    signals = ["target.y"]
    later = []  # what may read any signal, as it gives its own before
    for i in range(5):
        name, feedthrough = f"b{i}", bool(generator.integers(2))
        period = periods[generator.integers(len(periods))]
        diagram.add(name, Random(100 * seed + i, feedthrough, period))
        delay = Delay(float(generator.choice([0.1, 0.13, 0.25, 0.3])))
        diagram.add(f"d{i}", delay)
        for port in ("a", "b"):
            if feedthrough:
                diagram.connect(str(generator.choice(signals)), f"{name}.{port}")
            else:
                later.append(f"{name}.{port}")
        later.append(f"d{i}.u")
        signals += [f"{name}.p", f"{name}.q", f"d{i}.y"]
    diagram.add("train", Fmu(train_fmu, period=periods[-1]))
    diagram.add("speed", Gain(1.0, input_unit="m/s", unit="1"))
    diagram.connect("train.speed", "speed.u")
    signals.append("speed.y")
    for port in (*later, "train.u"):
        diagram.connect(str(generator.choice(signals)), port)
    assert largest_gap(diagram, 0.4, 4.0) < 1e-12


# Open loops


def loop_transfer(w: float, *, delay: int = 8) -> complex:
    """K(z) G(z) z^−d at e^(jωh), from the controller's and the train's own formulas."""
    z = np.exp(1j * w * H)
    wn, zeta, gain = 0.18, 1.21, 2.2
    A = np.array([[0.0, 1.0], [-wn * wn, -2.0 * zeta * wn]])
    moved = expm(np.block([[A, np.array([[0.0], [wn * wn * gain]])], [np.zeros((1, 3))]]) * H)
    G = np.linalg.solve(z * np.eye(2) - moved[:2, :2], moved[:2, 2])[0]
    kp, ti, td = 1.2, 8.0, 0.707
    tf = td / 10.0
    K = kp * (1.0 + H / ti * z / (z - 1.0) + td * (z - 1.0) / ((tf + H) * z - tf))
    return K * G * z**-delay


@pytest.mark.parametrize("port", ["pid.u", "link.u", "link.y", "train.u", "train.speed"])
def test_the_loop_transfer_function_wherever_it_is_cut(train_fmu: Path, port: str) -> None:
    L = linear(speed_loop(train_fmu), 4.0, open_at=port)
    assert (L.input_labels, L.ninputs, L.noutputs) == ([port.replace(".", "/")], 1, 1)
    for w in (0.05, 0.2, 1.0, 3.0, 10.0, 50.0):
        assert L(np.exp(1j * w * H)) == pytest.approx(loop_transfer(w), rel=1e-9)


def test_margins_against_the_formulas(train_fmu: Path) -> None:
    crossover = root(lambda w: abs(loop_transfer(w)) - 1.0, 0.05, 1.0)
    turnover = root(lambda w: loop_transfer(w).imag, 1.0, 3.5)
    L = linear(speed_loop(train_fmu), 4.0, open_at="pid.u")
    gain, phase, w180, wc = control.margin(control.frequency_response(L))
    assert gain == pytest.approx(1.0 / abs(loop_transfer(turnover)), rel=1e-6)
    expected = 180.0 + math.degrees(np.angle(loop_transfer(crossover)))
    assert phase == pytest.approx(expected, rel=1e-6)
    assert (w180, wc) == pytest.approx((turnover, crossover), rel=1e-6)


def test_the_loop_closed_again_is_the_closed_loop(train_fmu: Path) -> None:
    for loop, port in (
        (speed_loop(train_fmu), "train.speed"),
        (speed_loop(train_fmu, step=0.01, delay=Delay(0.127)), "pid.u"),
        (speed_loop(train_fmu, step=0.01, delay=Delay(0.127)), "pid.measurement"),
    ):
        closed: Any = control.feedback(linear(loop, 4.0, open_at=port))
        poles = linear(loop, 4.0).poles()
        assert np.poly(closed.poles()) == pytest.approx(np.poly(poles), abs=1e-9)


def test_with_inputs_and_outputs_a_cut_leaves_the_plant_alone(train_fmu: Path) -> None:
    options = {"inputs": ["link.u"], "outputs": ["train.speed"], "open_at": "pid.u"}
    plant = linear(speed_loop(train_fmu), 4.0, **options)
    z = np.exp(0.3j * H)
    kp, ti, td = 1.2, 8.0, 0.707
    K = kp * (1.0 + H / ti * z / (z - 1.0) + td * (z - 1.0) / ((td / 10.0 + H) * z - td / 10.0))
    assert plant(z) == pytest.approx(loop_transfer(0.3) / K, rel=1e-9)
    assert plant.dcgain() == pytest.approx(2.2, rel=1e-12)
    links = [f"link.u[k-{k}]" for k in range(1, 9)]
    assert sorted(plant.state_labels) == [*links, "train.acceleration", "train.speed"]
    nothing = linear(speed_loop(train_fmu), 4.0, inputs="target.y", outputs="train.speed",
                     open_at="pid.u")  # fmt: skip
    assert (nothing.nstates, nothing.D.tolist()) == (0, [[0.0]])


def test_a_cut_that_passes_several_values_in_a_step_is_refused(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu, step=0.01)
    with pytest.raises(LinearisationError) as caught:
        linear(loop, 4.0, open_at="train.u")
    assert str(caught.value) == (
        "open_at = 'train.u' passes several values in the 0.05 s after which 'speed_hold' repeats "
        "itself; cut at pid.reference, pid.measurement, pid.u"
    )


def test_nothing_reads_the_cut(train_fmu: Path) -> None:
    with pytest.raises(DiagramError, match=r"open_at = 'train\.acceleration': nothing reads it"):
        linear(speed_loop(train_fmu), 4.0, open_at="train.acceleration")


@pytest.mark.parametrize("time", [1.0, 0.4, 0.05])
def test_the_stability_boundary_of_a_delayed_integrator(time: float) -> None:
    """x' = −K x(t − T), held: on the unit circle at K = (2/h) sin(π / (2 (2d + 1)))."""
    d = round(time / H)
    boundary = 2.0 / H * math.sin(math.pi / (2 * (2 * d + 1)))
    if time == 1.0:
        assert boundary == pytest.approx(1.5321, abs=5e-5)

    def radius(k: float) -> float:
        loop = Diagram("delayed", step=H)
        loop.add("gain", Gain(-k, input_unit="1", unit="1/s"))
        loop.add("link", Delay(time))
        loop.add("plant", Fmu(build(plants.integrator())))
        loop.connect("plant.x", "gain.u")
        loop.connect("gain.y", "link.u")
        loop.connect("link.y", "plant.u")
        return float(np.max(np.abs(linear(loop, 0.0).poles())))

    found = root(lambda k: radius(k) - 1.0, 0.9 * boundary, 1.1 * boundary)
    assert found == pytest.approx(boundary, rel=1e-9)


# Nonlinear plants: the operating point matters


def driven_pendulum() -> Plant:
    """Angle and rate of a damped pendulum under a torque that acts through cos(angle)."""
    with Plant("driven_pendulum", stop=5.0) as plant:
        u = plant.input("u", unit="N.m")
        angle = plant.state("angle", unit="rad", start=0.4, output=True)
        rate = plant.state("rate", unit="rad/s", start=1.0, output=True)
        plant.der(angle, rate)
        plant.der(rate, -9.81 * ca.sin(angle) - 0.1 * rate * rate + u * ca.cos(angle))
        plant.output("height", 1.0 - ca.cos(angle) + 0.3 * u * rate, unit="m")
    return plant


def test_a_nonlinear_plant_on_its_way_against_its_jacobians() -> None:
    diagram = Diagram("pendulum", step=H)
    diagram.add("torque", Ramp(slope=0.5, initial=1.0, unit="N.m"))
    diagram.add("plant", Fmu(build(driven_pendulum())))
    diagram.connect("torque.y", "plant.u")
    system = linear(diagram, 1.0, outputs=["plant.angle", "plant.height"])
    run = diagram.run(1.0)
    angle, rate, u = run["plant.angle"][-1], run["plant.rate"][-1], run["torque.y"][-2]
    A = np.array([[0.0, 1.0], [-9.81 * np.cos(angle) - u * np.sin(angle), -0.2 * rate]])
    moved = expm(np.block([[A, np.array([[0.0], [np.cos(angle)]])], [np.zeros((1, 3))]]) * H)
    assert system.state_labels == ["plant.angle", "plant.rate", "plant.u held"]
    assert_allclose(system.A[:2, :2], moved[:2, :2], rtol=1e-12)
    assert_allclose(system.B[:, 0], [moved[0, 2], moved[1, 2], 1.0], rtol=1e-12)
    assert system.A[2].tolist() == [0.0, 0.0, 0.0]
    C = [[1.0, 0.0, 0.0], [np.sin(angle), 0.3 * u, 0.3 * rate]]
    assert_allclose(system.C, C, rtol=1e-12)
    assert not system.D.any()


def drag_loop(target: float, *, extra: float = 0.0) -> Diagram:
    """A PI that holds a vehicle with quadratic drag at a speed; `extra` is added at 400 s."""
    with Plant("dragged") as plant:
        u = plant.input("u", unit="1")
        v = plant.state("speed", unit="m/s", output=True)
        plant.der(v, u - 0.002 * v * ca.fabs(v))
    loop = Diagram("drag", step=0.1)
    loop.add("target", Step(at=400.0, before=target, to=target + extra, unit="m/s"))
    loop.add("pi", PID(kp=0.5, ti=10.0, td=0.0, period=0.1))
    loop.add("vehicle", Fmu(build(plant)))
    loop.connect("target.y", "pi.reference")
    loop.connect("vehicle.speed", "pi.measurement")
    loop.connect("pi.u", "vehicle.u")
    return loop


def test_drag_is_another_at_another_speed() -> None:
    for speed in (10.0, 40.0):
        system = linear(drag_loop(speed), 399.9, open_at="pi.u")
        pole = math.exp(-2.0 * 0.002 * speed * 0.1)
        assert np.min(np.abs(system.poles() - pole)) < 1e-7


def test_a_small_step_of_a_nonlinear_loop() -> None:
    """The difference of two runs, over the size of the step between them."""
    system = linear(drag_loop(30.0), 399.9, outputs=["vehicle.speed", "pi.u"])
    extra = 1e-4
    base, moved = (drag_loop(30.0, extra=e).run(440.0) for e in (0.0, extra))
    w = (moved["target.y"] - base["target.y"])[3999:] / extra
    for name, row in zip(("vehicle.speed", "pi.u"), response(system, w), strict=True):
        difference = (moved[name] - base[name])[3999:] / extra
        assert np.max(np.abs(row - difference)) < 1e-5


# What small changes do not pass


def test_an_fmu_without_states_and_derivatives_is_refused_by_name(tmp_path: Path) -> None:
    diagram = Diagram("foreign", step=0.1)
    diagram.add("lag", Fmu(foreign_fmu("filter", tmp_path), u=1.0))
    with pytest.raises(FmuError) as caught:
        linear(diagram, 1.0)
    assert str(caught.value) == (
        "block 'lag': filter.fmu provides no directional derivatives "
        "(providesDirectionalDerivative) and exposes no states and derivatives "
        "(ModelStructure/Derivatives); linearise() needs an FMU that tells its derivatives, or a "
        "Python block in its place"
    )
    declared = foreign_fmu("filter", tmp_path, declares=("providesDirectionalDerivative",))
    diagram = Diagram("foreign", step=0.1)
    diagram.add("lag", Fmu(declared, u=1.0))
    with pytest.raises(FmuError, match=r"'lag': filter\.fmu exposes no states and derivatives"):
        linear(diagram, 1.0)


def test_an_fmu_with_memories_is_refused() -> None:
    diagram = Diagram("gear", step=0.05)
    diagram.add("gear", Fmu(build(hybrid_plants.draft_gear()), rate=0.01))
    with pytest.raises(FmuError, match=r"'gear': draft_gear\.fmu has memories \(last_stroke, "):
        linear(diagram, 1.0)


def test_a_derivative_that_is_not_finite_is_told_with_the_fmus_words() -> None:
    with Plant("root") as plant:
        x = plant.state("x", unit="1")
        plant.der(x, 0.0)
        plant.output("y", ca.sqrt(x), unit="1")
    diagram = Diagram("root", step=0.1)
    diagram.add("root", Fmu(build(plant)))
    with pytest.raises(FmuError) as caught:
        linear(diagram, 0.2)
    text = "block 'root': fmi2GetDirectionalDerivative at t = 0.2 s returned fmi2Error: "
    assert str(caught.value).startswith(text)


def test_a_whole_number_at_an_fmu_passes_no_small_change() -> None:
    diagram = Diagram("rigid", step=0.1)
    diagram.add("one", Constant(1.0))
    diagram.add("gain", Gain(1.0))
    diagram.connect("one.y", "gain.u")
    plan = diagram.plan()
    one = LinearBlock(np.eye(0), np.zeros((0, 0)), np.zeros((1, 0)), np.zeros((1, 0)))
    gain = LinearBlock(np.eye(0), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1), rigid=(0,))
    with pytest.raises(LinearisationError, match=r"gain\.u takes whole numbers only, .* of one\.y"):
        _System(plan, [one, gain], [], wire(diagram, plan, None, None, None)).propagated(1)
    alone = wire(diagram, plan, None, None, "gain.u")
    assert _System(plan, [one, gain], [], replace(alone, returns=False)).propagated(1)[
        1
    ].tolist() == [[0.0]]


def test_modes_stay_as_they_are() -> None:
    """Whether a ball flies or lies still, small changes of its height and speed only go on."""
    diagram = Diagram("ball", step=0.1)
    diagram.add("ball", Fmu(build(hybrid_plants.ball(rest=1.0))))
    assert diagram.run(5.0)["ball.lying"][-1] == 1
    for at in (0.1, 5.0):
        system = linear(diagram, at, outputs=["ball.height"])
        assert_allclose(system.A, [[1.0, 0.1], [0.0, 1.0]], rtol=1e-15)


def test_a_controller_at_its_limit_and_deep_behind_it(train_fmu: Path) -> None:
    def loop(target: float) -> Diagram:
        diagram = Diagram("limits", step=0.1)
        diagram.add("target", Constant(target))
        diagram.add("limit", Saturation((-1.0, 1.0)))
        diagram.add("train", Fmu(train_fmu))
        diagram.connect("target.y", "limit.u")
        diagram.connect("limit.y", "train.u")
        return diagram

    with pytest.raises(LinearisationError, match=r"block 'limit' .* where input 'u' is 1 \(slope"):
        linear(loop(1.0), 1.0)
    for target, passes in ((0.999, True), (1.5, False)):
        system = linear(loop(target), 1.0, outputs=["train.speed"])
        assert system.B.any() == passes


def test_the_first_sample_of_a_pid_is_not_taken_for_the_others(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu)
    with pytest.raises(LinearisationError, match="'pid' at t = 0 s does something else at its nex"):
        linear(loop, 0.0)
    first = linear(loop, H)
    assert_allclose(first.A, linear(loop, 4.0).A, atol=1e-12)


# What is asked for


def test_a_disturbance_at_an_input_is_that_of_a_sum_block(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu, delay=Delay(0.07))
    found = linear(loop, 4.0, inputs=["train.u", "pid.u"], outputs=["train.speed", "link.y"])
    longer = Diagram("longer", step=H)
    for name, block in loop.blocks.items():
        longer.add(name, block)
    longer.add("wind", Step(at=5.0))
    longer.add("sum", Sum("++"))
    for target, source in loop.connections.items():
        if str(target) != "train.u":
            longer.connect(str(source), str(target))
    longer.connect("link.y", "sum.u1")
    longer.connect("wind.y", "sum.u2")
    longer.connect("sum.y", "train.u")
    other = linear(longer, 4.0, inputs=["wind.y"], outputs=["train.speed", "link.y"])
    z = np.exp(0.4j * H)
    assert found(z)[:, 0] == pytest.approx(other(z)[:, 0], rel=1e-12)
    # A disturbance at an output is seen by all that read it: here by the link alone.
    same = linear(loop, 4.0, inputs="link.u", outputs=["train.speed", "link.y"])
    assert found(z)[:, 1] == pytest.approx(same(z)[:, 0], rel=1e-12)


def test_names_and_shapes(train_fmu: Path) -> None:
    system = speed_loop(train_fmu, delay=Delay(0.1)).linearise(4.0)
    assert isinstance(system, control.StateSpace)
    assert (system.name, system.dt) == ("speed_hold", H)
    assert system.input_labels == ["target/y"]
    assert sorted(system.output_labels) == sorted(
        ["target/y", "pid/u", "link/y", "train/speed", "train/acceleration"]
    )
    assert sorted(system.state_labels) == [
        "link.u[k-1]", "link.u[k-2]", "pid.x[0]", "pid.x[1]", "pid.x[2]", "pid.x[3]",
        "train.acceleration", "train.speed",
    ]  # fmt: skip
    speed = system["train/speed", "target/y"]
    assert speed.dcgain() == pytest.approx(1.0)


def test_another_start(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu)
    later = linear(loop, 14.0, start=10.0)
    assert_allclose(later.A, linear(loop, 4.0).A, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"at": "now"}, "at must be a time in s, not 'now'"),
        ({"at": -1.0}, r"at = -1 s lies before start = 0 s"),
        ({"at": 1.02}, r"at = 1\.02 s is no whole number of steps of 0\.05 s; nearest: 1 or 1\.05"),
        ({"inputs": ["pid.ref"]}, "block 'pid' has no input 'ref'; inputs: reference"),
        ({"inputs": ["pid"]}, "'pid' is not spelled block.port"),
        ({"inputs": [3]}, "3 is not spelled block.port"),
        ({"outputs": ["train.u"]}, r"no output 'u' \('u' is the other way round\)"),
        ({"inputs": []}, "inputs is empty"),
        ({"outputs": []}, "outputs is empty"),
        ({"outputs": ["train.speed", "train.speed"]}, "one is named twice"),
        ({"open_at": "pod.u"}, "no block 'pod'"),
    ],
)
def test_wrong_arguments(train_fmu: Path, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(DiagramError, match=message):
        linear(speed_loop(train_fmu), **{"at": 4.0, **arguments})


def test_several_rates_have_common_hits(train_fmu: Path) -> None:
    with pytest.raises(DiagramError, match=r"at = 4\.01 s is no whole number of steps of 0\.05 s"):
        linear(speed_loop(train_fmu, step=0.01), 4.01)


def test_the_diagram_is_as_it_was_and_runs_the_same(train_fmu: Path) -> None:
    loop = speed_loop(train_fmu)
    before = loop.run(8.0).values.tobytes()
    first, second = (linear(loop, 6.0) for _ in range(2))
    assert first.A.tobytes() == second.A.tobytes()
    assert loop.run(8.0).values.tobytes() == before
