"""The target curve of a stop: its three quantities belong together, and it ends at the aim."""

import copy
import pickle
import random
from itertools import accumulate
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from railcosim.base.errors import ParameterError
from railcosim.controllers import BrakingProfile
from railcosim.fmus import trace

PROFILES = {
    "default": BrakingProfile(),
    "gentle_end": BrakingProfile(end_jerk=0.2, aim=-0.17, lead_in=0.0),
    "no_steady_part": BrakingProfile(speed=0.98, deceleration=0.7, jerk=0.5),
    "other": BrakingProfile(speed=22.2, deceleration=1.1, jerk=0.8, lead_in=3.3, aim=150.0),
}


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_it_integrates_exactly(profile: BrakingProfile) -> None:
    bends = [profile.lead_in, *accumulate((profile.lead_in, *profile.phases))]
    for t in np.linspace(0.0, profile.duration + 1.0, 41).tolist():
        points = [b for b in bends if 0.0 < b < t] or None
        gained = quad(lambda s: profile.at(s).acceleration, 0.0, t, points=points)[0]
        assert profile.at(t).speed == pytest.approx(profile.speed + gained, abs=1e-9)
        way = quad(lambda s: profile.at(s).speed, 0.0, t, points=points)[0]
        assert profile.at(t).position == pytest.approx(profile.start_position + way, abs=1e-8)


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_it_ends_at_the_aim_exactly(profile: BrakingProfile) -> None:
    for t in (profile.duration, profile.duration + 0.1, 1e6):
        assert tuple(profile.at(t)) == (profile.aim, 0.0, 0.0)


def test_by_hand() -> None:
    """Ramps of 1.4 s that take 0.49 m/s each, 18.6 s between them, and 14/2 m/s on average."""
    profile = BrakingProfile()
    assert profile.phases == pytest.approx((1.4, 18.6, 1.4))
    assert profile.start_position == pytest.approx(-(2.0 * 14.0 + 7.0 * 21.4))
    assert profile.at(3.4).speed == pytest.approx(13.51)
    assert tuple(profile.at(2.0))[1:] == pytest.approx((14.0, 0.0))


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_deceleration_and_jerk_are_limited(profile: BrakingProfile) -> None:
    times = np.linspace(0.0, profile.duration + 1.0, 4001)
    a = np.array([profile.at(t).acceleration for t in times.tolist()])
    assert -profile.deceleration - 1e-12 <= a.min() and a.max() <= 0.0
    jerk = np.diff(a) / np.diff(times)
    end = profile.jerk if profile.end_jerk is None else profile.end_jerk
    assert -profile.jerk - 1e-9 <= jerk.min() and jerk.max() <= end + 1e-9


def test_as_a_block_it_gives_its_samples() -> None:
    profile = BrakingProfile(lead_in=1.0, period=0.1)
    x = profile.start()
    for k in range(300):
        y, x = profile.step(x)
        assert y == tuple(profile.at(k * 0.1))


def test_traced_is_the_same() -> None:
    profile, generator = PROFILES["gentle_end"], random.Random(5)
    counts = [float(k) for k in range(150)] + [generator.uniform(0.0, 150.0) for _ in range(2000)]
    traced = trace(profile)
    y, _ = traced.map(len(counts))(ca.DM(counts).T, ca.DM(0, len(counts)), ca.DM(0, len(counts)))
    expected = np.array([profile.step(k)[0] for k in counts])
    assert pytest.approx(expected, abs=1e-12) == np.array(ca.densify(y)).T


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"speed": 0.5}, r"speed must be at least 0\.98 m/s"),
        ({"lead_in": -1.0}, "lead_in must not be negative"),
        ({"jerk": 0.0}, "jerk must be a positive number"),
        ({"end_jerk": -0.1}, "end_jerk must be a positive number"),
        ({"aim": float("nan")}, "aim must be a finite number"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        BrakingProfile(**options)


def test_a_copy_has_the_curve_of_its_own_parameters() -> None:
    made = PROFILES["default"].with_parameters({"speed": 10.0, "end_jerk": 0.2})
    fresh = BrakingProfile(speed=10.0, end_jerk=0.2)
    assert made == fresh and repr(made) == repr(fresh)
    assert set(made.parameters()) == {
        "speed", "deceleration", "jerk", "end_jerk", "lead_in", "aim", "period"
    }  # fmt: skip
    for one in (made, pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert [one.at(0.1 * k) for k in range(300)] == [fresh.at(0.1 * k) for k in range(300)]
