"""The braking model of model.c: predictions, and the estimation of its parameters."""

import ctypes
import math
from array import array
from ctypes import byref, c_double, c_int
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...base.errors import ParameterError
from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from . import library
from .prior import COUNT, Prior

LARGEST = 2.0  # sd of the prior that a parameter moves in one step of Gauss–Newton
MOST = 1024  # commands, MOST_TICKS of model.c
BOUND = 5.0  # sd of the prior that a parameter stays within
_Parameters = c_double * COUNT
_Matrix = c_double * (COUNT * COUNT)


_NAMES = (
    "period", "horizon", "rate", "a", "b", "c", "change", "length", "reference",
    "position_sd", "speed_sd", "first", "second", "doubt", "loose_sd", "probe", "probe_length",
)  # fmt: skip


class _Setting(ctypes.Structure):
    _fields_ = [(name, c_double) for name in _NAMES]


class Probe(NamedTuple):
    """How the air brake is tried out: a `level` (m/s², negative) for `length` s, `after` s of
    braking."""

    level: float = -0.2
    length: float = 2.0
    after: float = 2.0


class Samples(NamedTuple):
    """What was measured since the first sample, one a period, and the commands between them.

    `probed` is the time (s) since the first sample at which the model's probe was commanded.
    """

    positions: tuple[float, ...]
    speeds: tuple[float, ...]
    commands: tuple[float, ...]
    probed: float = math.inf


class _Plan(ctypes.Structure):
    _fields_ = [
        (name, c_double)
        for name in ("aim", "damping", "low", "high", "ending", "slow", "fast")
    ]  # fmt: skip


class Plan(NamedTuple):
    """How a level (m/s²) becomes commands, and moves so that the train stops at the aim (m).

    The command goes to the level; from the speed `fast` (m/s) down to `slow` it goes to a share of
    it that falls to `ending`. See PredictiveStop.
    """

    aim: float = 0.0
    damping: float = 0.1
    limits: tuple[float, float] = (-1.0, -0.05)
    ending: float = 1.0
    slow: float = 1.0
    fast: float = 2.0


class Prediction(NamedTuple):
    """Where a plan ends: level, stop (m), its derivative by the level, time (s); speed now (m/s)
    and the next command (m/s²)."""

    level: float
    stop: float
    slope: float
    time: float
    speed: float
    command: float


class Estimate(NamedTuple):
    """Parameters, their information (see `information`), and the squares of data and prior."""

    theta: tuple[float, ...]
    matrix: Any
    data_cost: float
    prior_cost: float

    @property
    def information(self) -> np.ndarray:
        """The inverse covariance, [COUNT, COUNT]."""
        lower = np.tril(np.array(self.matrix).reshape(COUNT, COUNT))
        return lower + np.tril(lower, -1).T


@dataclass(frozen=True, kw_only=True)
class BrakingModel:
    """The precise braking model of metro_train, as a controller knows it.

    `davis` is the nominal running resistance (N/kN, V in km/h), `gradient_change` (m, negative:
    before the mark) where the platform's gradient begins, which the train takes in over its
    `length`. `fade_reference` as in metro_train. `rate` (m/s²) is the most by which a planned
    command changes in a `period`. Measurements have `position_sd` and `speed_sd`. With two or
    more `balises` (distances before the mark that fall, the first two count), positions before
    the first one are taken within `loose_sd`, and until the second one the wheel has a scale to
    be estimated; samples within `doubt` (m) of the two are left out. A prediction that does not
    stop ends at `horizon` (s). With a `probe` the air brake is tried out; when, is told by `probed`
    (s since the first sample, infinite: not at all) of what is asked of the model.
    """

    davis: tuple[float, float, float] = (2.031, 0.0622, 0.001807)
    gradient_change: float = -120.0
    length: float = 118.0
    fade_reference: float = 0.7
    rate: float = 0.12
    position_sd: float = 0.02
    speed_sd: float = 0.02
    balises: tuple[float, ...] = ()
    loose_sd: float = 1.0
    doubt: float = 3.0
    period: float = 0.2
    horizon: float = 60.0
    probe: Probe | None = None

    def running_resistance(self, speed: float) -> float:
        """Return the nominal deceleration (m/s²) by running resistance on the level."""
        a, b, c = self.davis
        v = KILOMETRES_PER_HOUR * speed
        return (a + b * v + c * v * v) * GRAVITY_PER_MILLE

    def motion(
        self, theta: tuple[float, ...], commands: tuple[float, ...], *, probed: float = math.inf
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (s, v) at the samples, [n + 1, 2], under n commands, and their derivatives.

        The derivatives are [n + 1, 2, COUNT - 1], by all parameters but the wheel's scale.
        """
        n, given = len(commands) + 1, _commands(commands)
        motion, slopes = np.empty((n, 2)), np.empty((n, 2, COUNT - 1))
        pointer = ctypes.POINTER(c_double)
        library.load().stop_motion(
            _setting(self), _Parameters(*theta), c_double(probed), c_int(n), _pointer(given),
            motion.ctypes.data_as(pointer), slopes.ctypes.data_as(pointer),
        )  # fmt: skip
        return motion, slopes

    def plan(
        self,
        theta: tuple[float, ...],
        commands: tuple[float, ...],
        last: float,
        level: float,
        plan: Plan,
        *,
        iterations: int = 0,
        probed: float = math.inf,
    ) -> Prediction:
        """Return the level after some iterations of the plan's law, and where it ends.

        `commands` are those since the first sample, the plan begins with the one after them and
        from the command `last`.
        """
        found, given = (c_double * 6)(), _commands(commands)
        library.load().stop_plan(
            _setting(self), _Parameters(*theta), c_double(probed), c_int(len(commands)),
            _pointer(given), c_double(last), c_double(level), _plan(plan), c_int(iterations), found,
        )  # fmt: skip
        return Prediction(*found)

    def estimate(
        self, theta: tuple[float, ...], samples: Samples, prior: Prior, *, steps: int = 1
    ) -> Estimate:
        """Return the parameters after some steps of Gauss–Newton from θ, each of them limited.

        The cost is Σ (y − ŷ)²/σ² + (θ − m)ᵀ P⁻¹ (θ − m) over positions and speeds. No parameter
        moves by more than LARGEST sd of the prior in a step, nor out of BOUND. Information and
        costs belong to the parameters before the last step. Equations that cannot be solved leave
        θ as it is.
        """
        found, matrix, cost = _Parameters(*theta), _Matrix(), (c_double * 2)()
        positions, speeds = array("d", samples.positions), array("d", samples.speeds)
        commands = _commands(samples.commands)
        library.load().stop_estimate(
            _setting(self), found, c_double(samples.probed), c_int(len(positions)),
            _pointer(commands), _pointer(positions), _pointer(speeds), _flat(prior),
            c_double(LARGEST), c_double(BOUND), c_int(steps), matrix, cost,
        )  # fmt: skip
        return Estimate(tuple(found), matrix, cost[0], cost[1])


def _commands(values: tuple[float, ...]) -> "array[float]":
    if len(values) >= MOST:
        raise ParameterError(f"a braking model holds fewer than {MOST} commands, not {len(values)}")
    return array("d", values)


def _pointer(values: "array[float]") -> Any:
    return ctypes.c_void_p(values.buffer_info()[0])


@lru_cache(maxsize=16)
def _plan(plan: Plan) -> Any:
    aim, damping, (low, high), *ending = plan
    return byref(_Plan(aim, damping, low, high, *ending))


@lru_cache(maxsize=16)
def _setting(model: BrakingModel) -> Any:
    first, second = (-1e9, -1e9) if len(model.balises) < 2 else [-b for b in model.balises[:2]]
    a, b, c = (k * GRAVITY_PER_MILLE for k in model.davis)
    probe = model.probe or Probe(0.0)
    plain = {f.name: getattr(model, f.name) for f in fields(model)}
    named = {name: plain[name] for name in _NAMES if name in plain and name != "probe"}
    setting = _Setting(
        a=a, b=KILOMETRES_PER_HOUR * b, c=KILOMETRES_PER_HOUR * KILOMETRES_PER_HOUR * c,
        change=model.gradient_change,
        reference=model.fade_reference, first=first, second=second,
        probe=probe.level, probe_length=probe.length, **named,
    )  # fmt: skip
    return byref(setting)


def _flat(prior: Prior) -> Any:
    """Return mean, information and standard deviations in one."""
    rest = _rest(prior.covariance)
    flat = (c_double * (COUNT + len(rest)))(*prior.mean)
    ctypes.memmove(ctypes.byref(flat, 8 * COUNT), rest, 8 * len(rest))
    return flat


@lru_cache(maxsize=16)
def _rest(covariance: tuple[tuple[float, ...], ...]) -> Any:
    prior = Prior((0.0,) * COUNT, covariance)
    values = (*prior.information.ravel().tolist(), *prior.deviations)
    return (c_double * len(values))(*values)
