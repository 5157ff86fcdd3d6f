"""The paper's tables 1 to 4 with its numbers and ours side by side, as CSV."""

from pathlib import Path

import pandas as pd

from ..results import Results
from .stations import FIDELITY, STATIONS
from .truth import V12

PAPER_1 = {
    "T1": (V12.electric_delay, "s"), "T2": (V12.electric_lag, "s"),
    "P1": (V12.electric_coefficient, "1"), "T3": (V12.air_delay, "s"), "T4": (V12.air_lag, "s"),
    "K": (V12.air_gain, "m/s2"),
}  # fmt: skip
CONTROLLERS = ("smarc_m0", "smc_m0", "pid_m0", "smarc_m2", "smarc_dob_m2", "predictive_v6",
               "predictive_v3")  # fmt: skip


def tables(folder: Path, results: Results) -> list[Path]:
    """Write the tables whose experiments were run."""
    found = {
        "table1": _parameters(results), "table2": _models(results), "table3": _stops(results),
        "table4": _spread(results),
    }  # fmt: skip
    written = []
    for name, table in found.items():
        if len(table):
            folder.mkdir(parents=True, exist_ok=True)
            written.append(folder / f"{name}.csv")
            table.to_csv(written[-1], index=False, float_format="%.6g")
    return written


def _parameters(results: Results) -> pd.DataFrame:
    """Table 1: the paper's parameters, those of the logs' trains, and what each method found."""
    methods = results.metrics.get("identification", {})
    rows = []
    for symbol, (paper, unit) in PAPER_1.items() if methods else ():
        ours = {name: row[f"identified_{symbol.lower()}"] for name, row in methods.items()}
        rows.append({"parameter": symbol, "unit": unit, "paper": paper, **ours})
    return pd.DataFrame(rows)


def _models(results: Results) -> pd.DataFrame:
    """Table 2: speed error in cm/s and computing time in s."""
    rows = []
    for name, row in results.metrics.get("fidelity", {}).items():
        paper = FIDELITY.get(name, (None, None))
        rows.append(
            {
                "model": name,
                "paper_error_cm_s": paper[0],
                "error_cm_s": row["rms_speed_error"],
                "paper_time_s": paper[1],
                "model_time_s": row["model_time"],
                "loop_time_s": row["loop_time"],
            }
        )
    return pd.DataFrame(rows)


def _stops(results: Results) -> pd.DataFrame:
    """Table 3: stop errors in cm; the paper's have no sign."""
    rows = []
    for station in STATIONS:
        ours = {name: results.get(station.key, name, "stop_error") for name in CONTROLLERS}
        if any(value is not None for value in ours.values()):
            paper = {"smarc": station.smarc, "smc": station.smc, "pid": station.pid}
            rows.append(
                {
                    "from": station.origin,
                    "to": station.name,
                    **{f"paper_{name}_cm": value for name, value in paper.items()},
                    **{f"{name}_cm": value for name, value in ours.items()},
                }
            )
    return pd.DataFrame(rows)


def _spread(results: Results) -> pd.DataFrame:
    """Table 4: mean and standard deviation in cm by station, at full spread."""
    rows = []
    for number, station in enumerate(STATIONS):
        found: dict[str, object] = {}
        for name in ("smarc_m0", "smarc_m2", "smarc_dob_m2", "predictive_v6", "predictive_v3"):
            samples = results.samples.get(("spread_full", name))
            if samples is not None:
                part = samples["stop_error"].to_numpy()[samples["station"].to_numpy() == number]
                found |= {
                    f"{name}_stops": len(part),
                    f"{name}_mean_cm": part.mean(),
                    f"{name}_sd_cm": part.std(ddof=1),
                }
        if found:
            rows.append(
                {
                    "from": station.origin,
                    "to": station.name,
                    "paper_mean_cm": station.mean,
                    "paper_variance_read_as_sd_cm": station.deviation,
                    **found,
                }
            )
    return pd.DataFrame(rows)
