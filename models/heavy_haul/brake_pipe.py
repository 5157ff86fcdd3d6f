"""The brake pipe: the wave from the locomotives, and the one from the end-of-train device."""

from typing import Any, NamedTuple

import casadi as ca

from ..consist import Consist
from ..plant import Plant
from .mapping import mapped

PIPE = "reduction of the brake pipe's pressure at the vehicle"


class Feed(NamedTuple):
    """What feeds a vehicle's part of the pipe: group `upstream`, or after all groups a vehicle.

    The wave has come by `way` (m), the vehicle's own length included, at `time` (s).
    """

    upstream: int
    way: float
    time: float


def declare_pipe(plant: Plant, consist: Consist, length: Any) -> Any:
    """Declare the pipe; return its reduction at each vehicle, in kPa. `length` is theirs, in m.

    r_i' = (r of the neighbour towards the source − r_i)/τ, with τ the vehicle's length over the
    wave's speed: a cascade of lags, so the wave's front spreads as the square root of the number of
    vehicles (our choice; from memory, 250 m/s for application and 160 m/s for release). Each
    vehicle is fed by that group of locomotives whose wave reaches it first.

    An end-of-train device has a cascade of its own, from the last vehicle forwards, and the pipe's
    reduction is the larger of the two. The device vents and never recharges. Its cascade is that of
    a lead, what it has over the other: where the locomotives' wave has brought the pipe as low,
    there is none, and a release by the locomotives is not held up by what is behind (our choice).
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
        pipe = plant.state(
            "vehicle[].pipe_reduction", unit="kPa", size=consist.size, minimum=0.0, nominal=100.0,
            output=True, description=PIPE,
        )  # fmt: skip
        before = ca.vertcat(groups, pipe)[_upstream(consist), 0]
        (rate,) = mapped("pipe_of_vehicle", _follow, pipe, before, *lags, count=consist.size)
        plant.der(pipe, rate)
        return pipe
    return _with_device(plant, consist, groups, device, lags)


def feeds(consist: Consist) -> list[Feed]:
    """Return, for each vehicle, whence the locomotives' brake wave reaches it first.

    The first group's command is there at once, the others' after the consist's radio delay. What
    counts is the wave of an application by the consist's own numbers; a release takes the same ways
    (our choice).
    """
    found: list[Feed | None] = [None] * consist.size
    groups = len(consist.groups)
    for k, group in enumerate(consist.groups):
        delay, first = consist.radio_delay if k else 0.0, group[0]
        for step in (1, -1):
            way, i = 0.0, first
            while 0 <= i < consist.size:
                way += consist.vehicles[i].length
                time = delay + way / consist.application_speed
                best = found[i]
                if best is None or time < best.time:
                    found[i] = Feed(k if i == first else groups + i - step, way, time)
                i += step
    return [feed for feed in found if feed is not None]


def lag(missing: Any, up: Any, down: Any) -> Any:
    """Return what a lag makes up per s, at the rate `up` (1/s) or `down`, without a branch."""
    return 0.5 * (up + down) * missing + 0.5 * (up - down) * ca.fabs(missing)


def _with_device(
    plant: Plant, consist: Consist, groups: Any, device: Any, lags: tuple[Any, ...]
) -> Any:
    """Declare both cascades; return the larger reduction of each vehicle.

    The lead q is a state, negative for a moment where the locomotives' wave r overtakes. While r
    rises, r + q goes on as a cascade without r would; when it falls, q is left alone.
    """
    size = consist.size
    pipe = plant.state(
        "vehicle[].pipe_from_locomotives", unit="kPa", size=size, minimum=0.0, nominal=100.0,
        description="reduction at the vehicle that the locomotives bring about",
    )  # fmt: skip
    lead = plant.state(
        "vehicle[].pipe_lead", unit="kPa", size=size, nominal=100.0,
        description="how far the end-of-train device's wave is ahead of that",
    )  # fmt: skip

    def equations(
        r: Any, before: Any, q: Any, behind: Any, ahead: Any,
        per_length: Any, fast: Any, slow: Any,
    ) -> list[Any]:  # fmt: skip
        (rate,) = _follow(r, before, per_length, fast, slow)
        offered = _positive(_positive(ahead) - _positive(r - behind))
        return [rate, lag(offered - q, fast, slow) * per_length - _positive(rate)]

    # At the last vehicle the device is like a neighbour that has its lead over a full pipe.
    before = ca.vertcat(groups, pipe)[_upstream(consist), 0]
    behind, ahead = ca.vertcat(pipe[1:], 0.0), ca.vertcat(lead[1:], device)
    rate, gain = mapped(
        "pipe_of_vehicle", equations, pipe, before, lead, behind, ahead, *lags, count=size
    )
    plant.der(pipe, rate)
    plant.der(lead, gain)
    (reduction,) = mapped(
        "reduction_of_vehicle", lambda r, q: [r + _positive(q)], pipe, lead, count=size
    )
    plant.output(
        "vehicle[].pipe_reduction", reduction, unit="kPa", nominal=100.0, description=PIPE
    )  # fmt: skip
    return reduction


def _upstream(consist: Consist) -> list[int]:
    return [feed.upstream for feed in feeds(consist)]


def _follow(r: Any, before: Any, per_length: Any, fast: Any, slow: Any) -> list[Any]:
    return [lag(before - r, fast, slow) * per_length]


def _positive(x: Any) -> Any:
    """Return the larger of x and 0; of a maximum with zero compilers make a branch."""
    return 0.5 * (x + ca.fabs(x))
