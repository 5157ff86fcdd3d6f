"""Soft switching between fuzzy and single-neuron control of speed."""

from dataclasses import dataclass, field, replace
from typing import Any, Self

from ..base.ops import where
from ..cosim.block import Block, require_finite, require_positive
from .error_rate import Rate, error_rate, require_rate
from .fuzzy import Sugeno
from .fuzzy_speed import FuzzySpeed
from .rules import SWITCHING_RULES
from .single_neuron import SingleNeuron


@dataclass(frozen=True, kw_only=True, slots=True)
class SoftSwitching(Block):
    """u = cf · u_fuzzy + cnp · u_neuron with cf + cnp = 1 (soft-switching paper, eq. 9 to 11).

    cf comes from the Takagi-Sugeno rules of table 3 for ke · e and kec · ec. Both controllers
    run all the time; the neuron keeps its own u(k−1). `period` is that of all three.
    """

    fuzzy: FuzzySpeed = field(default_factory=FuzzySpeed)
    neuron: SingleNeuron = field(default_factory=SingleNeuron)
    switch: Sugeno = SWITCHING_RULES
    ke: float = 1.0
    kec: float = 1.0
    rate: Rate = "derivative"
    kick: bool = False
    period: float = 0.05

    inputs = {"reference": "m/s", "measurement": "m/s"}
    outputs = {"u": "1", "cf": "1", "cnp": "1", "u_fuzzy": "1", "u_neuron": "1"}

    def __post_init__(self) -> None:
        require_finite(self, "ke", "kec")
        require_positive(self, "period")
        for name in ("fuzzy", "neuron"):
            object.__setattr__(self, name, replace(getattr(self, name), period=self.period))
        require_rate(self, self.rate)

    @classmethod
    def recommended(cls, *, period: float = 0.05) -> Self:
        """Return our reading of the paper; see both controllers' `recommended`."""
        return cls(period=period)

    @classmethod
    def literal(cls, *, period: float = 0.05) -> Self:
        """Return the paper to the letter; see both controllers' `literal`."""
        fuzzy, neuron = FuzzySpeed.literal(), SingleNeuron.literal()
        return cls(fuzzy=fuzzy, neuron=neuron, rate="difference", kick=True, period=period)

    def parameters(self) -> dict[str, Any]:
        """Return the parameters; the period is the composite's alone."""
        found = Block.parameters(self)
        return {n: v for n, v in found.items() if n not in ("fuzzy.period", "neuron.period")}

    def start(self) -> tuple[Any, ...]:
        """Return (fuzzy state, neuron state, last e, whether the next sample is the first)."""
        return self.fuzzy.start(), self.neuron.start(), 0.0, 0.0 if self.kick else 1.0

    def step(self, x: Any, reference: Any, measurement: Any) -> tuple[Any, Any]:
        """Return ((u, cf, cnp, u_fuzzy, u_neuron), next state)."""
        fuzzy, neuron, last, first = x
        u_fuzzy, fuzzy = self.fuzzy.step(fuzzy, reference, measurement)
        (u_neuron, _), neuron = self.neuron.step(neuron, reference, measurement)
        e = reference - measurement
        change = e - where(first > 0.5, e, last)
        ec = error_rate(change, self.rate, self.period)
        cf = self.switch(self.ke * e, self.kec * ec)
        cnp = 1.0 - cf
        u = cf * u_fuzzy + cnp * u_neuron
        return (u, cf, cnp, u_fuzzy, u_neuron), (fuzzy, neuron, e, 0.0)
