"""Force and speed tracked: start-up, cyclic braking, steps, with lag and with noise."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

from ...controllers import FuzzyPID, SamplePID
from ...cosim import Recording
from ...models.consist import coal_train
from ..case import Case
from .controllers import FORCE, INFERENCE, PER_SECOND, SPEED
from .loop import Loop
from .measures import force_steps, on_coupler, speed_tracking, whole_train_and_energy
from .recorded import MEASURED, tracked, whole
from .targets import (
    BRAKING,
    DOWNHILL_SPEED,
    START_UP,
    STEPS,
    braking_force,
    braking_speed,
    profile,
    reductions,
    start_up_force,
    start_up_speed,
    step_force,
)

UPHILL = (("gradient[1]", 6.0),)
DOWNHILL = (("gradient[1]", -6.0), ("initial_speed", DOWNHILL_SPEED))
SIZE = 102  # vehicles
EVERY, SELDOM = 5, 50  # samples
LAG, NOISE = 0.1, 2e3  # s and N; ours
STEP_TIMES = ((60.0, 75.0), (75.0, 90.0), (90.0, 105.0), (105.0, 110.0))  # s, each a jump
UPWARDS = (STEP_TIMES[0], STEP_TIMES[3])
FREE = ("pid", "pid_fast", "fuzzy_literal_little", "fuzzy_folded")
LAGGED = ("pid", "fuzzy_literal_little", "fuzzy_folded")
NOISY = ("pid", "fuzzy_folded")


def start_up() -> Loop:
    """Return the start-up on +6 ‰ by coupler force."""
    return Loop(name="start_up", target=profile(start_up_force, START_UP, "N"), values=UPHILL)


def braking() -> Loop:
    """Return the cyclic braking on −6 ‰ by coupler force."""
    return Loop(
        name="braking", target=profile(braking_force, BRAKING, "N"), values=DOWNHILL,
        reduction=reductions(BRAKING),
    )  # fmt: skip


def tracking_cases() -> list[Case]:
    """Return the cases of tracking; builds the train's FMU."""
    up, down = start_up(), braking()
    found = _force(up, START_UP, FORCE | PER_SECOND | INFERENCE)
    found += _force(down, BRAKING, FORCE)
    found += _force(_rolling(up), START_UP, _some(FREE))
    for loop, stop in ((up, START_UP), (down, BRAKING)):
        found += _force(loop.with_disturbance("lag", lag=LAG), stop, _some(LAGGED))
        found += _force(loop.with_disturbance("noise", noise=NOISE), stop, _some(NOISY))
    steps = Loop(name="steps", target=profile(step_force, STEPS, "N"), values=UPHILL)
    found += [
        replace(case, measure=partial(force_steps, measured=MEASURED, steps=UPWARDS))
        for case in _force(steps, STEPS, FORCE)
    ]
    return [*found, *_speed(up, down), *_whole(up, down)]


def _some(names: Iterable[str]) -> dict[str, SamplePID]:
    return {name: FORCE[name] for name in names}


def _kept(measured: str, controller: SamplePID) -> Recording:
    """Return what a run keeps, every 10 ms: enough to see a swing at 4 Hz, and a small file."""
    return Recording(tracked(measured, gains=isinstance(controller, FuzzyPID)), EVERY)


def _rolling(loop: Loop) -> Loop:
    """Return the loop with a train that has no greater resistance at rest than when it rolls."""
    rest = tuple(
        (f"vehicle[{number}].resistance_starting", vehicle.resistance.constant)
        for number, vehicle in enumerate(coal_train().vehicles, 1)
    )
    return replace(loop, name=f"{loop.name}_rolling", values=loop.values + rest)


def _force(loop: Loop, stop: float, controllers: Mapping[str, SamplePID]) -> list[Case]:
    return [
        Case(
            loop.name,
            name,
            loop.diagram(controller),
            stop,
            on_coupler(loop.measured),
            record=_kept(loop.measured, controller),
            seeds={"noise": loop.seed} if loop.noise > 0.0 else {},
            long=True,
        )
        for name, controller in controllers.items()
    ]


def _speed(up: Loop, down: Loop) -> Iterable[Case]:
    loops = (
        (replace(up, name="start_up_speed", target=profile(start_up_speed, START_UP, "m/s")),
         START_UP),
        (replace(down, name="braking_speed", target=profile(braking_speed, BRAKING, "m/s")),
         BRAKING),
    )  # fmt: skip
    for loop, stop in loops:
        for name, controller in SPEED.items():
            yield Case(
                loop.name,
                name,
                replace(loop, measured="speed").diagram(controller),
                stop,
                speed_tracking,
                record=_kept("speed", controller),
                long=True,
            )


def _whole(up: Loop, down: Loop) -> Iterable[Case]:
    """Yield runs that keep all couplers, ten times a second."""
    for loop, stop in ((up, START_UP), (down, BRAKING)):
        yield Case(
            f"{loop.name}_train",
            "fuzzy_folded",
            replace(loop, name=f"{loop.name}_train").diagram(FORCE["fuzzy_folded"]),
            stop,
            whole_train_and_energy,
            record=Recording(whole(SIZE), SELDOM),
            long=True,
        )
