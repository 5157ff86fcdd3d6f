"""The paper's claims, judged by what the run measured. No verdict is written by hand."""

from ..ledger import Entry
from ..results import Results
from . import claims_line, claims_method, claims_regulation

JUDGES = (
    claims_method.plant,
    claims_regulation.faster,
    claims_regulation.faster_than_pid,
    claims_regulation.accurate,
    claims_regulation.contraction,
    claims_regulation.acceleration,
    claims_regulation.comfortable,
    claims_method.ke,
    claims_method.gamma_table,
    claims_method.gamma_on_the_way,
    claims_line.stops,
    claims_line.one_step,
    claims_line.supervised,
    claims_line.literally_supervised,
)


def judge(results: Results) -> list[Entry]:
    """Return the ledger: one entry for each claim."""
    return [claim(results) for claim in JUDGES]
