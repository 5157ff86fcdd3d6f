"""Trains of vehicles, and the paper's coal train."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.models import heavy_haul_train
from railcosim.models.consist import (
    Consist,
    Coupler,
    DraftGear,
    EndOfTrain,
    c80,
    coal_train,
    hxd1,
    mt2,
)
from railcosim.models.consist.consist import STEP
from railcosim.models.solver import SemiImplicitEuler

COUPLER = Coupler(gear=mt2())
DRAWBAR = Coupler(gear=mt2(), slack=0.0)
SHORT = (hxd1(), c80(), c80(), hxd1())


def consist(**given: Any) -> Consist:
    return Consist(**{"name": "C", "vehicles": SHORT, "couplers": (COUPLER,) * 3, **given})


def light(*, mass: float = 2e3, gear: DraftGear | None = None, damping: float = 5e4) -> Consist:
    """Three wagons of 100 t and a light one; the joint between the last two is as given."""
    last = replace(c80(), name="light", mass=mass)
    return consist(
        vehicles=(*SHORT[:3], last),
        couplers=(COUPLER, COUPLER, Coupler(gear=gear or mt2(), damping=damping)),
    )


def test_the_papers_train_has_10000_t_behind_two_locomotives():
    train = coal_train()
    assert (train.size, train.groups, train.end_of_train) == (102, ((0, 1),), None)
    assert train.mass == 10_400e3
    assert train.length == pytest.approx(2 * 35.222 + 1200.0)
    assert all(not vehicle.is_locomotive for vehicle in train.vehicles[2:])
    assert coal_train(end_of_train=EndOfTrain()).end_of_train == EndOfTrain(radio_delay=1.0)
    assert coal_train(axle_load=23).mass == 10_368e3


def test_drawbars_are_within_sets_of_three_wagons():
    joints = coal_train(locomotives=2, wagons=7).couplers
    # L L W W W W W W W: couplers at the locomotives and between the sets
    assert joints == (COUPLER, COUPLER, DRAWBAR, DRAWBAR, COUPLER, DRAWBAR, DRAWBAR, COUPLER)


def test_locomotives_may_be_distributed():
    train = coal_train(distributed=True)
    assert train.groups == ((0,), (52,))  # behind 51 wagons, 17 whole sets
    assert train.couplers[51] == train.couplers[52] == COUPLER
    train = coal_train(locomotives=3, wagons=9, distributed=(0, 6, 9))
    assert train.groups == ((0,), (7,), (11,))
    assert len(train.couplers) == train.size - 1
    assert coal_train(locomotives=3, distributed=True).groups == ((0, 1), (53,))


def test_neighbouring_locomotives_are_a_group_unless_groups_are_given():
    assert consist().groups == ((0,), (3,))
    assert consist(groups=((0, 3),)).groups == ((0, 3),)
    assert consist(groups=[[0], [3]]).groups == ((0,), (3,))
    assert replace(consist(), radio_delay=2.0).groups == ((0,), (3,))


def growth(*, stiffness: float, damping: float, mass: float, step: float = 1e-3) -> float:
    """By how much a semi-implicit Euler step of a chain of 40 equal masses grows, at most."""
    size = 40
    chain = 2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    chain[0, 0] = chain[-1, -1] = 1.0
    faster = np.eye(size) - step * damping / mass * chain
    pulled = -step * stiffness / mass * chain
    whole = np.block([[np.eye(size) + step * pulled, step * faster], [pulled, faster]])
    return float(np.abs(np.linalg.eigvals(whole)).max())


def test_what_is_just_allowed_can_be_integrated_and_twice_as_much_cannot():
    """Against the eigenvalues of the step itself; 500 kN·s/m and 1000 MN/m are allowed with 2 t."""
    gear = DraftGear(name="G", stiffness=500e6, stop_stiffness=500e6)
    light(gear=gear, damping=500e3)
    assert growth(stiffness=1e9, damping=5e5, mass=2e3) < 1.0 + 1e-6
    assert growth(stiffness=0.0, damping=1.01e6, mass=2e3) > 1.0 + 1e-3
    assert growth(stiffness=2.02e9, damping=0.0, mass=2e3) > 1.0 + 1e-3


def test_the_step_is_that_of_the_plant():
    solver = heavy_haul_train(coal_train(wagons=1, locomotives=1)).solver
    assert isinstance(solver, SemiImplicitEuler) and solver.inner_step == STEP


def test_trains_are_values():
    assert coal_train() == coal_train()
    assert len({coal_train(), coal_train(), coal_train(axle_load=23)}) == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: consist(vehicles=(hxd1(),), couplers=()), r"2 to 1000 vehicles, not 1$"),
        (lambda: consist(vehicles=(hxd1(),) * 1001), r"2 to 1000 vehicles, not 1001"),
        (lambda: consist(couplers=(COUPLER,)), r"4 vehicles have 3 couplers between them, not 1"),
        (lambda: consist(vehicles=(c80(),) * 4), r"no vehicle is a locomotive; give one"),
        (lambda: consist(vehicles=SHORT[1:], couplers=(COUPLER,) * 2), r"'C80' is no locomotive"),
        (lambda: consist(vehicles=(*SHORT[:3], "HXD1")), r"vehicles\[3\]: Vehicle is needed"),
        (lambda: consist(couplers=(COUPLER, COUPLER, 1.0)), r"couplers\[2\]: Coupler is needed"),
        (lambda: consist(groups=((0, 3, 1),)), r"groups\[0\]\[2\]: vehicle 1 .* is no locomotive"),
        (lambda: consist(groups=((0,),)), r"groups: vehicle 3 .* is a locomotive and in no group"),
        (lambda: consist(groups=((3,), (0,))), r"groups\[0\]: the first group leads"),
        (lambda: consist(groups=((0, 3), (3,))), r"groups\[1\]\[0\]: vehicle 3 is already in gr"),
        (lambda: consist(groups=((0,), ())), r"groups\[1\]: the group has no locomotive"),
        (lambda: consist(groups=((0, 4),)), r"groups\[0\]\[1\]: 4 is not within 0 to 3"),
        (lambda: consist(groups=((0, 3.0),)), r"a whole number is needed, not 3.0"),
        (lambda: consist(radio_delay=-1.0), r"radio_delay: -1 s is not within"),
        (lambda: consist(application_speed=0.0), r"application_speed: 0 m/s is not within"),
        (lambda: consist(release_time=0.0), r"release_time: 0 s is not within"),
        (lambda: consist(end_of_train=True), r"EndOfTrain or None is needed, not True"),
        (lambda: EndOfTrain(radio_delay=float("inf")), r"a finite number is needed, not inf"),
        (lambda: coal_train(locomotives=0), r"locomotives must be 1 to 1000, not 0"),
        (lambda: coal_train(wagons=5000), r"wagons must be 0 to 1000, not 5000"),
        (lambda: coal_train(wagons="60"), r"wagons must be 0 to 1000, not '60'"),  # pyright: ignore
        (lambda: coal_train(axle_load=[25]), r"25 or 23 t, not \[25\]"),  # pyright: ignore
        (lambda: coal_train(distributed=["a", 3]), r"list of whole numbers, .* not \['a', 3\]"),  # pyright: ignore
        (lambda: coal_train(distributed=None), r"list of whole numbers, .* not None"),  # pyright: ignore
        (lambda: coal_train(distributed="03"), r"list of whole numbers, .* not '03'"),  # pyright: ignore
        (lambda: light(damping=501e3), r"couplers\[2\]: coupler 2 \(from 0\): damping, 501 kN·s/m, "
         r"cannot be .*'light' of 2 t; at most 500 kN·s/m"),
        (lambda: light(gear=DraftGear(name="G", stiffness=901e6)),
         r"coupler 2 .*: stiffness and stop_stiffness together, 1001 MN/m, .* at most 1000 MN/m"),
        (lambda: coal_train(wagons=1000), r"2 to 1000 vehicles, not 1002"),
        (lambda: coal_train(distributed=(0, 50)), r"no locomotive can be behind 50 of 100 wagons"),
        (lambda: coal_train(distributed=(0, 51, 99)), r"for each of the 2 locomotives"),
        (lambda: coal_train(distributed=(3, 6)), r"from 0 and not falling"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(make: Callable[[], object], message: str):
    with pytest.raises(ParameterError, match=message):
        make()
