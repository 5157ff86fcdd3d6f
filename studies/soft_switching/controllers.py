"""The controllers that the study compares, by the names used in its results."""

from dataclasses import replace

from ...controllers import PID, FuzzySpeed, SingleNeuron, SoftSwitching
from ...controllers.rules import SPEED_RULES
from ...cosim import Block

# Tuned on the nominal plant, K = 2.2 m/s, time constants 10.506 s and 2.938 s; the numbers are
# rounded as here. `tuning.py` has the rules.
PID_ZN = PID(kp=6.65, ti=2.83, td=0.707)  # Ziegler-Nichols, open-loop reaction curve
PID_SIMC = PID(kp=4.743, ti=8.94, td=1.972, filter_time=0.294)  # SIMC, tau_c = 1.5 s

TUNINGS = {"PID is tuned by Ziegler-Nichols": "pid_zn", "PID is tuned by SIMC": "pid_simc"}

# In every experiment.
LINE_UP: dict[str, Block] = {
    "pid_zn": PID_ZN,
    "pid_simc": PID_SIMC,
    "fuzzy": FuzzySpeed.recommended(),
    "neuron_fixed": SingleNeuron.recommended(gain_rules=None),
    "neuron": SingleNeuron.recommended(),
    "composite": SoftSwitching.recommended(),
    "composite_literal": SoftSwitching.literal(),
}

# The paper gives no sampling period: the equations as printed, at several.
LITERAL_PERIODS = {"10 ms": 0.01, "50 ms": 0.05, "100 ms": 0.1, "1 s": 1.0}


def literal_name(text: str) -> str:
    """Return the name of the literal composite at a period; 50 ms is the one of the line-up."""
    return "composite_literal" + ("" if text == "50 ms" else f"_{text.replace(' ', '')}")


# On the step only: what the choices of the line-up change. With `kick` e(−1) is 0 and not e(0).
VARIANTS: dict[str, Block] = {
    "pid_zn_kick": replace(PID_ZN, kick=True),
    "pid_simc_kick": replace(PID_SIMC, kick=True),
    "fuzzy_kick": FuzzySpeed(kick=True),
    "neuron_kick": SingleNeuron(kick=True),
    "composite_kick": SoftSwitching(
        fuzzy=FuzzySpeed(kick=True), neuron=SingleNeuron(kick=True), kick=True
    ),
    "fuzzy_sampled": FuzzySpeed(rules=replace(SPEED_RULES, defuzzify="sampled")),
    "fuzzy_literal": FuzzySpeed.literal(),
    "neuron_literal": SingleNeuron.literal(),
    **{
        literal_name(text): SoftSwitching.literal(period=period)
        for text, period in LITERAL_PERIODS.items()
        if literal_name(text) not in LINE_UP
    },
}

# What makes a variant, and its counterpart, what they are: an override leaves these.
_KICKS = ("controller.kick", "controller.fuzzy.kick", "controller.neuron.kick")
VARIANT_OWN: dict[str, tuple[str, ...]] = {
    **{name: _KICKS for kick in VARIANTS if kick.endswith("_kick") for name in (kick, kick[:-5])},
    **{literal_name(text): ("controller.period", *_KICKS) for text in LITERAL_PERIODS},
}
