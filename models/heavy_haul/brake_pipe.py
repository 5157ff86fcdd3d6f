"""The brake pipe: the wave from the locomotives, and the one from the end-of-train device."""

import math
from typing import Any

import casadi as ca

from ..consist import Consist
from ..plant import Plant
from .mapping import mapped

CLOSING = 100.0  # the device's wave ends over the last 1/100 before the locomotives' is as low


def declare_pipe(plant: Plant, consist: Consist, length: Any) -> Any:
    """Declare the pipe; return its reduction at each vehicle, in kPa. `length` is theirs, in m.

    r_i' = (r of the neighbour towards the source − r_i)/τ, with τ the vehicle's length over the
    wave's speed: a cascade of lags, so the wave's front spreads as the square root of the number of
    vehicles (our choice; from memory, 250 m/s for application and 160 m/s for release). Each
    vehicle is fed by that group of locomotives whose wave reaches it first.

    An end-of-train device has a cascade of its own, from the last vehicle forwards, and the pipe's
    reduction is the larger of the two. The device vents and never recharges: its wave goes on only
    where the locomotives' has not yet brought the pipe as low, and ends where it has. So once both
    have met it is the locomotives' release alone that is felt (our choice).
    """
    groups = plant.input(
        "group[].reduction", unit="kPa", size=len(consist.groups), minimum=0.0, maximum=600.0,
        nominal=100.0, description="brake pipe reduction at the group's first locomotive; to be "
        "commanded at every group, as the vehicles next to one are fed by it alone",
    )  # fmt: skip
    device = None if consist.end_of_train is None else plant.input(
        "end_of_train.reduction", unit="kPa", minimum=0.0, maximum=600.0, nominal=100.0,
        description="brake pipe reduction to which the end-of-train device vents; without it the "
        "locomotives' wave runs on to the rear. Its radio delay is the diagram's",
    )  # fmt: skip
    speeds = [
        plant.parameter(
            f"brake_pipe.{name}_speed", start, unit="m/s", minimum=1.0, maximum=1000.0,
            nominal=100.0, description=f"speed of the brake wave at {name}; from memory",
        )
        for name, start in (
            ("application", consist.application_speed), ("release", consist.release_speed),
        )
    ]  # fmt: skip
    per_length = plant.dependent(
        "vehicle[].per_length", 1.0 / length, unit="1/m",
        description="vehicles in a metre of the train",
    )  # fmt: skip
    lags = (per_length, *speeds)
    if device is None:
        pipe = _state(plant, consist, "reduction", "reduction of the brake pipe's pressure",
                      output=True)  # fmt: skip
        _feed_from_locomotives(plant, consist, pipe, groups, lags)
        return pipe
    front = _state(plant, consist, "from_locomotives", "reduction that their wave brings")
    rear = _state(plant, consist, "from_device", "reduction that the end-of-train device's wave "
                  "brings as long as it is ahead of the locomotives'")  # fmt: skip
    _feed_from_locomotives(plant, consist, front, groups, lags)
    _feed_from_device(plant, consist, rear, front, device, lags)
    (pipe,) = mapped(
        "pipe_of_vehicle", lambda a, b: [a + _positive(b - a)], front, rear, count=consist.size
    )
    plant.output(
        "vehicle[].pipe_reduction", pipe, unit="kPa", nominal=100.0,
        description="reduction of the brake pipe's pressure at the vehicle",
    )  # fmt: skip
    return pipe


def feeds(consist: Consist) -> list[int]:
    """Return what feeds each vehicle's part of the pipe: k is group k, of n, and n + i vehicle i.

    The first group's command is there at once, the others' after the consist's radio delay. What
    counts is the wave of an application by the consist's own numbers; a release takes the same ways
    (our choice).
    """
    times = [v.length / consist.application_speed for v in consist.vehicles]
    best = [math.inf] * consist.size
    found = [0] * consist.size
    groups = len(consist.groups)
    for k, group in enumerate(consist.groups):
        for step in (1, -1):
            time, i = consist.radio_delay if k else 0.0, group[0]
            while 0 <= i < consist.size:
                time += times[i]
                if time < best[i]:
                    best[i], found[i] = time, k if i == group[0] else groups + i - step
                i += step
    return found


def lag(missing: Any, up: Any, down: Any) -> Any:
    """Return what a lag makes up per s, at the rate `up` (1/s) or `down`, without a branch."""
    return 0.5 * (up + down) * missing + 0.5 * (up - down) * ca.fabs(missing)


def _state(plant: Plant, consist: Consist, name: str, text: str, *, output: bool = False) -> Any:
    return plant.state(
        f"vehicle[].pipe_{name}", unit="kPa", size=consist.size, minimum=0.0, nominal=100.0,
        output=output, description=f"{text} at the vehicle",
    )  # fmt: skip


def _feed_from_locomotives(
    plant: Plant, consist: Consist, pipe: Any, groups: Any, lags: tuple[Any, ...]
) -> None:
    def equations(r: Any, before: Any, per_length: Any, fast: Any, slow: Any) -> list[Any]:
        return [lag(before - r, fast, slow) * per_length]

    before = ca.vertcat(groups, pipe)[feeds(consist), 0]
    (rate,) = mapped("pipe_from_locomotives", equations, pipe, before, *lags, count=consist.size)
    plant.der(pipe, rate)


def _feed_from_device(
    plant: Plant, consist: Consist, pipe: Any, front: Any, device: Any, lags: tuple[Any, ...]
) -> None:
    def equations(
        r: Any, behind: Any, other: Any, per_length: Any, fast: Any, slow: Any
    ) -> list[Any]:
        # The smaller of what comes from behind and CLOSING times its lead over the other wave. It
        # is in proportion, so a wave into a pipe without reduction keeps its shape and speed.
        brought = behind - _positive(behind - CLOSING * _positive(behind - other))
        return [lag(brought - r, fast, slow) * per_length]

    behind = ca.vertcat(pipe[1:], device)
    (rate,) = mapped(
        "pipe_from_device", equations, pipe, behind, front, *lags, count=consist.size
    )  # fmt: skip
    plant.der(pipe, rate)


def _positive(x: Any) -> Any:
    """Return the larger of x and 0; of a maximum compilers make a branch."""
    return 0.5 * (x + ca.fabs(x))
