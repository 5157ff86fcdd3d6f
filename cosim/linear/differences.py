"""The linear map of a Python block by central differences, and whether it has one.

Where a block is linear a wide step gives its slopes to rounding; beside a limit only a narrow step
sees past it. So steps of several widths are tried, each with its half, and for each slope the one
is taken whose two widths and two sides agree best. Where none agree the block jumps or bends there.
A jump within a thousandth is told by a warning: the slope beside it says nothing of it.
"""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..block import Block
from ..plan import Node
from .block import LinearBlock, LinearisationError

_STEPS = (2.0**-4, 2.0**-10, 2.0**-16, 2.0**-22)  # of the value's size
_STRAIGHT = 1e-4  # of the slope: how far slopes of two widths, or on two sides, may differ
_NEAR = _STEPS[1]  # a jump within this step is told
_JUMP = 1e-5  # of the change over an interval: what is left of a jump as that shrinks
_LIKE = 1e-3  # of the slopes: how far those of the next hit may differ at the start
_EPS = float(np.finfo(float).eps)


def python_map(
    node: Node, state: Any, inputs: Sequence[float], time: float, *, is_first: bool = False
) -> LinearBlock:
    """Return the map of a Python block at a state, inputs and time (s).

    States are the state's floats; its whole numbers and truth values are modes, which stay. Raise
    LinearisationError where the block jumps or bends just at the operating point, where its first
    hit or a change of mode makes the next hit another one, or its state is no nested tuple of
    numbers.
    """
    if node.block.run_by_engine:
        kind = type(node.block).__name__
        raise LinearisationError(f"block '{node.name}': linearise() does not know {kind} blocks")
    hit = _Hit(node, state, inputs, time)
    J = _jacobian(hit)
    if is_first or hit.changes_mode:
        following = _jacobian(_Hit(node, hit.following, inputs, time))
        largest = np.fmax(np.abs(J), np.abs(following)).max(axis=1, initial=0.0, keepdims=True)
        if (np.abs(J - following) > _LIKE * largest).any():
            raise LinearisationError(
                f"{hit.where} does something else at its next sample hit; linearise "
                + ("later, when its start is over" if is_first else "where its modes stay")
            )
    p, n = len(node.outputs), len(hit.real)
    return LinearBlock(J[p:, :n], J[p:, n:], J[:p, :n], J[:p, n:], hit.states)


class _Hit:
    """A Python block at a sample hit as a function of one vector: (x, u) -> (y, x⁺)."""

    def __init__(self, node: Node, state: Any, inputs: Sequence[float], time: float) -> None:
        self.node, self.state, self.time = node, state, time
        self.where = f"block '{node.name}' at t = {time:.9g} s"
        with self._failures():
            _, self.following = _outputs_and_next(node.block, state, time, inputs)
        leaves, after = list(_leaves(state)), list(_leaves(self.following))
        if [path for path, _ in leaves] != [path for path, _ in after]:
            raise LinearisationError(f"{self.where}: its state changes its shape; linearise later")
        for _, value in leaves:
            if not isinstance(value, bool | int | float | np.number | str | None):
                raise LinearisationError(
                    f"{self.where}: its state holds a {type(value).__name__}; linearise() needs "
                    "a (nested) tuple of numbers"
                )
        pairs = enumerate(zip(leaves, after, strict=True))
        self.real = [i for i, (a, b) in pairs if _is_real(a[1], b[1])]
        self.states = tuple(f"{node.name}.x{leaves[i][0]}" for i in self.real)
        self.values = [value for _, value in leaves]
        modes = set(range(len(leaves))) - set(self.real)
        self.changes_mode = any(leaves[i][1] != after[i][1] for i in modes)
        self.point = [*(float(self.values[i]) for i in self.real), *map(float, inputs)]

    def __call__(self, point: Sequence[float]) -> np.ndarray:
        """Return (y, x⁺); raise LinearisationError where the block cannot be evaluated."""
        n, values = len(self.real), list(self.values)
        for i, value in zip(self.real, point[:n], strict=True):
            values[i] = value
        state = _rebuilt(self.state, iter(values))
        with self._failures():
            y, following = _outputs_and_next(self.node.block, state, self.time, point[n:])
            after = [value for _, value in _leaves(following)]
            return np.array([*y, *(after[i] for i in self.real)], float)

    @contextmanager
    def _failures(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            raise LinearisationError(
                f"{self.where} cannot be evaluated beside its operating point: "
                f"{type(error).__name__}: {error}"
            ) from error

    def refuse(self, row: int, i: int, below: float, above: float) -> None:
        """Raise for an output or state (`row`) that jumps or bends along state or input `i`."""
        changed, along = self._words(row, i)
        raise LinearisationError(
            f"{self.where}: {changed} jumps or bends where {along} is {self.point[i]:g} (slope "
            f"{below:.3g} below, {above:.3g} above); linearise at another time, or put a smooth "
            "block in its place"
        )

    def warn(self, row: int, i: int, place: float) -> None:
        """Warn of a jump of an output or state (`row`) where state or input `i` is at `place`."""
        changed, along = self._words(row, i)
        warnings.warn(
            f"{self.where}: {changed} jumps where {along} is {place:g}, near its "
            f"{self.point[i]:g}; the linear map does not know of it",
            stacklevel=2,
        )

    def _words(self, row: int, i: int) -> tuple[str, str]:
        states = [f"state {name}" for name in self.states]
        changed = [*(f"output '{port}'" for port in self.node.block.outputs), *states]
        along = [*states, *(f"input '{port}'" for port in self.node.block.inputs)]
        return changed[row], along[i]


def _outputs_and_next(
    block: Block, state: Any, time: float, inputs: Sequence[float]
) -> tuple[tuple[Any, ...], Any]:
    x = (state, time) if block.timed else (state,)
    if block.feedthrough:
        y, following = block.step(*x, *inputs)
    else:
        y = block.output(*x) if block.outputs else ()
        moves = type(block).update is not Block.update
        following = block.update(*x, *inputs) if moves else state
    return (y if isinstance(y, tuple) else (y,))[: len(block.outputs)], following


def _is_real(value: Any, following: Any) -> bool:
    """Whether a leaf is a finite float, or the whole number that one begins with."""
    is_float = any(isinstance(v, float | np.floating) for v in (value, following))
    return is_float and isinstance(value, int | float | np.number) and bool(np.isfinite(value))


def _leaves(state: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (path, value) of a nested tuple's leaves in order."""
    if isinstance(state, tuple):
        for i, part in enumerate(state):
            yield from _leaves(part, f"{path}[{i}]")
    else:
        yield path, state


def _rebuilt(like: Any, values: Iterator[Any]) -> Any:
    """Return a state of the same shape with other leaves."""
    if not isinstance(like, tuple):
        return next(values)
    parts = [_rebuilt(part, values) for part in like]
    make = getattr(like, "_make", type(like))  # a named tuple takes its fields one by one
    return make(parts)


def _jacobian(hit: _Hit) -> np.ndarray:
    """Return the Jacobian of a hit, one row for each output and each state."""
    rows = len(hit.node.outputs) + len(hit.real)
    if not hit.point:
        return np.zeros((rows, 0))
    middle = hit(hit.point)
    return np.column_stack([_column(hit, i, middle) for i in range(len(hit.point))])


def _column(hit: _Hit, i: int, middle: np.ndarray) -> np.ndarray:
    """Return the slopes along one variable, each from the step that tells it best."""
    size = 2.0 ** float(np.ceil(np.log2(max(abs(hit.point[i]), 1.0))))
    slope, doubt = np.full(len(middle), np.nan), np.full(len(middle), np.inf)
    steepest, smooth = np.zeros(len(middle)), np.zeros(len(middle), dtype=bool)
    found = _differences(hit, i, middle, size)
    for step, one in found.items():
        # Of this and wider steps: of a jump the slopes grow as the steps shrink.
        steepest = np.fmax(steepest, one.steepness)
        straight = one.spread <= _STRAIGHT * steepest + one.noise
        smooth |= straight & (step >= _NEAR)
        better = straight & (one.spread + one.noise < doubt)
        slope[better] = one.slope[better]
        doubt[better] = (one.spread + one.noise)[better]
    # Large numbers inside may leave rounding where nothing changes.
    rounding = 32.0 * _EPS * float(np.max(np.abs([*middle, *hit.point, 1.0])))
    flat = np.max([one.change for one in found.values()], axis=0) <= rounding
    slope[np.isnan(slope) & flat] = 0.0
    for row in np.flatnonzero(np.isnan(slope)):
        below, above = found[_STEPS[-1]].sides
        hit.refuse(int(row), i, below[row], above[row])
    for row in np.flatnonzero(~smooth & ~flat) if _NEAR in found else ():
        place = _jump(hit, i, int(row), _NEAR * size)
        if place is not None:
            hit.warn(int(row), i, place)
    return slope


def _jump(hit: _Hit, i: int, row: int, h: float) -> float | None:
    """Return where within ±h the value of a row jumps along one variable; None if nowhere."""

    def value(place: float) -> float:
        return float(hit([*hit.point[:i], place, *hit.point[i + 1 :]])[row])

    places = [hit.point[i] + part * h for part in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    ends = [(place, value(place)) for place in places]
    low, high = max(pairwise(ends), key=_change)
    whole = _change((low, high))
    for _ in range(45):
        place = 0.5 * (low[0] + high[0])
        middle = (place, value(place))
        low, high = max([(low, middle), (middle, high)], key=_change)
    return low[0] if _change((low, high)) > _JUMP * whole else None


def _change(interval: tuple[tuple[float, float], tuple[float, float]]) -> float:
    return abs(interval[1][1] - interval[0][1])


@dataclass(frozen=True)
class _Difference:
    """Slopes along one variable from samples at a step and at half of it."""

    slope: np.ndarray  # extrapolated to a step of zero
    spread: np.ndarray  # how far the two widths, and the two sides, disagree
    noise: np.ndarray  # of slopes, by rounding
    steepness: np.ndarray
    change: np.ndarray  # the largest, of the values
    sides: tuple[np.ndarray, np.ndarray]  # slopes below and above


def _differences(hit: _Hit, i: int, middle: np.ndarray, size: float) -> dict[float, _Difference]:
    """Return the differences by step, from wide to narrow; a wide one may leave the domain."""
    found: dict[float, _Difference] = {}
    for step in _STEPS:
        try:
            with np.errstate(all="ignore"):
                found[step] = _difference(hit, i, middle, step * size)
        except LinearisationError:
            if step == _STEPS[-1]:
                raise
    return found


def _difference(hit: _Hit, i: int, middle: np.ndarray, h: float) -> _Difference:
    def sample(offset: float) -> np.ndarray:
        point = list(hit.point)
        point[i] += offset
        return hit(point)

    above, below, half_above, half_below = (sample(s * h) for s in (1.0, -1.0, 0.5, -0.5))
    wide, narrow = (above - below) / (2.0 * h), (half_above - half_below) / h
    # The slopes of the two sides differ in proportion to the step, but at a bend by the same.
    bend = (above - 2.0 * middle + below) / h
    half_bend = (half_above - 2.0 * middle + half_below) / (0.5 * h)
    samples = np.abs([above, below, half_above, half_below, middle])
    size = np.fmax(samples.max(axis=0), np.abs(wide * hit.point[i]))
    return _Difference(
        slope=(4.0 * narrow - wide) / 3.0,
        spread=np.abs(narrow - wide) + np.abs(2.0 * half_bend - bend),
        noise=16.0 * _EPS * size / h,
        steepness=np.fmax(np.abs(wide), np.abs(bend)),
        change=np.fmax(np.abs(above - middle), np.abs(below - middle)),
        sides=((middle - half_below) / (0.5 * h), (half_above - middle) / (0.5 * h)),
    )
