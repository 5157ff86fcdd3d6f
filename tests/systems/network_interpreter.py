"""An interpreter of diagrams, written from what the documents say and not from the engine.

Nothing of railcosim is imported. It knows linear FMUs, whose steps it computes by the matrix
exponential, and a dozen kinds of blocks; time is in fractions. It is slow, and simple.

Nodes with direct feedthrough read from nodes before them or from nodes without it, so that their
order is that of evaluation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from tests.systems.master_references import linear_step
from tests.systems.network_nodes import CONTINUOUS, SAMPLED, SOURCES, Node, Values


@dataclass
class Scheme:
    """An algorithm: "two_phase", "jacobi", "gauss_seidel" or "iterated"."""

    kind: str
    extrapolation: int = 0
    order: Sequence[int] = ()


class Interpreter:
    """One run of a network with a base step h (s) from t0 (s) on."""

    def __init__(
        self, nodes: Sequence[Node], h: Fraction, scheme: Scheme, t0: Fraction = Fraction(0)
    ) -> None:
        self.nodes, self.h, self.scheme, self.t0 = nodes, h, scheme, t0
        self.fast = [i for i, node in enumerate(nodes) if node.is_fast]
        self.x = {i: node.start() for i, node in enumerate(nodes)}
        self.samples: dict[int, list[float]] = {
            i: [] for i, node in enumerate(nodes) if node.kind == "delay"
        }
        self.shown: Values = {}  # the present outputs of FMUs
        self.taken: dict[int, np.ndarray] = {}  # what slow FMUs hold
        self.computed: Values = {}  # what Jacobi's slaves show at their next hit
        self.last: tuple[Values, Fraction] | None = None  # FMU outputs one step ago, and its length
        self.reaching = {i for i in range(len(nodes)) if self._reaches(i)}

    def run(self, count: int) -> np.ndarray:
        """Return all signals at count + 1 ticks, in the order of nodes and ports."""
        self._initialise()
        rows = []
        for k in range(count + 1):
            values = self._outputs(k)
            rows.append([values[i, p] for i, n in enumerate(self.nodes) for p in range(n.ports)])
            if k < count:
                self._step(k, values)
                self._update(k, values)
        return np.array(rows)

    def _time(self, k: int) -> Fraction:
        return self.t0 + k * self.h

    # Start

    def _initialise(self) -> None:
        """Find the first outputs: FMUs that feed through take part in the order."""
        values: Values = {}
        later = [i for i, node in enumerate(self.nodes) if self._feeds_through(node, initial=True)]
        for i in (j for j in range(len(self.nodes)) if j not in later):
            self._put(values, i, self._alone(i, self.t0))
        for i in later:
            if self.nodes[i].kind == "fmu":
                u = [values[s] for s in self.nodes[i].inputs]
                self._put(values, i, self.nodes[i].shows(self.x[i], np.array(u)))
            else:
                self._put(values, i, self._apply(i, values)[0])
        self.shown = {(i, p): v for (i, p), v in values.items() if self.nodes[i].kind == "fmu"}
        self.computed = {s: v for s, v in values.items() if self._is_slave(s[0])}

    def _feeds_through(self, node: Node, *, initial: bool = False) -> bool:
        return node.feeds_through(self.h, initial=initial)

    def _is_slave(self, i: int) -> bool:
        return self.scheme.kind == "jacobi" and self.nodes[i].kind in CONTINUOUS + SAMPLED

    def _put(self, values: Values, i: int, outputs: Any) -> None:
        for p, value in enumerate(np.atleast_1d(outputs)):
            values[i, p] = float(value)

    # One node

    def _alone(self, i: int, t: Fraction, *, before: bool = False) -> Any:
        """Return outputs of a node without feedthrough; `before` a jump at t, if it has one."""
        node = self.nodes[i]
        match node.kind:
            case "fmu":
                if (i, 0) in self.shown:
                    return [self.shown[i, 0], self.shown[i, 1]]
                return node.shows(self.x[i], np.zeros(len(node.inputs)))
            case "leak":
                return self.x[i]
            case "delay":
                place = (t - node.p["time"] - self.t0) / self.h
                return node.delayed(place, self.samples[i], before=before)
            case _:
                return node.source(t)

    def _apply(self, i: int, values: Values) -> tuple[float, Any]:
        """Return output and next state of a node with feedthrough."""
        u = [values[s] for s in self.nodes[i].inputs]
        return self.nodes[i].apply(self.x[i], u, self.samples.get(i, ()), self.h)

    # Output phase

    def _outputs(self, k: int) -> Values:
        t = self._time(k)
        values: Values = {}
        for i, node in enumerate(self.nodes):
            if not self._feeds_through(node):
                at_hit = node.kind != "leak" or k % node.every == 0
                self._put(values, i, self._alone(i, t) if at_hit else self.held[i, 0])
        for i, node in enumerate(self.nodes):
            if self._feeds_through(node):
                if self._is_slave(i):
                    values[i, 0] = self.computed[i, 0] if k % node.every == 0 else self.held[i, 0]
                elif k % node.every == 0:
                    values[i, 0] = self._apply(i, values)[0]
                else:
                    values[i, 0] = self.held[i, 0]
        self.held = values
        for i in self.samples:
            self.samples[i].append(values[self.nodes[i].inputs[0]])
        return values

    def _update(self, k: int, values: Values) -> None:
        for i, node in enumerate(self.nodes):
            if k % node.every:
                continue
            if self._feeds_through(node):
                y, self.x[i] = self._apply(i, values)
                if self._is_slave(i):
                    self.computed[i, 0] = y
            elif node.kind == "leak":
                self.x[i] = node.p["share"] * self.x[i] + values[node.inputs[0]]

    # FMUs

    def _reaches(self, i: int) -> bool:
        """Return whether an FMU of every tick reads a node, through continuous blocks if any."""
        return any(
            any(source[0] == i for source in node.inputs)
            and (
                node.is_fast
                or (node.kind in CONTINUOUS and not self._is_slave(j) and self._reaches(j))
            )
            for j, node in enumerate(self.nodes)
        )

    def _jumps(self, k: int) -> list[Fraction]:
        """Return the times strictly inside tick k at which something jumps that an FMU reads."""
        begin, end = self._time(k), self._time(k + 1)
        found: set[Fraction] = set()
        for i in self.reaching:
            node, p = self.nodes[i], self.nodes[i].p
            if node.kind == "step":
                found.add(p["at"])
            elif node.kind == "pulse":
                found |= {p["at"], p["at"] + p["width"]}
            elif node.kind == "delay" and (p["time"] / self.h).denominator > 1:
                found.add(self.t0 + p["time"])  # the history's end
                u = self.samples[i]
                if p["hold"]:
                    edges = (j for j in range(1, len(u)) if u[j] != u[j - 1])
                    found |= {self._time(j) + p["time"] for j in edges}
        return sorted(t for t in found if begin < t < end)

    def _step(self, k: int, values: Values) -> None:
        places = [self._time(k), *self._jumps(k), self._time(k + 1)]
        self._slow_hits(k, values)
        at_tick = self._fast_outputs()
        for n, (a, b) in enumerate(pairwise(places)):
            if n:
                values = self._anew(a, values)
            before = self._fast_outputs()
            self._over(a, b, values)
            self.last = before, b - a
        self.last = at_tick, self.h  # (y_k − y_{k−1}) / h, wherever tick k was divided
        for i, node in enumerate(self.nodes):
            if node.kind == "fmu" and node.every > 1 and (k + 1) % node.every == 0:
                u = self.taken[i]
                span = float(node.every * self.h)
                self.x[i] = linear_step(
                    node.p["a"], node.p["b"], self.x[i], u, np.zeros(len(u)), span
                )
                self._put(self.shown, i, node.shows(self.x[i], u))

    def _fast_outputs(self) -> Values:
        return {s: v for s, v in self.shown.items() if s[0] in self.fast}

    def _slow_hits(self, k: int, values: Values) -> None:
        for i, node in enumerate(self.nodes):
            if node.kind == "fmu" and node.every > 1 and k % node.every == 0:
                self.taken[i] = np.array([values[s] for s in node.inputs])

    def _anew(self, t: Fraction, values: Values) -> Values:
        """Return the signals at a jump inside a tick: what is sampled stays."""
        values = dict(values)
        for i, node in enumerate(self.nodes):
            if node.is_fast or node.kind in SOURCES or node.kind == "delay":
                self._put(values, i, self._alone(i, t))
        return self._carried(values)

    def _carried(self, values: Values) -> Values:
        """Return signals with the continuous blocks computed from the others."""
        values = dict(values)
        for i, node in enumerate(self.nodes):
            if node.kind in CONTINUOUS and not self._is_slave(i):
                values[i, 0] = self._apply(i, values)[0]
        return values

    def _over(self, a: Fraction, b: Fraction, values: Values) -> None:
        """Step the FMUs of every tick from a to b, the signals at a given."""
        match self.scheme.kind:
            case "gauss_seidel":
                known: Values = {}
                for i in self.scheme.order or self.fast:
                    begin, end = self._lines(a, b, values, known)
                    x, y = self._fmu(i, begin, end, b - a)
                    self.x[i] = x
                    for p in range(2):
                        known[i, p] = float(y[p])
            case "iterated":
                known = self._agreed(a, b, values)
                begin, end = self._lines(a, b, values, known)
                for i in self.fast:
                    self.x[i] = self._fmu(i, begin, end, b - a)[0]
            case _:
                begin, end = self._lines(a, b, values, {})
                known = {}
                for i in self.fast:
                    self.x[i], y = self._fmu(i, begin, end, b - a)
                    known |= {(i, p): float(y[p]) for p in range(2)}
        self.shown |= known

    def _lines(
        self, a: Fraction, b: Fraction, values: Values, known: Values
    ) -> tuple[Values, Values]:
        """Return where the signals' lines over the step begin and end.

        `known` are FMU outputs at b.
        """
        if self.scheme.extrapolation == 0:
            held = self._carried(values | known)
            return held, held
        ahead = dict(values)
        for i, node in enumerate(self.nodes):
            if node.is_fast and self.last is not None:
                for p in range(2):
                    rate = (values[i, p] - self.last[0][i, p]) / float(self.last[1])
                    ahead[i, p] = values[i, p] + rate * float(b - a)
            elif node.kind == "ramp" or (
                node.kind == "delay" and not node.p["hold"] and not node.is_short(self.h)
            ):
                self._put(ahead, i, self._alone(i, b, before=True))
        return values, self._carried(ahead | known)

    def _fmu(
        self, i: int, begin: Values, end: Values, span: Fraction
    ) -> tuple[np.ndarray, np.ndarray]:
        node, h = self.nodes[i], float(span)
        u = np.array([begin[s] for s in node.inputs])
        goal = np.array([end[s] for s in node.inputs])
        x = linear_step(node.p["a"], node.p["b"], self.x[i], u, (goal - u) / h, h)
        return x, node.shows(x, goal)

    def _agreed(self, a: Fraction, b: Fraction, values: Values) -> Values:
        """Return the FMU outputs at b with which the step gives just these."""
        signals = [(i, p) for i in self.fast for p in range(2)]
        if not signals:
            return {}

        def results(z: np.ndarray) -> np.ndarray:
            begin, end = self._lines(a, b, values, dict(zip(signals, z.tolist(), strict=True)))
            return np.concatenate([self._fmu(i, begin, end, b - a)[1] for i in self.fast])

        z = np.array([values[s] for s in signals])
        for _ in range(30):
            base = results(z) - z
            if np.abs(base).max() < 1e-14:
                break
            step = 1e-3
            slopes = np.array([(results(z + step * e) - z - step * e - base) / step
                               for e in np.eye(len(z))]).T  # fmt: skip
            z = z - np.linalg.solve(slopes, base)
        return dict(zip(signals, z.tolist(), strict=True))
