"""The ledger of the heavy-haul paper."""

from ..ledger import Entry
from ..results import Results
from . import claims_control, claims_model


def judge(results: Results) -> list[Entry]:
    """Return the paper's claims, each with what the runs say of it."""
    return [*claims_model.judge(results), *claims_control.judge(results)]
