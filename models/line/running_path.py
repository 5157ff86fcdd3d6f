"""Running paths of railtoolkit/schema, versions 2022.05 and 2024.07, as YAML or JSON.

A path is a list of characteristic sections (position in m, speed in km/h, resistance in ‰), of
which the last one is the path's end. The schema knows points of interest, not stops. Our
reading: the stops are the points with the group "stops" (2024.07); if there are none, all points
measured at the front of the train; if these are fewer than two, the path's ends too. The
resistance is taken as the gradient.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field

from .document import Document
from .fields import Number, Positive, Strict
from .line import Line, Stop, check_gradients, check_limits, check_stops
from .profile import Misfit, check_rising, merged
from .railtoolkit import checked_version, chosen

SCHEMA = "https://railtoolkit.org/schema/running-path.json"
_GROUPS = {"stop", "stops", "station", "stations"}


class _Section(Strict):
    position: Number
    speed: Positive | None = None
    resistance: Number | None = None
    track: Any = None
    section_id: Any = None


class _Point(Strict):
    position: Number
    id: str = Field(validation_alias=AliasChoices("id", "label"))
    measure: Literal["front", "middle", "rear"]
    description: str = ""
    groups: list[str] = []


class _Path2024(Strict):
    id: str
    name: str = ""
    uuid: str = Field("", alias="UUID")
    description: str = ""
    characteristic_sections: Annotated[list[_Section], Field(min_length=2)]
    points_of_interest: list[_Point] = []


class _File2024(Strict):
    schema_: str = Field(alias="schema")
    schema_version: str
    paths: Annotated[list[_Path2024], Field(min_length=1)]


class _Path2022(Strict):
    id: str
    name: str
    uuid: str = Field("", alias="UUID")
    characteristic_sections: Annotated[list[tuple[Number, Positive, Number]], Field(min_length=2)]
    points_of_interest: list[tuple[Number, str, Literal["front", "rear"]]] = []


class _File2022(Strict):
    schema_: str = Field(alias="schema")
    schema_version: str
    paths: Annotated[list[_Path2022], Field(min_length=1)]


def line_from_running_path(document: Document, name: str = "") -> Line:
    """Return the line of a running path, chosen by its id if there are several.

    The line's positions begin at 0 where the path begins. Raise FileError with the place of what
    is wrong.
    """
    version = checked_version(document)
    paths = document.validated(_File2022 if version == "2022.05" else _File2024).paths
    index = chosen(document, "paths", [path.id for path in paths], name)
    path = paths[index]
    where: tuple[int | str, ...] = ("paths", index)
    sections = _sections(document, where, path)
    begin, length = sections[0].position, sections[-1].position - sections[0].position
    inner = [(section.position - begin, section) for section in sections[:-1]]
    limits = tuple((at, (section.speed or 0.0) / 3.6) for at, section in inner)
    gradients = tuple((at, section.resistance or 0.0) for at, section in inner)
    _checked(document, where, lambda: check_limits(limits, length=length), "speed")
    _checked(document, where, lambda: check_gradients(gradients, length=length), "resistance")
    return Line(
        name=path.id,
        length=length,
        stops=_stops(document, where, path, (begin, begin + length)),
        speed_limits=merged(limits),
        gradients=merged(gradients),
        description=path.name if isinstance(path, _Path2022) else path.description or path.name,
    )


def _sections(
    document: Document, where: tuple[int | str, ...], path: _Path2022 | _Path2024
) -> list[_Section]:
    """Return the sections with what they do not say taken from the one before."""
    field = (*where, "characteristic_sections")
    if isinstance(path, _Path2022):
        sections = [
            _Section(position=position, speed=speed, resistance=resistance)
            for position, speed, resistance in path.characteristic_sections
        ]
    else:
        sections = path.characteristic_sections
    try:
        check_rising([section.position for section in sections])
    except Misfit as error:
        document.within(field, error)
    if sections[0].speed is None:
        document.fail((*field, 0), "the first section has no speed")
    filled: list[_Section] = []
    for section in sections:
        before = filled[-1] if filled else section
        given = section.model_dump(exclude_none=True)
        filled.append(_Section(**{**before.model_dump(), **given}))
    return filled


def _checked(
    document: Document, where: tuple[int | str, ...], check: Callable[[], None], key: str
) -> None:
    try:
        check()
    except Misfit as error:
        index = error.path[:1]
        document.fail((*where, "characteristic_sections", *index), f"{key}: {error.args[0]}")


def _stops(
    document: Document,
    where: tuple[int | str, ...],
    path: _Path2022 | _Path2024,
    ends: tuple[float, float],
) -> tuple[Stop, ...]:
    field = (*where, "points_of_interest")
    places = _points(path)
    if grouped := [at for at in places if _GROUPS & {group.casefold() for group in at[1].groups}]:
        for index, point in grouped:
            if point.measure != "front":
                document.fail(
                    (*field, index),
                    f"'{point.id}' is a stop measured at the train's {point.measure}; where the "
                    f"front halts then depends on the train: give the front's position",
                )
        places = grouped
    else:
        places = [at for at in places if at[1].measure == "front"]
    places.sort(key=lambda at: at[1].position)
    begin, end = ends
    stops = [Stop(name=point.id, position=point.position - begin) for _, point in places]
    if len(stops) < 2:
        stops = _with_ends(stops, end - begin)
    try:
        check_stops(tuple(stops), length=end - begin)
    except Misfit as error:
        index = error.path[0] if error.path else 0
        at = (places[int(index)][0],) if len(places) == len(stops) else ()
        document.fail(
            (*field, *at),
            f"{error.args[0]} (the stops are the points with the group 'stops', or all measured "
            f"at the front)",
        )
    return tuple(stops)


def _points(path: _Path2022 | _Path2024) -> list[tuple[int, _Point]]:
    """Return the path's points with their index in the file."""
    if isinstance(path, _Path2024):
        return list(enumerate(path.points_of_interest))
    return [
        (index, _Point(position=position, id=label, measure=measure))
        for index, (position, label, measure) in enumerate(path.points_of_interest)
    ]


def _with_ends(stops: list[Stop], length: float) -> list[Stop]:
    taken = {stop.position for stop in stops}
    ends = [Stop(name="begin", position=0.0), Stop(name="end", position=length)]
    stops = stops + [stop for stop in ends if stop.position not in taken]
    return sorted(stops, key=lambda stop: stop.position)
