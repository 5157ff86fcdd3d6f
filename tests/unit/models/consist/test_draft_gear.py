"""Draft gears and couplers."""

from collections.abc import Callable

import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from railcosim.base.errors import ParameterError
from railcosim.models.consist import Coupler, DraftGear, Points, PowerLaw, mt2

CURVE = Points(points=((0.0, 0.0), (0.05, 300e3), (0.1, 1500e3)))


def test_two_mt2_reach_2270_kn_at_166_mm_and_take_119_kj():
    gear = mt2()
    assert gear.stroke == 0.166
    assert gear.force(0.166) == pytest.approx(2.27e6, rel=1e-12)
    assert gear.force(0.2) == gear.force(0.166)  # the stop is not the gear's
    energy, _ = quad(gear.force, 0.0, 0.166, points=[0.004], epsrel=1e-12)
    assert energy / 2 == pytest.approx(59.7e3, rel=1e-3)
    assert gear.force(0.002) == pytest.approx(50e3 + 2170e3 * (0.002 / 0.166) ** 2.5)


@pytest.mark.parametrize("exponent", [1.0, 1.4, 2.5])
@pytest.mark.parametrize("law", [PowerLaw(), PowerLaw(initial_stroke=0.05, initial_force=1000e3)])
def test_the_steepest_slope_of_a_power_law_is_the_curves(law: PowerLaw, exponent: float):
    law, step = PowerLaw(initial_force=law.initial_force, initial_stroke=law.initial_stroke,
                         exponent=exponent), 1e-7  # fmt: skip

    def slope(used: float) -> float:
        return (law.force(used + step, 0.166) - law.force(used - step, 0.166)) / (2 * step)

    ends = [(step, law.initial_stroke - step), (law.initial_stroke + step, 0.166 - step)]
    found = [
        -minimize_scalar(lambda used: -slope(used), bounds=end, method="bounded").fun  # pyright: ignore
        for end in ends
    ]
    assert law.steepest(0.166) == pytest.approx(max(found), rel=1e-3)


def test_points_are_joined_by_lines():
    gear = DraftGear(name="measured", stroke=0.1, loading=CURVE)
    assert gear.force(0.025) == pytest.approx(150e3)
    assert gear.force(0.075) == pytest.approx(900e3)
    assert CURVE.steepest(0.1) == pytest.approx(24e6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DraftGear(name="G", stroke=0.0), r"gear 'G': stroke: 0 mm is not within 5 to"),
        (lambda: DraftGear(name="G", stroke=166.0), r"stroke: 166000 mm is not within"),
        (lambda: DraftGear(name="G", unloading_ratio=1.5), r"unloading_ratio: 1.5 is not within"),
        (lambda: DraftGear(name="G", loading=CURVE),
         r"loading.points: the curve ends at 100 mm, not at the stroke, 166 mm"),
        (lambda: DraftGear(name="G", loading=PowerLaw(initial_stroke=0.2)),
         r"loading.initial_stroke: 200 mm is beyond the stroke, 166 mm"),
        (lambda: DraftGear(name="G", stiffness=20e6),
         r"20 MN/m is less than the loading curve's steepest slope, .* 32.68 MN/m is needed"),
        (lambda: DraftGear(name="G", stiffness=80.0), r"8e-05 MN/m is not within 1 to 2000 MN/m"),
        (lambda: DraftGear(name=""), r"draft gear: name: a name is needed, not ''"),
        (lambda: Points(points=((0.0, 0.0), (0.1, 1e5), (0.2, 1e5))),
         r"points\[2\]\[1\]: 100 kN does not lie above the 100 kN before it"),
        (lambda: Points(points=((0.0, 0.0), (0.1, 1e5), (0.1, 2e5))),
         r"points\[2\]\[0\]: 100 mm does not lie above the 100 mm before it"),
        (lambda: Points(points=((0.0, 5.0), (0.1, 1e5))), r"points\[0\]: the first point must be"),
        (lambda: Points(points=((0.0, 0.0), (0.1, 1e3))), r"1 kN is not within 10 to 20000 kN"),
        (lambda: PowerLaw(exponent=0.5), r"exponent: 0.5 is not within 1 to 20"),
        (lambda: PowerLaw(final_force=2170.0), r"final_force: 2.17 kN is not within"),
        (lambda: Coupler(gear=mt2(), slack=-0.001), r"coupler: slack: -1 mm is not within 0 to"),
        (lambda: Coupler(gear=mt2(), slack=9.5), r"slack: 9500 mm is not within"),
        (lambda: Coupler(gear=mt2(), damping=-1.0), r"damping: -0.001 kN·s/m is not within"),
        (lambda: Coupler(gear="MT-2"), r"gear: DraftGear is needed, not 'MT-2'"),  # pyright: ignore
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(make: Callable[[], object], message: str):
    with pytest.raises(ParameterError, match=message):
        make()
