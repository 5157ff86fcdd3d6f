"""Random hybrid systems against an event-by-event solution in closed form.

A mass on a spring whose stiffness and rest length depend on the mode: between events
x = c + A cos ωt + B sin ωt. The reference scans that formula finely, refines each crossing by
brentq, and applies the declared meaning of events; it knows nothing of the FMU's solver.
"""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from railcosim.fmus import build
from railcosim.models import Plant, RungeKutta4
from tests.instances import FMU2Named

OMEGA, REST = (2.0, 3.0, 5.0), (0.0, 0.3, -0.2)
STOP = 12.0


def spring() -> Plant:
    """Three modes, rising, falling and two-sided events, kicks, and a time event that repeats."""
    with Plant("spring", stop=STOP, step=0.1, solver=RungeKutta4(inner_step=0.002)) as plant:
        a = plant.parameter("a", 0.5, unit="m")
        b = plant.parameter("b", 0.1, unit="m")
        kick = plant.parameter("kick", 0.3, unit="m/s")
        period = plant.parameter("period", 1.7, unit="s", minimum=0.1)
        x = plant.state("x", unit="m", start=1.0, output=True)
        v = plant.state("v", unit="m/s", output=True)
        mode = plant.mode("mode", output=True)
        passes = plant.mode("passes", output=True)
        due = plant.memory("due", unit="s", start=1.0)
        last = plant.memory("last", unit="s", output=True)
        w = ca.if_else(mode == 0, OMEGA[0], ca.if_else(mode == 1, OMEGA[1], OMEGA[2]))
        c = ca.if_else(mode == 0, REST[0], ca.if_else(mode == 1, REST[1], REST[2]))
        plant.der(x, v)
        plant.der(v, -w * w * (x - c))
        now = plant.time
        plant.event("up", x - a, direction="rising", when=mode == 0, changes={mode: 1, last: now})
        plant.event(
            "top", v, direction="falling", when=mode == 1,
            changes={mode: 2, v: v - kick, last: now},
        )  # fmt: skip
        plant.event(
            "down", x + a, direction="falling", when=mode == 2, changes={mode: 0, last: now}
        )
        plant.event("pass", x - b, direction="both", changes={passes: passes + 1, last: now})
        plant.time_event("tick", due, changes={v: 0.9 * v, due: due + period, last: now})
    return plant


@dataclass
class Reference:
    """The system on paper: values, and which conditions have been acknowledged."""

    a: float
    b: float
    kick: float
    period: float
    x: float
    t: float = 0.0
    v: float = 0.0
    mode: int = 0
    passes: int = 0
    due: float = 1.0
    last: float = 0.0
    holds: dict[str, bool] = field(default_factory=dict)

    def flow(self, s: float) -> tuple[float, float]:
        """Return x and v after s seconds without an event."""
        w, c = OMEGA[self.mode], REST[self.mode]
        cosine, sine = math.cos(w * s), math.sin(w * s)
        x = self.x - c
        return c + x * cosine + self.v / w * sine, self.v * cosine - w * x * sine

    def crossings(self, x: float, v: float) -> dict[str, float]:
        """Return what must become positive for an event, and for "pass" what changes sign."""
        found = {"pass": x - self.b}
        if self.mode == 0:
            found["up"] = x - self.a
        elif self.mode == 1:
            found["top"] = -v
        else:
            found["down"] = -(x + self.a)
        return found

    def conditions(self) -> dict[str, bool]:
        return {name: z > 0.0 for name, z in self.crossings(self.x, self.v).items()}

    def fire(self, name: str) -> None:
        self.last = self.t
        if name == "up":
            self.mode = 1
        elif name == "top":
            self.mode, self.v = 2, self.v - self.kick
        elif name == "down":
            self.mode = 0
        else:
            self.passes += 1

    def acknowledge(self) -> None:
        """Fire what has become true, in the order of declaration, until nothing has."""
        for _ in range(20):
            now = self.conditions()
            new = [
                n
                for n in ("up", "top", "down", "pass")
                if n in now
                and (
                    now[n] != self.holds["pass"]
                    if n == "pass"
                    else now[n] and not self.holds.get(n)
                )
            ]
            if not new:
                break
            self.fire(new[0])
            self.holds[new[0]] = now[new[0]]
        self.holds = self.conditions()

    def start(self) -> None:
        self.holds = {"pass": self.conditions()["pass"]}
        self.acknowledge()

    def next_crossing(self, end: float) -> tuple[float, str] | None:
        """Return the first crossing within `end` seconds: when (from now) and whose."""
        grid = np.linspace(0.0, end, max(int(end / 2e-4), 2) + 1)
        before = self.crossings(*self.flow(0.0))
        for s0, s1 in pairwise(grid):
            after = self.crossings(*self.flow(s1))
            hits = []
            for name, z in after.items():
                differs = (z > 0.0) != self.holds.get(name, False)
                if differs and (name == "pass" or z > 0.0) and (before[name] > 0.0) != (z > 0.0):
                    hits.append(
                        (
                            brentq(
                                lambda s, n=name: self.crossings(*self.flow(s))[n],
                                s0,
                                s1,
                                xtol=1e-15,
                            ),
                            name,
                        )
                    )
                elif name != "pass" and z <= 0.0:
                    self.holds[name] = False
            if hits:
                return min(hits)
            before = after
        return None

    def run(self, stop: float) -> None:
        self.start()
        while self.t < stop:
            end = min(self.due, stop) - self.t
            hit = self.next_crossing(end)
            s = end if hit is None else hit[0]
            self.x, self.v = self.flow(s)
            self.t += s
            if hit is None:
                if self.t < stop:
                    self.v *= 0.9
                    self.due += self.period
                    self.last = self.t
                    self.acknowledge()
                continue
            self.holds[hit[1]] = True if hit[1] != "pass" else not self.holds["pass"]
            held = self.holds["pass"]
            self.fire(hit[1])
            after = self.conditions()
            after["pass"] = held if abs(self.x - self.b) < 1e-9 else after["pass"]
            self.holds = {
                n: after[n] and self.holds.get(n, False) if n != "pass" else after[n] for n in after
            }


@pytest.mark.parametrize("seed", range(40))
def test_a_random_system(tmp_path: Path, seed: int, spring_fmu: Path) -> None:
    generator = np.random.default_rng(seed)
    values: dict[str, Any] = {
        "a": generator.uniform(0.2, 0.6), "b": generator.uniform(-0.3, 0.3),
        "kick": generator.uniform(0.1, 0.8), "period": generator.uniform(0.5, 2.5),
        "x": generator.uniform(0.7, 1.4) * generator.choice([-1.0, 1.0]),
    }  # fmt: skip
    values = {name: float(v) for name, v in values.items()}
    expected = Reference(**values)
    expected.run(STOP)
    slave = FMU2Named(spring_fmu, tmp_path)
    for name, value in values.items():
        slave.set(name, value)
    slave.initialize()
    slave.run(STOP, float(generator.choice([0.1, 0.25, 1.0, 12.0])))
    assert (slave.get("mode"), slave.get("passes")) == (expected.mode, expected.passes)
    assert slave.get("last") == pytest.approx(expected.last, abs=1e-7)
    found = [slave.get("x"), slave.get("v")]
    assert found == pytest.approx([expected.x, expected.v], abs=1e-6)
    slave.freeInstance()


@pytest.fixture(scope="module")
def spring_fmu() -> Path:
    return build(spring())
