"""The paper's table 3, as CSV."""

from pathlib import Path

from ...controllers.fuzzy import write_table
from ...controllers.fuzzy.relation import LEVEL_DEFUZZIFIERS
from ...controllers.stop_rules import E_LEVELS, EC_LEVELS, STOP_RELATION
from ..results import Results


def tables(folder: Path, results: Results) -> list[Path]:
    """Write the query table (rows E, columns EC, levels of U) with either defuzzifier."""
    folder.mkdir(parents=True, exist_ok=True)
    return [
        write_table(folder / f"table3_{how}.csv", STOP_RELATION.table(how), E_LEVELS, EC_LEVELS)
        for how in LEVEL_DEFUZZIFIERS
    ]
