"""The list of a consist file's vehicles and joints, out of items and sets that hold sets."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ...base.errors import listing
from ..line.document import Document
from .checks import Path
from .consist import LONGEST, SHORTEST
from .parts import in_order, known
from .schema import File, Item


@dataclass
class Formation:
    """Names of vehicle types, and of the couplers between them (one fewer).

    `items` are the indices in the list of items that each vehicle is from.
    """

    vehicles: list[str] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    items: list[int] = field(default_factory=list)

    def append(self, other: "Formation", joint: str, item: int) -> None:
        """Put the other, an item, behind this one, joined by `joint` if there is what to join."""
        if self.vehicles:
            self.joints.append(joint)
        self.vehicles += other.vehicles
        self.joints += other.joints
        self.items += [item] * len(other.vehicles)


def formation(document: Document, file: File) -> Formation:
    """Return the train's vehicles and joints, at most 1000; raise FileError for what cannot be.

    A set is expanded after those it holds, and refused when it grows too long, so that sets of
    sets cannot multiply beyond reason.
    """
    default = _default_coupler(document, file)
    _check_names(document, ("train",), file, file.train)
    needs: dict[str, list[str]] = {}
    for name, each in file.sets.items():
        _check_names(document, ("sets", name, "items"), file, each.items)
        if each.coupler is not None:
            known(document, ("sets", name, "coupler"), "coupler", each.coupler, file.couplers)
        needs[name] = [item.set for item in each.items if item.set is not None]
    done: dict[str, Formation] = {}
    for name in in_order(document, "sets", needs, "holds"):
        each = file.sets[name]
        done[name] = _joined(
            document, ("sets", name, "items"), each.items, each.coupler or default, done
        )
    return _joined(document, ("train",), file.train, default, done)


def _default_coupler(document: Document, file: File) -> str:
    if file.coupler is not None:
        return known(document, ("coupler",), "coupler", file.coupler, file.couplers)
    if len(file.couplers) > 1:
        document.fail(
            (),
            f"'coupler' is missing: which of the {len(file.couplers)} couplers "
            f"({listing(file.couplers)}) joins vehicles where nothing else is said",
        )
    return next(iter(file.couplers))


def _check_names(document: Document, where: Path, file: File, items: Sequence[Item]) -> None:
    for index, item in enumerate(items):
        here = (*where, index)
        if item.vehicle is not None:
            known(document, (*here, "vehicle"), "vehicle", item.vehicle, file.vehicles)
        if item.set is not None:
            known(document, (*here, "set"), "set", item.set, file.sets)
        if item.coupler is not None:
            known(document, (*here, "coupler"), "coupler", item.coupler, file.couplers)


def _joined(
    document: Document,
    where: Path,
    items: Sequence[Item],
    coupler: str,
    sets: dict[str, Formation],
) -> Formation:
    """Return the items in a row: behind each is its own coupler, or else `coupler`."""
    whole, behind = Formation(), coupler
    for index, item in enumerate(items):
        part = Formation([item.vehicle]) if item.vehicle is not None else sets[item.set or ""]
        count = len(whole.vehicles) + item.times * len(part.vehicles)
        if count > LONGEST:
            document.fail(
                (*where, index),
                f"that makes {count} vehicles; a train has {SHORTEST} to {LONGEST}",
            )
        for _ in range(item.times):
            whole.append(part, behind, index)
            behind = item.coupler or coupler
    return whole
