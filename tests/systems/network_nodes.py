"""The nodes of the network interpreter: what each kind of block gives, by its definition.

A node's inputs are (node, port) pairs. Nothing of railcosim is imported.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

Signal = tuple[int, int]
Values = dict[Signal, float]

SOURCES = ("constant", "step", "pulse", "ramp")
CONTINUOUS = ("gain", "sum", "saturation")  # and without a state: taken anew within a step
SAMPLED = ("hold", "low_pass")  # with feedthrough, held between hits


@dataclass
class Node:
    """One block: its kind, its parameters, what drives it, and its hits (every `every` ticks)."""

    kind: str
    p: dict[str, Any]
    inputs: list[Signal] = field(default_factory=list)
    every: int = 1

    @property
    def is_fast(self) -> bool:
        """Whether this is an FMU that steps at every tick."""
        return self.kind == "fmu" and self.every == 1

    @property
    def ports(self) -> int:
        """The number of outputs."""
        return 2 if self.kind == "fmu" else 1

    def start(self) -> Any:
        """Return the state at the start."""
        if self.kind == "fmu":
            return np.array(self.p["x"], dtype=float)
        return self.p.get("x", 0.0)

    def is_short(self, h: Fraction) -> bool:
        """Return whether this is a delay that needs its present input, for a step h."""
        return self.kind == "delay" and (
            self.p["time"] == 0 or (self.p["time"] < h and not self.p["hold"])
        )

    def feeds_through(self, h: Fraction, *, initial: bool = False) -> bool:
        """Return whether outputs need present inputs; those of FMUs only at the start."""
        if self.kind == "fmu":
            return initial and bool(np.any(self.p["d"]))
        return self.kind in CONTINUOUS + SAMPLED or self.is_short(h)

    def shows(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return an FMU's outputs."""
        return self.p["c"] @ x + self.p["d"] @ u

    def source(self, t: Fraction) -> float:
        """Return a source's value at t."""
        p = self.p
        match self.kind:
            case "step":
                return p["to"] if t >= p["at"] else p["before"]
            case "pulse":
                return p["height"] if p["at"] <= t < p["at"] + p["width"] else p["base"]
            case "ramp":
                return p["initial"] + p["slope"] * float(max(t - p["at"], Fraction(0)))
            case _:
                return p["value"]

    def delayed(self, place: Fraction, samples: Sequence[float], *, before: bool) -> float:
        """Return a delay's output for a place in its samples; `before` a jump just there."""
        if place < 0 or (before and place == 0):
            return self.p["initial"]
        whole = place.numerator // place.denominator
        part = float(place - whole)
        if self.p["hold"] or not part or whole + 1 == len(samples):
            return samples[whole]  # a delay samples at ticks: behind the last sample it holds
        return samples[whole] + part * (samples[whole + 1] - samples[whole])

    def apply(
        self, x: Any, u: Sequence[float], samples: Sequence[float], h: Fraction
    ) -> tuple[float, Any]:
        """Return output and next state of a node with feedthrough, at a tick."""
        p = self.p
        match self.kind:
            case "gain":
                y = p["k"] * u[0]
            case "sum":
                y = sum(s * v for s, v in zip(p["signs"], u, strict=True))
            case "saturation":
                y = min(max(u[0], p["low"]), p["high"])
            case "low_pass":
                y = x = p["share"] * x + (1.0 - p["share"]) * u[0]
            case "delay" if p["time"]:
                part = float(p["time"] / h)
                y = u[0] + part * (samples[-1] - u[0]) if samples else p["initial"]
            case _:
                y = u[0]
        return y, x
