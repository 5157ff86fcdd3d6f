"""The FMU's C code under sanitizers and valgrind: drivers in C, linked with an FMU's sources.

The drivers call every function in every state of FMI 2.0's tables, with wrong arguments, in
random runs with events, and from damaged states; see tests/drivers. A check that fails, a
report of a sanitizer or a crash makes a driver's exit code, which fails the test.
"""

import functools
from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import pytest

from railcosim.fmus import build
from railcosim.models import Plant
from railcosim.models.solver import DormandPrince, Rodas, SemiImplicitEuler, Solver
from tests import hybrid_plants, plants
from tests.drivers import (
    ADDRESS,
    MEMCHECK,
    PLAIN,
    THREAD,
    Driver,
    Workshop,
    needs_valgrind,
)
from tests.hybrid_plants import COARSE, braking


def springs(n: int = 9) -> Plant:
    """Bodies in a row, each pulled by its neighbours: loops in the generated C."""
    with Plant("springs", stop=10.0, step=0.05) as plant:
        pull = plant.input("pull", unit="N", minimum=-1.0, maximum=1.0)
        mass = plant.parameter("mass", [1.0 + 0.1 * i for i in range(n)], unit="kg", size=n)
        x = plant.state("body[].x", unit="m", size=n, output=True)
        v = plant.state("body[].v", unit="m/s", size=n)
        force = x[:-1] - x[1:] + 0.5 * (v[:-1] - v[1:])
        plant.der(x, v)
        plant.der(v, (ca.vertcat(pull, force) - ca.vertcat(force, 0.0)) / mass)
        plant.output("force", force, unit="N")
        plant.output("largest", ca.mmax(force), unit="N")
    return plant


EULER = SemiImplicitEuler(inner_step=0.01, positions=("position",))
PLANTS: dict[str, Callable[[], Plant]] = {
    "everything": plants.everything,
    "braking": braking,
    "braking, symplectic": functools.partial(braking, solver=EULER),
    "braking, adaptive": functools.partial(braking, solver=DormandPrince()),
    "braking, stiff": functools.partial(braking, solver=Rodas()),
    "fleet": hybrid_plants.fleet,
    "clock": hybrid_plants.clock,
    "draft gear": hybrid_plants.draft_gear,
    "geared": hybrid_plants.geared,
    "springs": springs,
}
WITHOUT_EVENTS = ("everything", "draft gear", "geared", "springs")
EXCHANGE, CO_SIMULATION = 0, 1


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return Workshop(tmp_path_factory.mktemp("drivers"))


def runs(driver: Driver, name: str, first: int, count: int) -> None:
    """Let random runs pass, with events where there are some to pass."""
    for line in driver.run("random", first, count)[:2]:
        events = int(line.split(": ")[1].split()[0])
        assert (events == 0) == (name in WITHOUT_EVENTS), line


@pytest.mark.parametrize("name", PLANTS)
def test_the_address_and_undefined_behaviour_sanitizers_are_silent(
    workshop: Workshop, name: str
) -> None:
    driver = workshop.driver(build(PLANTS[name]()), ADDRESS)
    for program in ("states", "arguments", "logs"):
        driver.run(program)
    runs(driver, name, 1, 4)
    driver.run("corrupted", 1, 200)


@needs_valgrind
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n == "braking, stiff" else pytest.mark.slow) for n in PLANTS],
)
def test_valgrind_is_silent(workshop: Workshop, name: str) -> None:
    driver = replace(workshop.driver(build(PLANTS[name]()), PLAIN), launcher=MEMCHECK)
    for program in ("states", "arguments"):
        driver.run(program)
    runs(driver, name, 1, 1)


@pytest.mark.slow
@needs_valgrind
@pytest.mark.parametrize("name", PLANTS)
def test_valgrind_is_silent_with_damaged_states(workshop: Workshop, name: str) -> None:
    driver = replace(workshop.driver(build(PLANTS[name]()), PLAIN), launcher=MEMCHECK)
    driver.run("logs")
    driver.run("corrupted", 1, 200)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_long_random_runs_and_many_damaged_states(workshop: Workshop, name: str) -> None:
    driver = workshop.driver(build(PLANTS[name]()), ADDRESS)
    runs(driver, name, 1000, 100)
    driver.run("corrupted", 17, 10_000)


@pytest.mark.parametrize(
    "name", ["braking", *(pytest.param(n, marks=pytest.mark.slow) for n in ("clock", "fleet"))]
)
def test_instances_in_threads_share_nothing(workshop: Workshop, name: str) -> None:
    """Eight threads with instances of their own give, to the last bit, what a serial run gives."""
    workshop.driver(build(PLANTS[name]()), THREAD).run("threads", 8)


def faulty(solver: Solver, *, updates: bool) -> Plant:
    """A plant with a fault for each value of its input and tunable parameter from 3 to 12.

    Without updates (fault 10) events are not settled after each inner step.
    """
    with Plant("faulty", stop=10.0, step=0.1, solver=solver) as plant:
        fault = plant.input("fault", unit="1", minimum=-1.0, maximum=1.0)
        setting = plant.parameter("setting", 0.0, unit="1", tunable=True)
        zero = plant.parameter("zero", 0.0, unit="1")
        scale = plant.dependent("scale", 1.0 / (setting - 11.0), unit="1")
        x = plant.state("x", unit="1", start=1.0, output=True)
        mode = plant.mode("mode")
        jumped, last = plant.memory("jumped", unit="1"), plant.memory("last", unit="1")
        due = plant.memory("due", unit="s", start=0.25)

        def trap(value: ca.MX | float, at: int, where: ca.MX = fault) -> ca.MX:
            """The value, but NaN where the input is near `at`."""
            return value + zero * ca.sqrt(ca.fabs(where - at) - 0.25)

        late = plant.state("late", unit="1")
        plant.der(x, trap(-x, 3))
        plant.der(late, ca.if_else(fault > 11.5, 1.0, 0.0))
        plant.output("y", trap(x, 4), unit="1")
        plant.output("scaled", scale * x, unit="1")
        plant.event("cross", trap(x - 10.0, 5), direction="rising", changes={mode: 1})
        inside = x - 10.0 + zero * ca.sqrt(0.05 - late)  # after half a step
        plant.event("inside", inside, direction="rising", changes={mode: 3})
        guard = trap(1.0, 6, setting)
        plant.event("watch", x - 20.0, direction="rising", when=guard, changes={mode: 2})
        plant.time_event("tick", trap(due, 7, setting), changes={due: due + 0.25})
        near = [0.25 - ca.fabs(fault - at) for at in (8, 9)]
        division = jumped + 1.0 / (fault - 8.0)
        plant.event("jump", near[0], direction="rising", changes={jumped: division})
        plant.event("odd", near[1], direction="rising", changes={mode: mode + 0.5})
        if updates:
            plant.update(last, trap(x, 10))
    return plant


FAULTS = {
    3: "x is not finite",
    4: "y is not finite",
    5: "the crossing of event 'cross' is not finite",
    6: "the guard of event 'watch' is not finite",
    7: "the time of event 'tick' is not finite",
    8: "event 'jump' sets jumped to a value that is not finite",
    9: "event 'odd' sets the mode mode to 0.5",
    10: "the update of last is not finite",
    11: "scale is not finite",
    12: "the crossing of event 'inside' is not finite",
}


@pytest.mark.parametrize(("solver", "updates"), [(COARSE, True), (Rodas(), False)])
def test_a_fault_of_the_model_is_told_and_can_be_left(
    workshop: Workshop, solver: Solver, updates: bool
) -> None:
    """A NaN or infinity anywhere in a plant: fmi2Error, and a line that names what and when."""
    driver = workshop.driver(build(faulty(solver, updates=updates)), ADDRESS)
    for kind in (EXCHANGE, CO_SIMULATION):
        for value, words in FAULTS.items():
            if value == 10 and not updates:
                continue
            line = driver.run("fault", kind, value)[0]
            at_once = value == 3 and (kind == EXCHANGE or solver is not COARSE)
            assert ("der(x) is not finite" if at_once else words) in line
            assert " at t = " in line
