"""Checks of derivatives by differences, and of the dependencies that the description lists."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import FmuError
from .places import Place, elsewhere
from .report import Nothing, Result, Unchecked

RELATIVE = 1e-6  # of the derivative, between the FMU's and the differences
MOST = 40  # knowns that are tried one by one at one place
STEPS = (1e-3, 1e-6, 1e-8)  # of a known's size; the narrow ones where the wide are too far
UNCHANGED = 1e-9  # of an unknown's size: what rounding in an iteration may do


@dataclass
class Slopes:
    """Directional derivatives against central differences, collected over places."""

    problems: dict[str, str] = field(default_factory=dict)
    compared: int = 0
    undecided: int = 0
    places: int = 0

    def visit(self, place: Place, generator: np.random.Generator) -> None:
        """Compare at the present values, for each known (some, if there are many) and for all."""
        unknowns = [n for n in place.unknowns if place.is_real(n)]
        knowns = [n for n in place.knowns if place.is_real(n) and place.is_listed(n)]
        if not unknowns or not knowns:
            return
        self.places += 1
        some = generator.permutation(len(knowns))[:MOST]
        for i in sorted(some.tolist()):
            self._one(place, knowns[i], unknowns)
        self._all(place, [knowns[i] for i in some], unknowns, generator)

    def _one(self, place: Place, known: str, unknowns: list[str]) -> None:
        k = place.knowns.index(known)
        size = place.subject.size(known, place.values[k])
        low, high = place.limits(known)
        centre = place.values.copy()
        reach = 2.0 * STEPS[0] * size
        if high - low > 2.0 * reach:
            centre[k] = min(max(centre[k], low + reach), high - reach)
        elif high > low:
            centre[k] = 0.5 * (low + high)
            size = (high - low) / 8.0 / STEPS[0]
        else:
            return
        try:
            place.set(centre)
            found = place.instance.directional(unknowns, [known], [1.0])
            self._compare(place, centre, k, size, found, unknowns)
            place.set(place.values)
        except FmuError as error:
            place.recover()
            refused = "DirectionalDerivative" in str(error)
            if refused and place.subject.variables[known].causality != "parameter":
                self.problems[f"{known}!"] = f"along {known}: {error}"
            else:  # FMI does not ask for derivatives by parameters
                self.undecided += len(unknowns)

    def _compare(
        self, place: Place, centre: np.ndarray, k: int, size: float, found: np.ndarray,
        unknowns: list[str],
    ) -> None:  # fmt: skip
        rows = [place.unknowns.index(n) for n in unknowns]
        open_, known = np.isfinite(found), place.knowns[k]
        for i in np.flatnonzero(~open_):
            text = f"∂{unknowns[i]}/∂{known} is {found[i]}"
            self.problems.setdefault(f"{unknowns[i]}/{known}", text)
        other = np.full(len(found), np.nan)
        for step in STEPS:  # a wide one may reach over a narrow band: then a narrower one agrees
            if not open_.any():
                break
            slope, bend, noise, scale = _difference(place, centre, k, step * size, rows)
            scale = np.fmax(scale, np.abs(found))
            clear = open_ & (noise <= 1e-3 * scale)
            decided = clear & (bend + noise <= 1e-3 * scale)
            agree = decided & (np.abs(found - slope) <= RELATIVE * scale + bend + noise)
            # Where a narrower step shows a kink, what a wider one gave means nothing.
            other = np.where(decided, slope, np.where(clear, np.nan, other))
            self.compared += int(agree.sum())
            open_ &= ~agree
        wrong = open_ & ~np.isnan(other)
        for i in np.flatnonzero(wrong):
            text = f"∂{unknowns[i]}/∂{known} is {found[i]:.9g}, by differences {other[i]:.9g}"
            self.problems.setdefault(f"{unknowns[i]}/{known}", text)
        self.undecided += int((open_ & ~wrong).sum())

    def _all(
        self, place: Place, knowns: list[str], unknowns: list[str], generator: np.random.Generator
    ) -> None:
        """The derivative along a seed is the sum over the knowns."""
        seed = generator.uniform(-1.0, 1.0, len(knowns))
        try:
            whole = place.instance.directional(unknowns, knowns, seed)
            parts = np.array(
                [s * place.instance.directional(unknowns, [n], [1.0])
                 for s, n in zip(seed, knowns, strict=True)]
            )  # fmt: skip
        except FmuError:  # told above, for the known that is refused
            place.recover()
            return
        allowed = 1e-9 * np.abs(parts).sum(axis=0) + 1e-300
        for i in np.flatnonzero(~(np.abs(whole - parts.sum(axis=0)) <= allowed)):
            text = f"the derivative of {unknowns[i]} along a seed is not the sum over the knowns"
            self.problems.setdefault(f"{unknowns[i]}+", text)

    def result(self) -> Result:
        """Return the rule's result over all places."""
        if not self.compared and not self.problems:
            if not self.undecided:
                raise Nothing("no real unknown depends on a real known")
            raise Unchecked("the unknowns are not smooth enough for differences")
        text = f"{self.compared} at {self.places} places agree with differences to {RELATIVE:g}"
        return list(self.problems.values()), text + (
            f" ({self.undecided} could not be told)" if self.undecided else ""
        )


def _difference(
    place: Place, centre: np.ndarray, k: int, h: float, rows: list[int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the central difference, its doubt by bends and by rounding, and its scale."""

    def sample(offset: float) -> np.ndarray:
        values = centre.copy()
        values[k] += offset
        return place.at(values)[rows]

    middle, steps = sample(0.0), (h, 0.5 * h)
    above, below = ([sample(sign * s) for s in steps] for sign in (1.0, -1.0))
    wide, narrow = ((a - b) / (2.0 * s) for a, b, s in zip(above, below, steps, strict=True))
    # Left and right slopes differ in proportion to the step, but at a kink by the same.
    bend, half_bend = (
        (a - 2.0 * middle + b) / s for a, b, s in zip(above, below, steps, strict=True)
    )
    size = np.abs(middle)
    doubt = np.abs(narrow - wide) + np.abs(2.0 * half_bend - bend)
    noise = 100.0 * np.finfo(float).eps * size / h
    slope = (4.0 * narrow - wide) / 3.0
    scale = np.maximum(np.abs(slope), 1e-6 * size / max(abs(centre[k]), h))
    return slope, np.nan_to_num(doubt, nan=np.inf), noise, scale + 1e-300


@dataclass
class Dependencies:
    """Unknowns against the knowns that the description does not list for them."""

    problems: Counter[str] = field(default_factory=Counter)
    tried: int = 0
    places: int = 0

    def visit(self, place: Place, generator: np.random.Generator) -> None:
        """Change each known in turn, and see whether another unknown than listed changes."""
        listed = [n for n in place.unknowns if n in place.depends]
        if not listed or not place.knowns:
            return
        self.places += 1
        before = _values(place, listed, place.values)
        some = generator.permutation(len(place.knowns))[: 3 * MOST]
        for k in sorted(some.tolist()):
            known = place.knowns[k]
            free = [i for i, n in enumerate(listed) if known not in place.depends[n] and n != known]
            values = place.values.copy()
            values[k] = elsewhere(place, k, generator)
            if not free or values[k] == place.values[k] or not np.isfinite(before).all():
                continue
            after = _values(place, listed, values)
            if not np.isfinite(after).all():
                continue
            self.tried += len(free)
            allowed = UNCHANGED * np.maximum(np.abs(before), 1e-6)
            for i in free:
                if not abs(after[i] - before[i]) <= allowed[i]:
                    self.problems[f"{listed[i]} depends on {known}, which is not listed"] += 1
        place.set(place.values)

    def result(self) -> Result:
        """Return the rule's result over all places."""
        if not self.places:
            raise Nothing("the description lists no dependencies")
        text = f"{self.tried} that are not listed have no effect"
        return list(self.problems), text if self.tried else "all are listed"


def _values(place: Place, names: list[str], values: np.ndarray) -> np.ndarray:
    """Return unknowns, as NaN where the FMU cannot compute them."""
    try:
        found = place.at(values)
    except FmuError:
        place.recover()
        return np.full(len(names), np.nan)
    return found[[place.unknowns.index(n) for n in names]]
