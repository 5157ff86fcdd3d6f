"""Fuzzy adaptive PID control per sample, of a coupler's force (heavy-haul paper)."""

import math
import random
from dataclasses import dataclass
from typing import Any, Literal

from ..base.ops import clip, where
from ..cosim.block import require, require_positive
from .fuzzy.tables import check_choice
from .fuzzy_pid_rules import END, gain_rules
from .fuzzy_pid_table import gain_table, looked_up
from .sample_pid import SamplePID

Triple = tuple[Any, Any, Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class FuzzyPID(SamplePID):
    """A `SamplePID` with the gains kp + ΔKp, ki + ΔKi, kd + ΔKd (heavy-haul paper, section 3.2).

    Δ = `kp_change`, `ki_change`, `kd_change` times T(e, ec)/6, where T ∈ ±6 is the inference of
    the paper's tables (see `fuzzy_pid_rules`) from e and ec = δ, its change per sample. Both are
    clipped to ±`universe` and ±`change_universe` (in `unit`; None: the same) and mapped to ±6 (eq.
    14). Further outputs are the gains in use: `kp`, `ki`, `kd`.

    - `reading` "literal": the tables as printed. They are odd, so that the gains fall where e is
      negative, below zero in places. "folded", ours and what we recommend: T(|e|, sgn(e) ec),
      with sgn(0) = 0, which is sgn(e) T(e, ec). The gains are even in (e, ec), and a mirrored
      error gives the mirrored force, to the bit. At e = 0 they jump by 2 T(0, ec)/6. Below zero
      they fall only where ec is large and leads back to e = 0.
    - `extreme`: where NL and PL of the tables peak, 6.0 ("large") or 2.0 ("little").
    - `integral` "terms": Σ(ki e), each error by the gain of its own sample. "sum": ki Σe, so that
      all of the past follows each change of ki. Eq. 11 is lost and leaves both open; a change of
      ki then jerks the train, so "terms" is what we recommend.
    - `inference` "exact", or "table": bilinear in 121 × 121 points of it, computed as the block is
      made: some ten times quicker, on floats only.
    """

    universe: float = 100e3
    change_universe: float | None = None
    kp_change: float = 1.0
    ki_change: float = 0.006
    kd_change: float = 6.0
    reading: Literal["literal", "folded"] = "folded"
    extreme: float = 6.0
    integral: Literal["terms", "sum"] = "terms"
    inference: Literal["exact", "table"] = "exact"

    outputs = {"force": "N", "kp": "1", "ki": "1", "kd": "1"}

    def __post_init__(self) -> None:
        SamplePID.__post_init__(self)
        require_positive(self, "universe", "kp_change", "ki_change", "kd_change")
        if self.change_universe is not None:
            require_positive(self, "change_universe")
        check_choice("reading", self.reading, ("literal", "folded"))
        check_choice("integral", self.integral, ("terms", "sum"))
        check_choice("inference", self.inference, ("exact", "table"))
        require(self, self.extreme in (2.0, 6.0), f"extreme is 6.0 or 2.0, not {self.extreme!r}")
        if self.inference == "table":
            gain_table(self.extreme)  # now, and not in the first sample

    def start(self) -> tuple[float, float, float, float, float]:
        """Return (Σ(ki e) or Σe, δ, last e, last force, whether the next sample is the first)."""
        return SamplePID.start(self)

    def step(
        self, x: Any, reference: Any, measurement: Any, upper: Any, lower: Any,
        feed_forward: Any = 0.0,
    ) -> tuple[Any, Any]:  # fmt: skip
        """Return ((force, kp, ki, kd), next state)."""
        e = reference - measurement
        force, gains, following = self._sample(x, e, upper, lower, feed_forward)
        return (force, *gains), following

    def gains(self, e: Any, change: Any) -> Triple:
        """Return (kp, ki, kd) at an error and its change per sample, both in `unit`."""
        if self.reading == "folded":
            sign = where(e > 0.0, 1.0, where(e < 0.0, -1.0, 0.0))
            e, change = sign * e, sign * change
        span = self.universe if self.change_universe is None else self.change_universe
        kp, ki, kd = self._inferred(
            clip(END / self.universe * e, -END, END), clip(END / span * change, -END, END)
        )
        return (
            self.kp + self.kp_change / END * kp,
            self.ki + self.ki_change / END * ki,
            self.kd + self.kd_change / END * kd,
        )

    def _integrated(self, total: Any, ki: Any, e: Any) -> tuple[Any, Any]:
        if self.integral == "terms":
            return SamplePID._integrated(self, total, ki, e)
        grown = total + e
        return grown, ki * grown

    def _inferred(self, e: Any, ec: Any) -> Triple:
        if self.inference == "table":
            return looked_up(gain_table(self.extreme), e, ec)
        # To share the inputs' degrees among the three would save 15 % on floats, nothing in C.
        kp, ki, kd = gain_rules(self.extreme)
        return kp(e, ec), ki(e, ec), kd(e, ec)

    def table_error(self, *, points: int = 10_000, seed: int = 1) -> dict[str, tuple[float, float]]:
        """Return (rms, largest) of what the table's T differs from the exact T, for each gain.

        On the scale ±6, whatever `inference` is, at points spread at random over the universes.
        """
        generator, names = random.Random(seed), ("kp", "ki", "kd")
        exact, cells = gain_rules(self.extreme), gain_table(self.extreme)
        squares, largest = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0)
        for _ in range(points):
            e, ec = generator.uniform(-END, END), generator.uniform(-END, END)
            for name, rules, found in zip(names, exact, looked_up(cells, e, ec), strict=True):
                off = abs(found - rules(e, ec))
                squares[name] += off * off
                largest[name] = max(largest[name], off)
        return {name: (math.sqrt(squares[name] / points), largest[name]) for name in names}
