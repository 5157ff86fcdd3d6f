"""Force and speed tracked: start-up, cyclic braking, steps, with lag and with noise."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

from ...controllers import FuzzyPID, SamplePID
from ...cosim import Recording
from ...models.consist import coal_train
from ..case import Case
from .controllers import FORCE, INFERENCE, PER_SECOND, SPEED
from .loop import Loop, rolling_at_rest
from .measures import force_steps, force_tracking, speed_tracking, swinging
from .recorded import FORCES, MEASURED, tracked
from .targets import BRAKING, DOWNHILL_SPEED, START_UP, STEPS, reductions, target

UPHILL = (("gradient[1]", 6.0),)
DOWNHILL = (("gradient[1]", -6.0), ("initial_speed", DOWNHILL_SPEED))
EVERY = 5  # samples
LAG, NOISE = 0.1, 2e3  # s and N; ours
STEP_TIMES = ((60.0, 75.0), (75.0, 90.0), (90.0, 105.0), (105.0, 110.0))  # s, each a jump
UPWARDS = (STEP_TIMES[0], STEP_TIMES[3])
FREE = ("pid", "pid_fast", "fuzzy_literal_little", "fuzzy_folded")
LAGGED = ("pid", "fuzzy_literal_little", "fuzzy_folded")
NOISY = ("pid", "fuzzy_folded")
WHOLE = "fuzzy_folded"  # whose runs keep all couplers
SWING, BUILT_UP = 32.0, 15.0  # s: the end, and when the target is reached
DAMPED = 1e5  # N·s/m: twice the damping
FINE = 2.5e-4  # s


def start_up() -> Loop:
    """Return the start-up on +6 ‰ by coupler force."""
    return Loop(name="start_up", target=target("start_up_force"), values=UPHILL)


def braking() -> Loop:
    """Return the cyclic braking on −6 ‰ by coupler force."""
    return Loop(
        name="braking", target=target("braking_force"), values=DOWNHILL,
        reduction=reductions(BRAKING),
    )  # fmt: skip


def tracking_cases() -> list[Case]:
    """Return the cases of tracking; builds the train's FMU."""
    up, down = start_up(), braking()
    found = _force(up, START_UP, FORCE | PER_SECOND | INFERENCE, whole=True)
    found += _force(down, BRAKING, FORCE, whole=True)
    found += _force(_rolling(up), START_UP, _some(FREE))
    for loop, stop in ((up, START_UP), (down, BRAKING)):
        found += _force(loop.with_disturbance("lag", lag=LAG), stop, _some(LAGGED))
        found += _force(loop.with_disturbance("noise", noise=NOISE), stop, _some(NOISY))
    steps = Loop(name="steps", target=target("step_force"), values=UPHILL)
    found += [
        replace(case, measure=partial(force_steps, measured=MEASURED, steps=UPWARDS))
        for case in _force(steps, STEPS, FORCE)
    ]
    return [*found, *_swinging(down), *_speed(up, down)]


def _some(names: Iterable[str]) -> dict[str, SamplePID]:
    return {name: FORCE[name] for name in names}


def _kept(measured: str, controller: SamplePID, *, whole: bool = False) -> Recording:
    """Return what a run keeps, every 10 ms: enough to see a swing at 4 Hz, and a small file."""
    ports = tracked(measured, gains=isinstance(controller, FuzzyPID))
    return Recording(tuple(dict.fromkeys(ports + FORCES if whole else ports)), EVERY)


def _rolling(loop: Loop) -> Loop:
    """Return the loop with a train that has no greater resistance at rest than when it rolls."""
    values = loop.values + tuple(rolling_at_rest().items())
    return replace(loop, name=f"{loop.name}_rolling", values=values)


def _force(
    loop: Loop, stop: float, controllers: Mapping[str, SamplePID], *, whole: bool = False
) -> list[Case]:
    return [
        Case(
            loop.name,
            name,
            loop.diagram(controller),
            stop,
            partial(force_tracking, measured=loop.measured),
            record=_kept(loop.measured, controller, whole=whole and name == WHOLE),
            seeds={"noise": loop.seed} if loop.noise > 0.0 else {},
            long=True,
        )
        for name, controller in controllers.items()
    ]


def _swinging(down: Loop) -> Iterable[Case]:
    """Yield the first application under PID: as it is, and with what ends the swing or does not."""
    pid = SamplePID()
    damped = tuple((f"coupler[{i}].damping", DAMPED) for i in range(1, coal_train().size))
    fine = (("solver.inner_step", FINE),)
    variants = {
        "pid": (pid, ()),
        "pid_tenth": (SamplePID(kp=pid.kp / 10.0, ki=pid.ki / 10.0, kd=pid.kd / 10.0), ()),
        "pid_filtered": (SamplePID(filter_time=0.02), ()),
        "pid_damped": (pid, damped),
        "pid_fine_steps": (pid, fine),
    }
    for name, (controller, values) in variants.items():
        loop = replace(down, name="swing", values=down.values + values)
        (case,) = _force(loop, SWING, {name: controller})
        yield replace(case, measure=partial(swinging, measured=MEASURED, since=BUILT_UP))


def _speed(up: Loop, down: Loop) -> Iterable[Case]:
    loops = (
        (replace(up, name="start_up_speed", target=target("start_up_speed")), START_UP),
        (replace(down, name="braking_speed", target=target("braking_speed")), BRAKING),
    )
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
