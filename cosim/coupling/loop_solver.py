"""An algebraic loop of Python blocks (and delays below one step), solved at each tick."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.errors import ConvergenceError, RailcosimError
from ..algorithms import Solver
from ..blocks.delay import Delay
from ..order import ordered
from ..plan import Node, Plan
from ..schedule.delays import delayed
from .algebraic import solve, start_values


class BlockError(Exception):
    """A block failed while the engine called it for others; the cause says how."""

    def __init__(self, node: str) -> None:
        super().__init__(node)
        self.node = node


def numbers(node: Node, result: Any) -> Sequence[Any]:
    """Return a block's outputs as a sequence; raise BlockError for what is no number."""
    results: Sequence[Any] = result if len(node.outputs) > 1 else (result,)
    try:
        if len(results) != len(node.outputs):
            raise TypeError(f"{len(results)} outputs, {len(node.outputs)} are declared")
        for port, value in zip(node.block.outputs, results, strict=True):
            if isinstance(value, str) or not hasattr(value, "__float__"):
                raise TypeError(f"output '{port}' is {value!r}, which is no number")
            float(value)
    except (TypeError, ValueError) as error:
        raise BlockError(node.name) from error
    return results


class LoopSolver:
    """Finds the signals at which all blocks of a loop agree.

    The unknowns are those signals that a block reads before the loop's order has given them.
    Blocks that have no hit at a tick keep their outputs, and so the loop may be open there.
    """

    def __init__(self, plan: Plan, loop: range, solver: Solver) -> None:
        self.plan, self.solver = plan, solver
        self.nodes = [plan.nodes[i] for i in loop]
        self.inside = [j for node in self.nodes for j in node.outputs]
        self._sequence = self._ordered()
        read = dict.fromkeys(j for node in self.nodes for j in node.inputs)
        self.outside = [j for j in read if j not in self.inside]
        self._current = ""

    def _ordered(self) -> tuple[int, ...]:
        """Return the order of evaluation: one in which what has a guess is read before given."""
        signals, guess = self.plan.signals, self.solver.guess
        guessed = {j for j in self.inside if signals[j] in guess}
        if not guessed:
            return tuple(range(len(self.nodes)))
        maker = {j: node.name for node in self.nodes for j in node.outputs}
        needs = {
            node.name: {maker[j] for j in node.direct if j in maker and j not in guessed}
            for node in self.nodes
        }
        place = {node.name: i for i, node in enumerate(self.nodes)}
        return tuple(place[name] for group in ordered(needs) for name in group)

    def solve(self, k: int, *values: Any) -> tuple[Any, ...]:
        """Return (states, signals inside) of tick k, from states, signals outside and inside.

        Raise ConvergenceError, or BlockError for a block that fails.
        """
        n = len(self.nodes)
        states, signals = values[:n], values[n:]
        known = dict(zip((*self.outside, *self.inside), signals, strict=True))
        hits = [k % node.ticks == 0 for node in self.nodes]
        torn = self._torn(hits)
        t = self.plan.clock.time(k)
        found: list[Any] = []

        def around(z: np.ndarray) -> np.ndarray:
            trial = known | dict(zip(torn, z.tolist(), strict=True))
            found[:] = [self._once(k, t, hits, states, trial), trial]
            return np.array([float(trial[j]) for j in torn])

        if not torn:
            around(np.empty(0))
        else:
            names = [self.plan.signals[j] for j in torn]
            present = [float(known[j]) for j in torn]
            guess = present if k else start_values(self.solver, names, present)
            where = (
                f"algebraic loop of {', '.join(node.name for node in self.nodes)} at t = {t:.9g} s"
            )
            try:
                solve(
                    around,
                    np.array(guess),
                    self.solver,
                    names=names,
                    where=where,
                    begins=not k,
                )
            except (ArithmeticError, ValueError) as error:
                raise BlockError(self._current) from error
            except ConvergenceError:
                around(np.array(guess))
                self._require_finite(found[1])
                raise
        after, trial = found
        return (*after, *(trial[j] for j in self.inside))

    def _require_finite(self, trial: dict[int, Any]) -> None:
        """Raise BlockError for the first block that gives nan or infinity from the start."""
        for i in self._sequence:
            node = self.nodes[i]
            for port, j in zip(node.block.outputs, node.outputs, strict=True):
                if not math.isfinite(trial[j]):
                    raise BlockError(node.name) from ValueError(f"output '{port}' is {trial[j]!r}")

    def _torn(self, hits: Sequence[bool]) -> list[int]:
        """Return the signals that are read, in the order of evaluation, before they are given."""
        active = [self.nodes[i] for i in self._sequence if hits[i]]
        to_come = {j for node in active for j in node.outputs}
        given: set[int] = set()
        torn: dict[int, None] = {}
        for node in active:
            torn |= dict.fromkeys(j for j in node.direct if j in to_come and j not in given)
            given |= set(node.outputs)
        return list(torn)

    def _once(
        self, k: int, t: float, hits: Sequence[bool], states: Sequence[Any], trial: dict[int, Any]
    ) -> list[Any]:
        """Evaluate the blocks in order, writing signals into `trial`; return the states."""
        after = list(states)
        for i in self._sequence:
            if not hits[i]:
                continue
            node = self.nodes[i]
            block = node.block
            inputs = [trial[j] for j in node.inputs]
            if isinstance(block, Delay):
                step = self.plan.clock.step
                trial[node.outputs[0]] = delayed(node, states[i], k, inputs[0], t, step)
                continue
            time = (t,) if block.timed else ()
            self._current = node.name
            try:
                if block.feedthrough:
                    result, after[i] = block.step(states[i], *time, *inputs)
                else:
                    direct = (trial[j] for j in node.direct)
                    result = block.output(states[i], *time, *direct)
                trial |= zip(node.outputs, numbers(node, result), strict=True)
            except (BlockError, ArithmeticError, ValueError, RailcosimError):
                raise
            except (Exception, SystemExit) as error:
                raise BlockError(node.name) from error
        return after
