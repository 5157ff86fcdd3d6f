"""What each controller must do by its equations, on inputs where that can be computed by hand."""

import math

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import (
    PID,
    FuzzySpeed,
    SingleNeuron,
    SoftSwitching,
    reaction_curve,
    simc,
    ziegler_nichols,
)


def test_pid_terms() -> None:
    pid = PID(kp=2.0, ti=4.0, td=0.0, period=0.1)
    u, x = pid.step(pid.start(), 1.0, 0.0)
    assert u == pytest.approx(2.0 + 2.0 / 4.0 * 0.1)  # P + I, the integral used in its own sample
    u, _ = pid.step(x, 1.0, 0.0)
    assert u == pytest.approx(2.0 + 2 * 2.0 / 4.0 * 0.1)


def test_pid_derivative_is_a_filtered_difference() -> None:
    pid = PID(kp=1.0, ti=1e9, td=1.0, filter_time=0.1, period=0.1, limits=(-100.0, 100.0))
    _, x = pid.step(pid.start(), 0.0, 0.0)
    u, _ = pid.step(x, 0.5, 0.0)
    assert u == pytest.approx(0.5 + 1.0 * 0.5 / (0.1 + 0.1), rel=1e-6)


def test_pid_has_no_kick_at_the_first_sample_unless_asked() -> None:
    quiet, kicking = (PID(kp=1.0, ti=1e9, td=1.0, kick=kick) for kick in (False, True))
    assert quiet.step(quiet.start(), 1.0, 0.0)[0] == pytest.approx(1.0, rel=1e-6)
    assert kicking.step(kicking.start(), 1.0, 0.0)[0] > 5.0


def test_pid_does_not_wind_up() -> None:
    pid = PID(kp=1.0, ti=1.0, td=0.0, limits=(-1.0, 1.0), period=0.1)
    x = pid.start()
    for _ in range(100):
        u, x = pid.step(x, 5.0, 0.0)
        assert u == 1.0
    assert x[0] == 0.0


def test_fuzzy_is_antisymmetric_and_saturates() -> None:
    fuzzy = FuzzySpeed()
    assert fuzzy.step((0.3, 0.0), 0.5, 0.0)[0] == pytest.approx(
        -fuzzy.step((-0.3, 0.0), -0.5, 0.0)[0], abs=1e-12
    )
    assert fuzzy.step(fuzzy.start(), 5.0, 0.0)[0] == 10.0
    assert fuzzy.step(fuzzy.start(), 0.0, 0.0)[0] == pytest.approx(0.0, abs=1e-12)


def test_fuzzy_rate_is_derivative_or_difference() -> None:
    derivative, difference = FuzzySpeed(kick=True), FuzzySpeed.literal()
    fast = FuzzySpeed(kick=True, kec=3.0 / 20.0)  # 1/0.05 s undone in the gain
    assert derivative.step(derivative.start(), 0.05, 0.0)[0] != pytest.approx(
        difference.step(difference.start(), 0.05, 0.0)[0]
    )
    assert fast.step(fast.start(), 0.05, 0.0)[0] == pytest.approx(
        difference.step(difference.start(), 0.05, 0.0)[0], abs=1e-12
    )


def test_neuron_increment_by_hand() -> None:
    """Equations 1 to 5 with fixed weights: no learning while u(k−1) is 0."""
    neuron = SingleNeuron(gain_rules=None, kick=True)
    (u, gain), x = neuron.step(neuron.start(), 0.1, 0.0)
    assert gain == 0.9
    assert u == pytest.approx(5.0 * 0.9 * (0.05 * 0.1 + 0.1 + 0.1 / 0.05) / 3.0)
    assert x[3] == (0.1, 0.1, 0.1)
    (_, _), x = neuron.step(x, 0.4, 0.0)
    learn = 0.4 * u * (0.4 + 0.3)
    assert x[3] == pytest.approx((0.1 + 7.5 * learn, 0.1 + 18.2 * learn, 0.1 + 12.0 * learn))


def test_neuron_weights_are_floored_or_not() -> None:
    state = (8.0, 0.5, 0.5, (0.2, 0.2, 0.2), 0.0)
    _, x = SingleNeuron().step(state, 0.05, 0.0)
    assert all(w >= 0.1 for w in x[3])
    _, x = SingleNeuron.literal().step(state, 0.05, 0.0)
    assert min(x[3]) < 0.1


def test_neuron_gain_is_k0_plus_the_rules() -> None:
    neuron = SingleNeuron()
    (_, gain), _ = neuron.step((0.0, 0.0, 0.0, (0.1, 0.1, 0.1), 0.0), 0.0, 0.0)
    assert gain == pytest.approx(0.9 + 1.5)  # ZO, the middle of [0, 3]
    (_, gain), _ = neuron.step(neuron.start(), 5.0, 0.0)  # E PB, EC ZO: NM, centred on 0.5
    assert gain == pytest.approx(0.9 + 0.5)


def test_composite_mixes_its_two_controllers() -> None:
    composite = SoftSwitching.recommended()
    x = composite.start()
    for e in (1.0, 0.8, 0.5, 0.3, 0.2, 0.1):
        (u, cf, cnp, fuzzy, neuron), x = composite.step(x, e, 0.0)
        assert cf + cnp == pytest.approx(1.0, abs=1e-15)
        assert 0.0 <= cf <= 1.0
        assert u == pytest.approx(cf * fuzzy + cnp * neuron, abs=1e-12)
    (_, cf, *_), _ = composite.step(composite.start(), 1.0, 0.0)
    assert cf == 1.0


def test_the_composites_period_is_that_of_its_parts() -> None:
    slow = SoftSwitching().with_parameter("period", 0.1)
    assert slow.fuzzy.period == slow.neuron.period == 0.1
    with pytest.raises(ParameterError, match="no parameter 'neuron.period'"):
        slow.with_parameter("neuron.period", 0.2)
    changed = SoftSwitching().with_parameter("neuron.k0", 1.5)
    assert changed.neuron.k0 == 1.5
    with pytest.raises(ParameterError, match="did you mean 'neuron.k0'"):
        changed.with_parameter("neuron.k", 1.5)


@pytest.mark.parametrize(
    "make",
    [
        lambda: PID(kp=0.0, ti=1.0, td=0.0),
        lambda: PID(kp=1.0, ti=1.0, td=-1.0),
        lambda: PID(kp=1.0, ti=1.0, td="x"),  # pyright: ignore
        lambda: PID(kp=1.0, ti=1.0, td=0.0, limits=(1.0, -1.0)),
        lambda: PID(kp=1.0, ti=1.0, td=0.0, period=0.0),
        lambda: FuzzySpeed(rate="slope"),  # pyright: ignore
        lambda: FuzzySpeed(ke=math.nan),
        lambda: SingleNeuron(k0=-1.0),
        lambda: SingleNeuron(floor=0.0),
    ],
)
def test_wrong_parameters_are_refused(make) -> None:
    with pytest.raises(ParameterError):
        make()


# Tuning, on the plant 2.2 / ((10.506 s + 1)(2.938 s + 1))

TAU1, TAU2 = (1 / p for p in sorted(0.2178 + s * math.sqrt(0.2178**2 - 0.0324) for s in (-1, 1)))


def test_reaction_curve_is_the_tangent_at_the_inflection() -> None:
    curve = reaction_curve(gain=2.2, tau1=TAU1, tau2=TAU2)

    def y(t: float) -> float:
        a, b = TAU1 * math.exp(-t / TAU1), TAU2 * math.exp(-t / TAU2)
        return 2.2 * (1.0 - (a - b) / (TAU1 - TAU2))

    h = 1e-4
    slopes = [(y(t + h) - y(t - h)) / (2 * h) for t in (i * 1e-2 for i in range(1, 3000))]
    assert 2.2 / curve["time_constant"] == pytest.approx(max(slopes), rel=1e-5)
    steepest = (slopes.index(max(slopes)) + 1) * 1e-2
    foot = steepest - y(steepest) / max(slopes)
    assert curve["dead_time"] == pytest.approx(foot, abs=2e-5)


def test_equal_time_constants_are_the_limit_of_different_ones() -> None:
    equal = reaction_curve(gain=1.0, tau1=2.0, tau2=2.0)
    near = reaction_curve(gain=1.0, tau1=2.0, tau2=2.0 * (1 + 1e-6))
    assert near == pytest.approx(equal, rel=1e-5)


def test_the_rules_give_the_sheets_tunings() -> None:
    rules = ziegler_nichols(**reaction_curve(gain=2.2, tau1=TAU1, tau2=TAU2))
    assert rules == pytest.approx({"kp": 6.65, "ti": 2.83, "td": 0.707}, rel=5e-3)
    rules = simc(gain=2.2, tau1=TAU1, tau2=TAU2, tau_c=1.5)
    expected = {"kp": 4.743, "ti": 8.94, "td": 1.972, "filter_time": 0.294}
    assert rules == pytest.approx(expected, rel=1e-3)
    assert PID.simc(gain=2.2, tau1=TAU1, tau2=TAU2, tau_c=1.5).kp == rules["kp"]
    assert PID.ziegler_nichols(gain=1.0, time_constant=2.0, dead_time=1.0).kp == 2.4


def test_tuning_refuses_nonsense() -> None:
    with pytest.raises(ParameterError, match="dead_time must be a positive"):
        ziegler_nichols(gain=1.0, time_constant=1.0, dead_time=0.0)
    with pytest.raises(ParameterError, match="tau1 ≥ tau2"):
        simc(gain=1.0, tau1=1.0, tau2=2.0, tau_c=1.0)
