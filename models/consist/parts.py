"""The types that a consist file names, made into vehicles, draft gears and couplers in SI units."""

from collections.abc import Callable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Any, TypeVar

from ...base.errors import listing, suggest
from ..line.document import Document
from ..line.fields import Strict
from ..line.train import KMH
from .checks import Pairs, Path, Unfit
from .draft_gear import Coupler, DraftGear, Points, PowerLaw
from .schema import File
from .vehicle import Envelope, RunningResistance, ShoeBrake, Vehicle

Given = dict[str, Any]
_Made = TypeVar("_Made")


def made(document: Document, where: Path, make: Callable[..., _Made], **given: Any) -> _Made:
    """Return what `make` makes of the values; what cannot be is refused with its place.

    None means that nothing is given, so that the default holds.
    """
    try:
        return make(**{key: value for key, value in given.items() if value is not None})
    except Unfit as error:
        path = () if error.path == ("name",) else error.path  # the name is the key in the file
        document.fail((*where, *path), error.text)


def known(document: Document, where: Path, kind: str, name: str, names: Mapping[str, Any]) -> str:
    """Return the name if it is one of `names`; refuse it at its place else."""
    if name not in names:
        document.fail(
            where, f"no {kind} '{name}'; there are: {listing(names)}{suggest(name, names)}"
        )
    return name


def in_order(
    document: Document, field: str, needs: Mapping[str, Sequence[str]], verb: str
) -> list[str]:
    """Return the names so that each comes after those it needs; refuse a loop with its chain."""
    try:
        return list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        chain: list[str] = error.args[1][::-1]
        start = chain.index(min(chain, key=list(needs).index))
        chain = [*chain[start:-1], *chain[: start + 1]] if start else chain
        text = f" {verb} ".join(f"'{name}'" for name in chain)
        document.fail((field, chain[0]), f"a loop: {text}; one of them must go without")


def vehicles(document: Document, file: File) -> dict[str, Vehicle]:
    """Return the vehicle types by their names."""
    types = _inherited(document, "vehicles", "vehicle", file.vehicles)
    return {name: _vehicle(document, name, given) for name, given in types.items()}


def couplers(document: Document, file: File) -> dict[str, Coupler]:
    """Return the kinds of couplers by their names."""
    types = _inherited(document, "draft_gears", "draft gear", file.draft_gears)
    gears = {name: _gear(document, name, given) for name, given in types.items()}
    joints: dict[str, Coupler] = {}
    for name, joint in file.couplers.items():
        where = ("couplers", name)
        gear = known(document, (*where, "gear"), "draft gear", joint.gear, gears)
        joints[name] = made(
            document, where, Coupler,
            gear=gears[gear], slack=_milli(joint.slack), damping=_kilo(joint.damping),
        )  # fmt: skip
    return joints


def _inherited(
    document: Document, field: str, kind: str, types: Mapping[str, Strict]
) -> dict[str, Given]:
    """Return what is given of each type, with what those give that it is like."""
    given = {
        name: _with_stroke(part.model_dump(exclude_unset=True)) for name, part in types.items()
    }
    needs: dict[str, list[str]] = {}
    for name, part in given.items():
        base = part.pop("like", None)
        needs[name] = [] if base is None else [base]
        if base is not None:
            known(document, (field, name, "like"), kind, base, types)
    whole: dict[str, Given] = {}
    for name in in_order(document, field, needs, "is like"):
        whole[name] = given[name]
        for base in needs[name]:
            whole[name] = _over(whole[base], given[name])
    return {name: whole[name] for name in types}


def _with_stroke(given: Given) -> Given:
    """Return what is given of a type; measured points give a draft gear its stroke as well."""
    points = (given.get("loading") or {}).get("points")
    if not points or given.get("stroke") is not None:
        return given
    return {**given, "stroke": points[-1][0]}


def _over(base: Given, own: Given) -> Given:
    """Return the base with what is given of its own; a loading curve is replaced as a whole."""
    merged = {**base, **own}
    for key, value in own.items():
        if key != "loading" and isinstance(value, dict) and isinstance(base.get(key), dict):
            merged[key] = {**base[key], **value}
    return merged


def _vehicle(document: Document, name: str, given: Given) -> Vehicle:
    where = ("vehicles", name)
    _require(document, where, given, ("mass", "length", "resistance"))
    resistance = given["resistance"]
    _require(
        document, (*where, "resistance"), resistance,
        ("constant", "linear", "quadratic", "starting"),
    )  # fmt: skip
    return made(
        document, where, Vehicle,
        name=name,
        mass=_kilo(given["mass"]),
        length=given["length"],
        resistance=made(document, (*where, "resistance"), RunningResistance, **resistance),
        brake=_brake(document, (*where, "brake"), given.get("brake")),
        traction=_envelope(document, (*where, "traction"), given.get("traction")),
        electric_brake=_envelope(
            document, (*where, "electric_brake"), given.get("electric_brake")
        ),
    )  # fmt: skip


def _envelope(document: Document, where: Path, given: Given | None) -> Envelope | None:
    if given is None:
        return None
    _require(document, where, given, ("points",))
    points = _scaled(given["points"], lambda speed: speed / KMH, _kilo)
    return made(document, where, Envelope, points=points, power=_kilo(given.get("power")))


def _brake(document: Document, where: Path, given: Given | None) -> ShoeBrake | None:
    if given is None:
        return None
    own = {
        "cylinder_diameter": _milli(given.get("cylinder_diameter")),
        "cylinder_pressure": _kilo(given.get("cylinder_pressure")),
    }
    return made(document, where, ShoeBrake, **{**given, **own})


def _gear(document: Document, name: str, given: Given) -> DraftGear:
    where = ("draft_gears", name)
    loading = given.get("loading")
    curve: PowerLaw | Points | None = None
    if loading is not None and loading.get("points") is not None:
        points = _scaled(loading["points"], _milli, _kilo)
        curve = made(document, (*where, "loading"), Points, points=points)
    elif loading is not None:
        curve = made(
            document, (*where, "loading"), PowerLaw,
            initial_force=_kilo(loading.get("initial_force")),
            initial_stroke=_milli(loading.get("initial_stroke")),
            final_force=_kilo(loading.get("final_force")),
            exponent=loading.get("exponent"),
        )  # fmt: skip
    return made(
        document, where, DraftGear,
        name=name,
        stroke=_milli(given.get("stroke")),
        loading=curve,
        unloading_ratio=given.get("unloading_ratio"),
        stiffness=_kilo(_kilo(given.get("stiffness"))),
        stop_stiffness=_kilo(_kilo(given.get("stop_stiffness"))),
    )  # fmt: skip


def _require(document: Document, where: Path, given: Given, keys: Sequence[str]) -> None:
    for key in keys:
        if given.get(key) is None:
            document.fail(where, f"'{key}' is missing")


def _scaled(
    points: Sequence[tuple[float, float]], first: Callable[..., Any], second: Callable[..., Any]
) -> Pairs:
    return tuple((first(one), second(other)) for one, other in points)


def _kilo(value: float | None) -> Any:
    return None if value is None else 1e3 * value


def _milli(value: float | None) -> Any:
    return None if value is None else value / 1e3  # divided, as 9.5 mm then are 0.0095 m exactly
