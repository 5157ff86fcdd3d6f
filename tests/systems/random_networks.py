"""Random networks of FMUs, blocks and delays: for the interpreter, and as diagrams."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from railcosim import (
    Block,
    Constant,
    Delay,
    Diagram,
    Fmu,
    Gain,
    Hold,
    Pulse,
    Ramp,
    Saturation,
    Step,
    Sum,
)
from railcosim.fmus import build
from tests import coupled_plants
from tests.systems.network_nodes import Node

COUNT = 40


@dataclass(frozen=True)
class LowPass(Block):
    """y = share · y before + (1 − share) · u."""

    share: float
    x: float
    period: float
    inputs = {"u": "1"}
    outputs = {"y": "1"}

    def start(self) -> Any:
        return self.x

    def step(self, x: Any, u: float) -> Any:
        y = self.share * x + (1.0 - self.share) * u
        return y, y


@dataclass(frozen=True)
class Leak(Block):
    """y before is reduced to its share, and u is added."""

    share: float
    x: float
    period: float
    inputs = {"u": "1"}
    outputs = {"y": "1"}
    feedthrough = False

    def start(self) -> Any:
        return self.x

    def output(self, x: Any) -> Any:
        return x

    def update(self, x: Any, u: float) -> Any:
        return self.share * x + u


class Maker:
    """A random network.

    `events` allows jumps between ticks, `slow` FMUs with longer periods, `short` delays below the
    step.
    """

    def __init__(self, seed: int, *, events: bool, slow: bool, short: bool = False) -> None:
        self.short = short
        self.rng = np.random.default_rng(seed)
        self.h = Fraction(1, int(self.rng.choice([10, 20, 30])))
        self.events, self.slow = events, slow

    def number(self, size: float = 1.0) -> float:
        return float(np.round(self.rng.uniform(-size, size), 6))

    def moment(self) -> Fraction:
        """Return a time in the run: on a tick, or if events are allowed anywhere."""
        if self.events and self.rng.random() < 0.7:
            return Fraction(int(self.rng.integers(1, 20000)), 10007)
        return self.h * int(self.rng.integers(0, COUNT))

    def network(self) -> list[Node]:
        kinds = ["fmu"] * int(self.rng.integers(2, 5))
        kinds += list(self.rng.choice(["step", "pulse", "ramp", "constant"], 2))
        kinds += ["delay"] * int(self.rng.integers(1, 4))
        choice = ["gain", "sum", "saturation", "hold", "low_pass", "leak", "gain", "sum"]
        kinds += list(self.rng.choice(choice, int(self.rng.integers(4, 9))))
        self.rng.shuffle(kinds)
        nodes = [self.node(str(kind)) for kind in kinds]
        for i, node in enumerate(nodes):
            node.inputs = [self.source(nodes, i) for _ in range(self.arity(node))]
        return nodes

    def arity(self, node: Node) -> int:
        if node.kind == "fmu":
            return 2
        if node.kind == "sum":
            return len(node.p["signs"])
        return 0 if node.kind in ("constant", "step", "pulse", "ramp") else 1

    def needs_inputs(self, node: Node) -> bool:
        """Return whether a node may take part in a loop, at the start or later."""
        return node.feeds_through(self.h, initial=True)

    def source(self, nodes: list[Node], i: int) -> tuple[int, int]:
        """Return a signal for an input of node i that closes no algebraic loop."""
        allowed = [
            j for j, node in enumerate(nodes)
            if not self.needs_inputs(node) or (j < i or not self.needs_inputs(nodes[i]))
        ]  # fmt: skip
        j = int(self.rng.choice(allowed))
        return j, int(self.rng.integers(nodes[j].ports))

    def node(self, kind: str) -> Node:
        made = {
            "fmu": self.fmu, "step": self.step, "pulse": self.pulse, "ramp": self.ramp,
            "delay": self.delay,
            "constant": lambda: {"value": self.number()},
            "gain": lambda: {"k": self.number()},
            "sum": lambda: {"signs": self.rng.choice([-1, 1], self.rng.integers(2, 4)).tolist()},
            "saturation": lambda: {"low": -0.5, "high": 0.4},
            "hold": dict,
            "low_pass": lambda: {"share": 0.6, "x": self.number()},
            "leak": lambda: {"share": 0.6, "x": self.number()},
        }[kind]()  # fmt: skip
        has_period = kind in ("hold", "low_pass", "leak") or (kind == "fmu" and self.slow)
        return Node(kind, made, every=int(self.rng.choice([1, 1, 2, 3])) if has_period else 1)

    def matrix(self, size: float) -> np.ndarray:
        return np.array([[self.number(size) for _ in range(2)] for _ in range(2)])

    def fmu(self) -> dict[str, Any]:
        has_feedthrough = self.rng.random() < 0.5
        return {
            "a": self.matrix(0.7) - np.eye(2), "b": self.matrix(0.8), "c": self.matrix(0.8),
            "d": self.matrix(0.3) if has_feedthrough else np.zeros((2, 2)),
            "x": [self.number(), self.number()],
        }  # fmt: skip

    def step(self) -> dict[str, Any]:
        return {"at": self.moment(), "to": self.number(), "before": 0.3}

    def pulse(self) -> dict[str, Any]:
        width = self.h * int(self.rng.integers(1, 9))
        if self.events:
            width = Fraction(int(self.rng.integers(1, 4000)), 9973)
        return {"at": self.moment(), "width": width, "height": self.number(2.0), "base": 0.0}

    def ramp(self) -> dict[str, Any]:
        at = self.h * int(self.rng.integers(0, COUNT))
        return {"at": at, "slope": self.number(), "initial": self.number()}

    def delay(self) -> dict[str, Any]:
        time = self.h * int(self.rng.integers(1, 12))
        is_held = bool(self.rng.random() < 0.5)
        if self.short and self.rng.random() < 0.7:
            parts = ["0"] if is_held else ["0", "0.25", "0.9"]  # held, others have edges
            time = self.h * Fraction(str(self.rng.choice(parts)))
        elif self.events and self.rng.random() < 0.6:
            time += Fraction(int(self.rng.integers(1, 500)), 10009)
        return {"time": time, "hold": is_held, "initial": self.number()}


def block(node: Node, h: Fraction) -> Block:
    """Return a node as a block of railcosim."""
    p, period = node.p, float(node.every * h)
    makers: dict[str, Callable[[], Block]] = {
        "fmu": lambda: _fmu(node, period),
        "constant": lambda: Constant(p["value"]),
        "step": lambda: Step(at=float(p["at"]), to=p["to"], before=p["before"]),
        "pulse": lambda: Pulse(
            at=float(p["at"]), width=float(p["width"]), height=p["height"], base=p["base"]
        ),
        "ramp": lambda: Ramp(slope=p["slope"], at=float(p["at"]), initial=p["initial"]),
        "delay": lambda: Delay(
            float(p["time"]), initial=p["initial"],
            interpolation="hold" if p["hold"] else "linear",
        ),
        "gain": lambda: Gain(p["k"]),
        "sum": lambda: Sum("".join("+" if s > 0 else "-" for s in p["signs"])),
        "saturation": lambda: Saturation((p["low"], p["high"])),
        "hold": lambda: Hold(period),
        "low_pass": lambda: LowPass(p["share"], p["x"], period),
        "leak": lambda: Leak(p["share"], p["x"], period),
    }  # fmt: skip
    return makers[node.kind]()


def _fmu(node: Node, period: float) -> Fmu:
    p = node.p
    is_direct = bool(np.any(p["d"]))
    plant = coupled_plants.linear_direct() if is_direct else coupled_plants.linear()
    matrices = {letter: p[letter].flatten().tolist() for letter in ("abcd" if is_direct else "abc")}
    options: dict[str, Any] = {"period": period} if node.every > 1 else {}
    return Fmu(_built(plant), x1=p["x"][0], x2=p["x"][1], **matrices, **options)


_paths: dict[str, Any] = {}


def _built(plant: Any) -> Any:
    if plant.name not in _paths:
        _paths[plant.name] = build(plant)
    return _paths[plant.name]


def diagram(nodes: list[Node], h: Fraction) -> Diagram:
    made = Diagram("network", step=h)
    for i, node in enumerate(nodes):
        made.add(f"n{i}", block(node, h))
    for i, node in enumerate(nodes):
        for target, (j, p) in zip(made.blocks[f"n{i}"].inputs, node.inputs, strict=True):
            source = list(made.blocks[f"n{j}"].outputs)[p]
            made.connect(f"n{j}.{source}", f"n{i}.{target}")
    return made
