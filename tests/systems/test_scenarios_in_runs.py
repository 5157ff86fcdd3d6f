"""Scenarios through whole runs, against numbers written down from their definitions."""

from pathlib import Path
from typing import Any

import pytest

from railcosim import (
    Bias,
    Checkpoint,
    Constant,
    Delay,
    Diagram,
    DropOut,
    Fmu,
    Freeze,
    Gain,
    GaussSeidel,
    Hold,
    Iterated,
    Jacobi,
    Newton,
    Noise,
    Override,
    Ramp,
    Recording,
    Scenario,
    SetDelay,
    SetParameter,
    Step,
    StepDoubling,
    Sum,
    TwoPhase,
)
from railcosim.base.errors import AlgebraicLoopError, CheckpointError
from railcosim.fmus import build
from railcosim.models import Plant
from tests import coupled_plants

STEP = 0.1
LINES = [TwoPhase(extrapolation=1), GaussSeidel(extrapolation=1), Iterated(extrapolation=1)]
ALGORITHMS = [TwoPhase(), Jacobi(), GaussSeidel(), Iterated(), StepDoubling(), *LINES]
ENGINES = ["python", "compiled"]


def named(value: Any) -> str:
    """Return a short name for a test of it."""
    return f"{type(value).__name__}{getattr(value, 'extrapolation', '')}"


with_every_algorithm = pytest.mark.parametrize("algorithm", ALGORITHMS, ids=named)
in_both_engines = pytest.mark.parametrize("engine", ENGINES)


def integrator() -> Plant:
    """x' = u, all of unit 1, so that one can drive another."""
    with Plant("pure_integrator") as plant:
        u = plant.input("u", unit="1")
        x = plant.state("x", unit="1", output=True)
        plant.der(x, u)
    return plant


def integrators() -> Diagram:
    """i.x = t, and j.x its integral."""
    fmu = build(integrator())
    diagram = Diagram("integrators", step=STEP)
    diagram.add("one", Constant(1.0))
    diagram.add("i", Fmu(fmu))
    diagram.add("j", Fmu(fmu))
    diagram.connect("one.y", "i.u")
    diagram.connect("i.x", "j.u")
    return diagram


def sampled() -> Diagram:
    """A ramp from 5, sampled and held, and read by a gain."""
    diagram = Diagram("sampled", step=STEP)
    diagram.add("ramp", Ramp(slope=1.0, initial=5.0))
    diagram.add("hold", Hold(0.5))
    diagram.add("reader", Gain(1.0))
    diagram.connect("ramp.y", "hold.u")
    diagram.connect("hold.y", "reader.u")
    return diagram


# A port of a slower block: the fault acts at the base step's ticks, also between the hits.

HELD = [5.0] * 5 + [5.5] * 5 + [6.0]  # ticks 0 … 10, hits at 0, 5 and 10
HELD_LATE = [5.0] * 5 + [5.0] * 5 + [5.5]  # Jacobi: what is taken at a hit shows at the next
SLOW_FAULTS = {  # what the port shows from 0.2 s until 0.7 s, the ticks 2 … 6
    Bias("hold.y", 100.0, at=0.2, until=0.7): lambda y: y + 100.0,
    Override("hold.y", -1.0, at=0.2, until=0.7): lambda y: -1.0,
    Freeze("hold.y", at=0.2, until=0.7): lambda y: 5.0,
    DropOut("hold.y", "last", at=0.2, until=0.7): lambda y: 5.0,
}


@in_both_engines
@pytest.mark.parametrize("fault", SLOW_FAULTS, ids=named)
def test_on_the_port_of_a_slower_block(fault: Any, engine: str) -> None:
    """Under Jacobi the block comes a hit late and its reader a tick late; the fault does not."""
    for algorithm, plain in ((TwoPhase(), HELD), (Jacobi(), HELD_LATE)):
        scenario = Scenario([fault])
        run = sampled().run(1.0, algorithm=algorithm, scenario=scenario, engine=engine)
        expected = [SLOW_FAULTS[fault](y) if 2 <= k < 7 else y for k, y in enumerate(plain)]
        late = algorithm == Jacobi()
        assert run["hold.y"] == pytest.approx(expected, abs=1e-12)
        assert run["reader.y"][late:].tolist() == run["hold.y"][: 11 - late].tolist()


@in_both_engines
@pytest.mark.parametrize("port", ["hold.u", "ramp.y"])
def test_before_a_slower_block(port: str, engine: str) -> None:
    """The hold takes a sample at its hit at 0.5 s alone. A fault at its input is not recorded."""
    for algorithm, expected in (
        (TwoPhase(), [5.0] * 5 + [105.5] * 5 + [6.0]),
        (Jacobi(), [5.0] * 5 + [5.0] * 5 + [105.5]),
    ):
        scenario = Scenario([Bias(port, 100.0, at=0.2, until=0.7)])
        run = sampled().run(1.0, algorithm=algorithm, scenario=scenario, engine=engine)
        assert run["hold.y"] == pytest.approx(expected, abs=1e-12)
        shown = [5.0 + k / 10 + 100.0 * (port == "ramp.y" and 2 <= k < 7) for k in range(11)]
        assert run["ramp.y"] == pytest.approx(shown, abs=1e-12)


@in_both_engines
def test_on_a_slow_fmu_and_on_noise_with_a_period(engine: str) -> None:
    diagram = Diagram("slow", step=STEP)
    diagram.add("one", Constant(1.0))
    diagram.add("slow", Fmu(build(integrator()), period=0.3))
    diagram.add("noise", Noise(seed=1, period=0.3))
    diagram.connect("one.y", "slow.u")
    plain = diagram.run(0.9, engine=engine)
    scenario = Scenario([Bias(p, 8.0, at=0.1, until=0.5) for p in ("slow.x", "noise.y")])
    run = diagram.run(0.9, scenario=scenario, engine=engine)
    expected = [0.0, 8.0, 8.0, 8.3, 8.3, 0.3, 0.6, 0.6, 0.6, 0.9]
    assert run["slow.x"] == pytest.approx(expected, abs=1e-12)
    added = [8.0 * (1 <= k < 5) for k in range(10)]
    assert run["noise.y"] - plain["noise.y"] == pytest.approx(added, abs=1e-12)


@in_both_engines
@pytest.mark.parametrize("algorithm", LINES, ids=named)
def test_lines_go_on_when_a_fault_ends(algorithm: Any, engine: str) -> None:
    """i.x = t is a line, so that what j adds up in a step is exact; the bias adds 5 · 0.1."""
    scenario = Scenario([Bias("j.u", 5.0, at=0.2, until=0.5)])
    run = integrators().run(1.0, algorithm=algorithm, scenario=scenario, engine=engine)
    added = run["j.x"][2:] - run["j.x"][1:-1]  # nothing is known of a line in the first step
    expected = [0.1 * (k / 10 + 0.05) + 0.5 * (2 <= k < 5) for k in range(1, 10)]
    assert added == pytest.approx(expected, abs=1e-12)


@in_both_engines
@with_every_algorithm
def test_a_bias_of_nothing_changes_nothing(algorithm: Any, engine: str) -> None:
    """With a feedthrough between the FMUs, so that the coupling is all that matters."""
    diagram = Diagram("oscillator", step=0.01)
    diagram.add("a", Fmu(build(coupled_plants.driven_mass()), x=1.0))
    diagram.add("b", Fmu(build(coupled_plants.sprung_mass())))
    for source, target in (("b.force", "a.force"), ("a.x", "b.far"), ("a.v", "b.far_speed")):
        diagram.connect(source, target)
    plain = diagram.run(0.4, algorithm=algorithm, engine=engine)
    for port in ("a.x", "b.far", "b.force", "a.force"):
        scenario = Scenario([Bias(port, 0.0, at=0.1, until=0.2)])
        run = diagram.run(0.4, algorithm=algorithm, scenario=scenario, engine=engine)
        assert run["a.x"] == pytest.approx(plain["a.x"], abs=1e-12)
        assert run["b.force"] == pytest.approx(plain["b.force"], abs=1e-9)


FROZEN = Freeze("i.x", at=0.2, until=0.5)
HOLDING = {  # what j is given, from 0.2 s until 0.5 s; its steps are 0.1 of that
    "Freeze": ([FROZEN], [0.2, 0.2, 0.2]),
    "Freeze an input": ([Freeze("j.u", at=0.2, until=0.5)], [0.2, 0.2, 0.2]),
    "DropOut": ([DropOut("i.x", "last", at=0.2, until=0.5)], [0.1, 0.1, 0.1]),
    "Two": ([FROZEN, Bias("i.x", 1.0, at=0.3, until=0.4)], [0.2, 1.2, 0.2]),
    "Override": ([Override("i.x", 3.0, at=0.2, until=0.5)], [3.0, 3.0, 3.0]),
}


@in_both_engines
@with_every_algorithm
@pytest.mark.parametrize(("changes", "seen"), HOLDING.values(), ids=list(HOLDING))
def test_what_an_fmu_adds_up_of_a_held_value(changes: Any, seen: Any, algorithm: Any, engine: str):
    scenario = Scenario(changes)
    run = integrators().run(0.8, algorithm=algorithm, scenario=scenario, engine=engine)
    added = run["j.x"][3:6] - run["j.x"][2:5]
    assert added == pytest.approx([0.1 * value for value in seen], abs=1e-12)
    shown = seen if changes[0].port == "i.x" else [0.2, 0.3, 0.4]
    assert run["i.x"][2:5] == pytest.approx(shown, abs=1e-12)


@in_both_engines
@with_every_algorithm
@pytest.mark.parametrize(
    ("at", "change", "jump"),
    [
        (10.0, SetParameter("step.at", 0.33, at=0.1), 0.33),
        (0.33, SetParameter("step.at", 0.77, at=0.1), 0.77),
        (0.33, Bias("step.y", 0.0, at=0.1, until=0.9), 0.33),
        (0.33, Bias("i.u", 0.0, at=0.3, until=0.4), 0.33),
    ],
)
def test_a_jump_is_met(at: float, change: Any, jump: float, algorithm: Any, engine: str) -> None:
    diagram = Diagram("jump", step=STEP)
    diagram.add("step", Step(at=at))
    diagram.add("i", Fmu(build(integrator())))
    diagram.connect("step.y", "i.u")
    run = diagram.run(1.0, algorithm=algorithm, scenario=Scenario([change]), engine=engine)
    assert run["i.x"] == pytest.approx([max(0.0, k / 10 - jump) for k in range(11)], abs=1e-12)


@in_both_engines
@pytest.mark.parametrize("algorithm", [TwoPhase(), Jacobi(), GaussSeidel()], ids=named)
def test_a_delay_that_grows_and_shrinks(algorithm: Any, engine: str) -> None:
    """Of the ramp u = t from 0, y(t) = t − T(t), and 0 before anything has been said."""
    diagram = Diagram("link", step=STEP)
    diagram.add("ramp", Ramp())
    diagram.add("link", Delay(0.3))
    diagram.connect("ramp.y", "link.u")
    changes = [SetDelay("link", T, at=at) for T, at in ((1.0, 0.5), (0.2, 2.5), (2.0, 3.0))]
    delays = [0.3] * 5 + [1.0] * 20 + [0.2] * 5 + [2.0] * 31
    run = diagram.run(6.0, algorithm=algorithm, scenario=Scenario(changes), engine=engine)
    expected = [max(0.0, k / 10 - delays[k]) for k in range(61)]
    assert run["link.y"] == pytest.approx(expected, abs=1e-12)


def closed() -> Diagram:
    """s = 1 + s(t − 0.3) / 2."""
    diagram = Diagram("closed", step=STEP)
    diagram.add("one", Constant(1.0))
    diagram.add("sum", Sum("++"))
    diagram.add("half", Gain(0.5))
    diagram.add("link", Delay(0.3))
    ports = {"one.y": "sum.u1", "link.y": "sum.u2", "sum.y": "half.u", "half.y": "link.u"}
    for source, target in ports.items():
        diagram.connect(source, target)
    return diagram


@in_both_engines
def test_a_loop_of_a_changes_making_is_refused(tmp_path: Path, engine: str) -> None:
    scenario = Scenario([SetDelay("link", 0.0, at=0.5)])
    with pytest.raises(AlgebraicLoopError, match="half"):
        record = Recording(to=tmp_path / "run.parquet")
        closed().run(1.0, scenario=scenario, engine=engine, record=record)
    assert list(tmp_path.iterdir()) == []  # not even its file was begun
    run = closed().run(1.0, scenario=scenario, engine=engine, algorithm=TwoPhase(loops=Newton()))
    assert run["sum.y"][:5] == pytest.approx([1.0, 1.0, 1.0, 1.5, 1.5], abs=1e-12)
    assert run["sum.y"][5:] == pytest.approx([2.0] * 6, abs=1e-9)


def noisy() -> tuple[Diagram, Scenario]:
    diagram = Diagram("noisy", step=STEP)
    diagram.add("noise", Noise(seed=3, period=0.3))
    diagram.add("gain", Gain(2.0))
    diagram.add("link", Delay(0.3))
    diagram.add("i", Fmu(build(integrator())))
    diagram.add("j", Fmu(build(integrator())))
    ports = {"noise.y": "gain.u", "gain.y": "link.u", "link.y": "i.u", "i.x": "j.u"}
    for source, target in ports.items():
        diagram.connect(source, target)
    changes = [
        Freeze("gain.y", at=0.5, until=2.0),
        Bias("gain.y", 1.0, at=1.0, until=3.0),
        Bias("noise.y", 1.0, at=0.7, until=1.4),
        Freeze("i.x", at=0.6, until=1.6),
        DropOut("i.u", "last", at=1.4, until=2.2),
        SetParameter("gain.k", 3.0, at=1.3),
        SetDelay("link", 0.5, at=1.7),
    ]
    return diagram, Scenario(changes)


@with_every_algorithm
def test_continued_in_the_middle_of_a_fault(algorithm: Any) -> None:
    """To the last bit, the rest by the other engine."""
    diagram, scenario = noisy()
    whole = diagram.run(3.5, algorithm=algorithm, scenario=scenario, engine="python")
    for n, k in enumerate((5, 6, 7, 10, 13, 14, 15, 17, 20, 22, 30, 31)):
        options: dict[str, Any] = {"algorithm": algorithm, "scenario": scenario}
        with diagram.simulation(**options, engine=ENGINES[n % 2]) as simulation:
            checkpoint = simulation.advance(k / 10).checkpoint()
        run = diagram.run(3.5, **options, engine=ENGINES[1 - n % 2], resume=checkpoint)
        assert run.values.tobytes() == whole.values[k:].tobytes(), k


def test_a_checkpoint_of_another_scenario_is_refused() -> None:
    diagram, scenario = noisy()

    def checkpoint(scenario: Scenario | None) -> Checkpoint:
        with diagram.simulation(scenario=scenario) as simulation:
            return simulation.advance(1.0).checkpoint()

    later = Scenario([SetDelay("link", 3.0, at=1.5)])
    for one, other in ((scenario, None), (None, scenario), (scenario, later), (None, later)):
        with pytest.raises(CheckpointError, match="scenario"):
            diagram.run(2.0, resume=checkpoint(one), scenario=other)
    diagram.run(2.0, resume=checkpoint(scenario), scenario=noisy()[1])  # an equal one is the same
