"""The paper's claims, judged by what the run measured. No verdict is written by hand."""

from ..ledger import Entry
from ..results import Results
from . import claims_profile, claims_robustness, claims_step

JUDGES = (
    claims_step.fast,
    claims_step.static_error,
    claims_step.removes_error,
    claims_step.beats_others,
    claims_step.smooth,
    claims_step.weights,
    claims_robustness.fuzzy_disturbed,
    claims_robustness.pulse,
    claims_robustness.gain,
    claims_robustness.frequency,
    claims_robustness.perturbed_static_error,
    claims_robustness.perturbed_rise,
    claims_robustness.perturbed_overshoot,
    claims_profile.tracking,
    claims_profile.first_seconds,
    claims_profile.later_traction,
    claims_profile.cruise,
    claims_profile.cruise_static_error,
    claims_step.as_printed,
)


def judge(results: Results) -> list[Entry]:
    """Return the ledger: one entry for each claim, in the paper's order; ours last."""
    return [claim(results) for claim in JUDGES]
