"""The adaptive fuzzy loop against one written anew from the sheet: every form, both plants."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.models import dc_drive_train, second_order_train_on_line
from railcosim.studies.adaptive_fuzzy.controllers import LINE_UP, absolute
from railcosim.studies.adaptive_fuzzy.experiments import REGULATIONS, Regulation
from tests.systems.reference_loop import (
    T1,
    Pid,
    centre_of_gravity,
    closed_loop,
    heights_of,
    memberships,
)

GAMMA = [[4,4,3,2,2,2,3],[4,4,3,2,2,3,3],[4,3,3,1,2,3,4],[4,3,2,0,2,3,4],[4,3,2,2,3,3,4],
         [3,3,2,2,3,4,4],[3,2,2,2,3,4,4]]  # fmt: skip


def inferred(table: list[list[int]], ec: float, e: float, low: float, high: float, n: int) -> float:
    rows, columns = memberships(ec, -6.0, 6.0, 7), memberships(e, -3.0, 3.0, 7)
    return centre_of_gravity(heights_of(table, rows, columns, n), low, high)


@dataclass
class Adaptive:
    """The sheet's controller for one reference r that does not change."""

    r: float
    universe: bool
    scaling: bool
    ku: float = 10.0
    base: bool = True
    seen: list[float] = field(default_factory=list)

    def __call__(self, e: float) -> float:
        before = self.seen[-1] if self.seen else e
        self.seen.append(e)
        ec = (e - before) / 0.02
        ke, kec = 1.0, 4.0
        if self.universe:
            alpha = 1.0 - 0.75 * math.exp(-2.0 * e**2)
            ke = 3.0 / abs(e) if abs(e) > 3.0 else 1.0 / alpha
            overshot = e * self.seen[0] < 0.0
            kec = 5.0 if abs(e) < 0.3 or overshot else 4.0
        t1 = [[k + 3 for k in row] for row in T1]
        out = self.ku * inferred(t1, kec * ec, ke * e, -6.0, 6.0, 7)
        if self.scaling:
            out *= inferred(GAMMA, kec * ec, ke * e, 0.0, 1.0, 5)
        out += self.r / 2.2 if self.base else 0.0
        return min(max(out, -10.0), 10.0)


FORMS = {"fuzzy": (False, False), "universe": (True, False), "scaling": (False, True),
         "adaptive": (True, True)}  # fmt: skip


def reference(r: float, name: str, ku: float, base: bool) -> Pid | Adaptive:
    if name == "pid_zn":
        return Pid(6.65, 2.83, 0.707, 0.0707, ts=0.02)
    return Adaptive(r, *FORMS[name], ku=ku, base=base)


@pytest.fixture(scope="module")
def fmus() -> list[Path]:
    return [build(second_order_train_on_line()), build(dc_drive_train())]


@pytest.mark.parametrize("name", LINE_UP)
@pytest.mark.parametrize(
    ("before", "target", "ku", "base"),
    [(10.0, 7.0, 10.0, True), (10.0, 7.0, 10.0, False), (10.0, 7.0, 30.0, False),
     (0.0, 10.0, 10.0, True)],
)  # fmt: skip
def test_against_the_reference(
    fmus: list[Path], name: str, before: float, target: float, ku: float, base: bool
) -> None:
    block = LINE_UP[name] if base or name == "pid_zn" else absolute(ku)[name]
    regulation = Regulation("r", before, target, {})
    _, speed, control = closed_loop(
        reference(target, name, ku, base),
        ts=0.02,
        stop=40.0,
        reference=lambda t: target,
        speed=before,
    )
    for fmu in fmus:
        run = regulation.diagram(block, fmu).run(40.0, progress=False)
        assert np.max(np.abs(run["train.speed"] - speed)) < 1e-9
        assert np.max(np.abs(run["controller.u"] - control)) < 1e-7  # gains of up to 400


def test_the_two_plants_agree_in_every_experiment(fmus: list[Path]) -> None:
    for regulation in REGULATIONS:
        for name, block in regulation.controllers.items():
            one, other = (
                regulation.diagram(block, fmu).run(40.0, progress=False)["train.speed"]
                for fmu in fmus
            )
            assert np.max(np.abs(one - other)) < 1e-9, (regulation.name, name)
