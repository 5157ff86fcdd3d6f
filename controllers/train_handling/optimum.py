"""The handling that keeps coupler forces low, in a given time."""

from itertools import pairwise
from typing import Any

import numpy as np

from ...base.errors import ConvergenceError, ParameterError, RailcosimError
from .checks import require_kind, require_numbers
from .handling import Array, Handling
from .journey import Aims, Journey
from .program import Program, Values
from .reduced import ReducedTrain

FILLING, APPLIED = 60.0, 30.0  # s for which the air brake is released, and applied, at least


def optimal_handling(
    train: ReducedTrain,
    journey: Journey,
    *,
    aims: Aims | None = None,
    node: float = 50.0,
    rate: float = 50e3,
    share: float = 0.95,
    air_brake: bool = False,
) -> Handling:
    """Return the force along a journey that is best by `aims` and arrives in its time.

    Unknowns at nodes at most `node` (m) apart: the speed v, the locomotives' force F and, with
    `air_brake`, the pipe's reduction and the cylinders' pressure. Between nodes F and v² are
    straight lines in the position, with (v²)' = 2 a by the trapezoidal rule; the time is
    Σ 2 h/(v + v₊). F begins at 0, changes by `rate` (N/s) at most and keeps within the `share` of
    the envelopes, so that a driver's feedback has something left. Coupler forces are those of
    `RigidTrain`, at 24 couplers spread over the train; the peak is a variable that none exceeds.

    The air brake is solved for twice: freely, and then applied (with its least reduction, never
    released in part) where the free solution had more than half of that. It is not released for
    less than a minute, which the pipe needs to be filled again, nor applied for less than half a
    one. CasADi and IPOPT solve it; all is our choice. Raise ParameterError for a time that cannot
    be, naming one that can, and ConvergenceError if no solution is found.
    """
    _check_kinds(train, journey, aims)
    require_numbers("handling", node=node, rate=rate, share=share)
    if not node > 0.0 or not rate > 0.0 or not 0.0 < share <= 1.0:
        raise ParameterError("handling: node and rate must be positive, share within 0 to 1")
    if air_brake and train.brake is None:
        why = train.without_brake or "it has none; see ReducedTrain"
        raise ParameterError(f"handling: the train has no air brake to plan with: {why}")
    program = Program(
        train=train, journey=journey, aims=aims or Aims(), node=node, rate=rate, share=share,
        air=air_brake,
    )  # fmt: skip
    _check_limits(program)
    found = program.solve()
    if found is not None and air_brake and train.brake is not None:
        found = _with_brake(program, found, 0.5 * train.brake.minimum)
    if found is None:
        raise _refusal(program)
    return handling_of(program, found)


def _check_kinds(train: Any, journey: Any, aims: Any) -> None:
    require_kind("handling", "train", train, ReducedTrain, "reduced_train(consist) gives one")
    require_kind("handling", "journey", journey, Journey, "see Journey")
    if aims is not None:
        require_kind("handling", "aims", aims, Aims, "write aims=Aims(rms=1.0), or leave it out")


def _with_brake(program: Program, free: Values, least: float) -> Values | None:
    """Return the solution with the air brake applied or not, from that which has it freely."""
    times = handling_of(program, free).time
    closed = _without_short(free["reduction"] > least, times, value=False, span=FILLING)
    for applied in (_without_short(closed, times, value=True, span=APPLIED), closed):
        found = program.solve(applied=applied, start=free)
        if found is not None:
            return found
    return None


def _without_short(flags: Array, times: Array, *, value: bool, span: float) -> Array:
    """Return flags with the other value where they have this one for less than `span` (s).

    What is released before the first application, or after the last, may be short.
    """
    found = flags.copy()
    edges = [0, *(np.flatnonzero(np.diff(flags)) + 1).tolist(), len(flags)]
    for begin, end in pairwise(edges):
        inner = value or (begin > 0 and end < len(flags))
        if flags[begin] == value and inner and times[end - 1] - times[begin] < span:
            found[begin:end] = not value
    return found


def handling_of(program: Program, values: Values) -> Handling:
    """Return the handling with a solution's values, and the forces of all couplers."""
    none = np.zeros(len(program.position))
    cylinder = values.get("cylinder", none)
    return Handling(
        position=program.position,
        speed=values["speed"],
        force=values["force"],
        reduction=values.get("reduction", none),
        cylinder=cylinder,
        coupler=program.rigid.coupler_forces(
            program.position, values["speed"], values["force"], cylinder
        ),
    )


def _check_limits(program: Program) -> None:
    journey = program.journey
    for speed, limit, place in (
        (journey.start_speed, program.limits[0], journey.start),
        (journey.end_speed, program.limits[-1], journey.end),
    ):
        if speed > limit:
            raise ParameterError(
                f"journey on '{journey.section.name}': {speed:g} m/s at {place:g} m is too fast; "
                f"the limit of the whole train is {limit:g} m/s there"
            )


def _refusal(program: Program) -> RailcosimError:
    journey = program.journey
    what = f"journey on '{journey.section.name}'"
    quickest = program.solve(quickest=True)
    if quickest is not None:
        least = handling_of(program, quickest).running_time
        if least > journey.time:
            return ParameterError(f"{what}: takes at least {least:.1f} s, not {journey.time:g} s")
    return ConvergenceError(
        f"{what} in {journey.time:g} s: no handling was found; the time may be too long to keep "
        "moving, or the brakes too weak for the gradients"
    )
