"""Tracks of TTOBench, the benchmark library of train trajectory optimisation, as JSON.

Read as its library versions 1.x define it: positions of stops, speed limits and gradients with
their units. Curvatures and tunnels are checked for their shape and not used. Stops have no names
there; ours may be given in the metadata as "stop names" and "local stop names", two lists.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ...base.errors import ParameterError
from .document import Document
from .fields import Number, Pair, Strict
from .line import Line, Stop, check_gradients, check_limits, check_stops
from .profile import Misfit, Steps, merged

_PER_SPEED = {"km/h": 3.6, "m/s": 1.0}
_VERSION = re.compile(r"(TTOBench )?v?1\.\d+")
_LengthUnit = Literal["m", "km"]


class _Metadata(BaseModel):
    model_config = ConfigDict(extra="allow", frozen=True)
    id: str
    version: str = Field(alias="library version")
    description: str = ""
    stop_names: list[str] | None = Field(None, alias="stop names")
    local_names: list[str] | None = Field(None, alias="local stop names")


class _Altitude(Strict):
    unit: _LengthUnit
    value: Number


class _Stops(Strict):
    unit: _LengthUnit
    values: list[Number]


class _LimitUnits(Strict):
    position: _LengthUnit
    velocity: Literal["km/h", "m/s"]


class _Limits(Strict):
    units: _LimitUnits
    values: list[Pair]


class _GradientUnits(Strict):
    position: _LengthUnit
    slope: Literal["permil"]


class _Gradients(Strict):
    units: _GradientUnits
    values: list[Pair]


class _Unused(Strict):
    units: dict[str, str]
    values: list[tuple[Any, Any, Any]]


class _Track(Strict):
    metadata: _Metadata
    stops: _Stops
    limits: _Limits = Field(alias="speed limits")
    altitude: _Altitude | None = None
    gradients: _Gradients | None = None
    curvatures: _Unused | None = None
    tunnels: _Unused | None = None


def is_track(data: Any) -> bool:
    """Whether a file's data look like a TTOBench track."""
    return isinstance(data, dict) and "stops" in data and "speed limits" in data


def line_from_ttobench(document: Document) -> Line:
    """Return the line of a TTOBench track; raise FileError with the place of what is wrong.

    The line ends at its last stop. Nameless stops are called S1, S2, … in their order.
    """
    track = document.validated(_Track)
    if not _VERSION.fullmatch(track.metadata.version):
        document.fail(
            ("metadata", "library version"),
            f"version '{track.metadata.version}' is not known; read are 1.0 to 1.x",
        )
    stops = _stops(document, track)
    length = stops[-1].position
    units = track.limits.units
    limits = tuple(
        (_metres(position, units.position), value / _PER_SPEED[units.velocity])
        for position, value in track.limits.values
    )
    _checked(document, ("speed limits", "values"), check_limits, limits, length)
    gradients: Steps = ((0.0, 0.0),)
    if track.gradients:
        unit = track.gradients.units.position
        gradients = tuple((_metres(at, unit), value) for at, value in track.gradients.values)
        _checked(document, ("gradients", "values"), check_gradients, gradients, length)
    return Line(
        name=track.metadata.id,
        length=length,
        stops=stops,
        speed_limits=merged(limits),
        gradients=merged(gradients),
        description=track.metadata.description,
    )


def write_ttobench(line: Line, path: str | Path) -> None:
    """Write a line as a TTOBench track, in m and m/s, so that reading gives the same line again.

    TTOBench wants the file to have the name of its line, a first stop at 0 and the last at the
    line's end. Raise ParameterError for a line that begins or ends elsewhere.
    """
    if line.stops[0].position != 0.0 or line.stops[-1].position != line.length:
        raise ParameterError(
            f"line '{line.name}' does not begin and end at a stop, as a TTOBench track must"
        )
    metadata: dict[str, Any] = {
        "id": line.name,
        "library version": "TTOBench v1.4",
        "description": line.description,
        "stop names": [stop.name for stop in line.stops],
    }
    if any(stop.local_name for stop in line.stops):
        metadata["local stop names"] = [stop.local_name for stop in line.stops]
    data = {
        "metadata": metadata,
        "stops": {"unit": "m", "values": [stop.position for stop in line.stops]},
        "speed limits": {
            "units": {"position": "m", "velocity": "m/s"},
            "values": line.speed_limits,
        },
        "gradients": {"units": {"position": "m", "slope": "permil"}, "values": line.gradients},
    }
    Path(path).write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _stops(document: Document, track: _Track) -> tuple[Stop, ...]:
    positions = [_metres(value, track.stops.unit) for value in track.stops.values]
    names = _names(document, "stop names", track.metadata.stop_names, len(positions))
    local = _names(document, "local stop names", track.metadata.local_names, len(positions))
    stops = tuple(
        Stop(name=names[index] or f"S{index + 1}", position=position, local_name=local[index])
        for index, position in enumerate(positions)
    )
    if positions and positions[0] != 0.0:
        document.fail(("stops", "values", 0), f"the first stop must be at 0, not {positions[0]:g}")
    _checked(document, ("stops", "values"), check_stops, stops, max(positions, default=0.0))
    return stops


def _metres(position: float, unit: str) -> float:
    # 2.0005 km are 2000.5 m: without the rounding 2000.5000000000002.
    return round(1000.0 * position, 9) if unit == "km" else position


def _names(document: Document, key: str, names: list[str] | None, count: int) -> list[str]:
    if names is not None and len(names) != count:
        document.fail(("metadata", key), f"{len(names)} names for {count} stops")
    return names or [""] * count


def _checked(
    document: Document,
    where: tuple[str, ...],
    check: Callable[..., None],
    values: tuple[Any, ...],
    length: float,
) -> None:
    try:
        check(values, length=length)
    except Misfit as error:
        document.within(where, error)
