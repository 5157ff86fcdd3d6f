"""The paper's claims, judged by what the run measured. No verdict is written by hand."""

from ..ledger import Entry
from ..results import Results
from . import claims_models, claims_ours, claims_stops


def judge(results: Results) -> list[Entry]:
    """Return the ledger: one entry for each claim; ours last."""
    claims = (
        claims_models.more_precise, claims_models.as_fast, claims_models.worst_when_slow,
        claims_models.identified, claims_stops.within_8_cm, claims_stops.order,
        claims_stops.repeated, claims_stops.variance, claims_stops.delays, claims_ours.one_answer,
        claims_ours.predictive, claims_ours.learning, claims_ours.limits, claims_ours.energy,
        claims_ours.arrival,
    )  # fmt: skip
    return [claim(results) for claim in claims]
