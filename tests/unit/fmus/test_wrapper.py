"""The FMU's functions, called directly: states, errors, serialization."""

import ctypes
import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus import build
from tests import plants
from tests.instances import FMU2Named


@pytest.fixture
def slave(tmp_path: Path) -> Iterator[FMU2Named]:
    made = FMU2Named(build(plants.everything()), tmp_path)
    yield made
    made.freeInstance()


def test_outputs_follow_inputs_and_parameters(slave: FMU2Named) -> None:
    slave.set("m[1]", 4.0)
    slave.initialize()
    assert slave.get("momentum[1]") == 4.0
    slave.set("u[1]", 3.0)
    assert slave.get("power") == 3.0  # 3 N · 1 m/s + 0: recomputed on get
    assert slave.get("der(v[1])") == pytest.approx((3.0 - 0.5 * 1.0) / 4.0)
    slave.set("c", 0.0)  # tunable between steps
    assert slave.get("der(v[1])") == pytest.approx(3.0 / 4.0)


def test_calls_in_a_wrong_state(slave: FMU2Named) -> None:
    slave.fails(lambda: slave.get("v[1]"), "fmi2GetReal is not allowed after instantiation")
    slave.fails(lambda: slave.doStep(0.0, 0.1), "fmi2DoStep is not allowed after instantiation")
    slave.fails(slave.exitInitializationMode, "is not allowed after instantiation")
    slave.fails(slave.terminate, "is not allowed")
    slave.initialize()
    slave.fails(slave.enterInitializationMode, "is not allowed between steps")
    slave.fails(lambda: slave.setupExperiment(startTime=0.0), "is not allowed between steps")
    slave.fails(lambda: slave.set("m[1]", 2.0), "m[1] can only be set before the run")
    slave.fails(lambda: slave.set("v[1]", 2.0), "v[1] can only be set before the run")
    slave.fails(lambda: slave.set("power", 2.0), "power is computed")
    slave.terminate()
    slave.fails(lambda: slave.doStep(0.0, 0.1), "is not allowed after termination")
    assert slave.get("v[1]") == 1.0


def test_wrong_arguments(slave: FMU2Named) -> None:
    slave.initialize()
    slave.fails(lambda: slave.getReal([999]), "unknown value reference 999")
    slave.fails(lambda: slave.setReal([999], [1.0]), "unknown value reference 999")
    slave.fails(lambda: slave.getInteger([0]), "v[1] is a Real")
    slave.fails(lambda: slave.fmi2GetReal(slave.component, None, 1, None), "null pointer")
    slave.fails(lambda: slave.doStep(0.5, 0.1), "called at t = 0.5, but the FMU stands at t = 0")
    slave.fails(lambda: slave.doStep(0.0, 0.0), "step size 0 is not positive")
    slave.fails(lambda: slave.doStep(0.0, -0.1), "is not positive")
    slave.fails(lambda: slave.doStep(0.0, float("nan")), "is not positive")
    slave.fails(lambda: slave.doStep(0.0, 1e12), "inner steps in one step")
    slave.fails(lambda: slave.set("u[1]", float("nan")), "the value for u[1] is not finite")
    slave.fails(lambda: slave.getDirectionalDerivative([99], [0], [1.0]), "value reference 99")
    known = slave.vr["solver.inner_step"]
    slave.fails(
        lambda: slave.getDirectionalDerivative([0], [known], [1.0]),
        "solver.inner_step is no state, input, parameter or memory",
    )
    slave.fails(
        lambda: slave.getDirectionalDerivative([known], [0], [1.0]),
        "solver.inner_step is no derivative or output",
    )
    assert slave.get("v[1]") == 1.0
    slave.doStep(0.0, 0.1)


def test_a_parameter_out_of_bounds_is_refused_at_initialization(slave: FMU2Named) -> None:
    slave.set("m[1]", 0.0)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.fails(slave.exitInitializationMode, "parameter m[1] = 0 lies outside [0.1")
    slave.reset()
    slave.initialize()


def test_values_out_of_bounds_are_warned_of_between_steps(tmp_path: Path) -> None:
    """A master checks bounds; the FMU tells, and goes on."""
    slave = FMU2Named(build(plants.tunable()), tmp_path)
    slave.setDebugLogging(True, ["logStatusWarning"])
    slave.initialize()
    slave.set("k", 0.25)
    assert "k = 0.25 lies outside [0.5" in slave.log[-1]
    slave.doStep(0.0, 0.1)
    slave.freeInstance()


def test_an_unknown_log_category_is_not_echoed(slave: FMU2Named) -> None:
    slave.fails(lambda: slave.setDebugLogging(True, ["%s%n"]), "unknown log category")


def test_a_state_that_is_not_finite_is_an_error_and_reset_helps(tmp_path: Path) -> None:
    slave = FMU2Named(build(plants.blow_up()), tmp_path)
    slave.initialize()
    slave.fails(lambda: slave.doStep(0.0, 2.0), "x is not finite at t = 1.0")
    slave.fails(lambda: slave.doStep(2.0, 0.1), "is not allowed after an error")
    slave.get("x")  # getters stay legal
    slave.reset()
    slave.initialize()
    slave.doStep(0.0, 0.5)
    assert slave.get("x") == pytest.approx(2.0, rel=1e-9)
    slave.freeInstance()


def test_many_instances_do_not_share_anything(tmp_path: Path) -> None:
    path = build(plants.everything())
    slaves = [FMU2Named(path, tmp_path / str(i)) for i in range(5)]
    for i, slave in enumerate(slaves):
        slave.set("c", float(i))
        slave.initialize()
    for k in range(10):
        for slave in slaves:
            slave.doStep(k / 10, 0.1)
    values = [slave.get("v[1]") for slave in slaves]
    assert values == sorted(values, reverse=True)
    assert len(set(values)) == 5
    for slave in slaves:
        slave.freeInstance()


def steps(slave: FMU2Named, start: int, count: int) -> list[float]:
    rows = []
    for k in range(start, start + count):
        slave.set("u[1]", float(np.sin(0.3 * k)))
        slave.doStep(k / 20, 0.05)
        rows += [slave.get(n) for n in ("v[1]", "v[2]", "power")]
    return rows


def test_state_round_trips_continue_to_the_same_bits(slave: FMU2Named, tmp_path: Path) -> None:
    slave.initialize()
    generator = random.Random(2)
    place = 0
    for _ in range(20):
        count = generator.randint(1, 5)
        steps(slave, place, count)
        place += count
        state = slave.getFMUstate()
        data = slave.serializeFMUstate(state)
        expected = steps(slave, place, 10)
        slave.setFMUstate(state)
        assert steps(slave, place, 10) == expected
        other = FMU2Named(build(plants.everything()), tmp_path / str(place))
        again = other.deSerializeFMUstate(data)
        other.setFMUstate(again)
        assert steps(other, place, 10) == expected
        other.freeFMUstate(again)
        other.freeInstance()
        slave.setFMUstate(state)
        slave.freeFMUstate(state)
    state = slave.getFMUstate()
    data = slave.serializeFMUstate(state)
    slave.fails(lambda: slave.deSerializeFMUstate(data[:-1]), "the size must be")
    slave.freeFMUstate(state)


def test_instantiation_refuses_what_does_not_fit(slave: FMU2Named) -> None:
    from fmpy.fmi2 import fmi2CallbackFunctions

    callbacks = ctypes.POINTER(fmi2CallbackFunctions)(slave.callbacks)

    def instantiate(name: bytes, kind: int, guid: bytes) -> object:
        return slave.fmi2Instantiate(name, kind, guid, b"", callbacks, 0, 0)

    guid = slave.guid.encode()
    assert instantiate(b"a", 1, b"{other}") is None
    assert "the GUID is not this binary's" in slave.log[-1]
    assert instantiate(b"", 1, guid) is None
    assert instantiate(b"a", 7, guid) is None
    assert "unknown FMU type 7" in slave.log[-1]


def test_inner_steps_fit_the_communication_step(tmp_path: Path) -> None:
    """0.05 s is 25 inner steps of 2 ms, not 26: the same bits as 25 communication steps."""
    path = build(plants.everything())
    coarse, fine = FMU2Named(path, tmp_path / "a"), FMU2Named(path, tmp_path / "b")
    for slave in (coarse, fine):
        slave.initialize()
    coarse.doStep(0.0, 0.05)
    for k in range(25):
        fine.doStep(k * 0.002, 0.002)
    assert coarse.get("v[1]") == pytest.approx(fine.get("v[1]"), abs=1e-15)
    coarse.freeInstance()
    fine.freeInstance()
