"""The adaptive-fuzzy study, run once by its command, and what it must show."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from railcosim import Run
from railcosim.cli import main
from railcosim.studies.adaptive_fuzzy import runaway
from railcosim.studies.adaptive_fuzzy.claims import judge
from railcosim.studies.adaptive_fuzzy.experiments import cases
from railcosim.studies.adaptive_fuzzy.line import GUARANTEED, MARK, OVERLAP
from railcosim.studies.case import with_overrides
from railcosim.studies.ensemble import Ensemble
from railcosim.studies.results import Results

RUNAWAYS = 100  # enough for every verdict; the slow test below runs 10,000


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runaway, "RUNS", RUNAWAYS)
        assert main(["run", "adaptive-fuzzy", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def metrics(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "metrics.json").read_text())["experiments"]


@pytest.fixture(scope="module")
def ledger(folder: Path) -> list[dict[str, str]]:
    return json.loads((folder / "ledger.json").read_text())


# The sheet's table: times within 2 % and its own rounding, steady error 0.01 m/s, acceleration
# 0.02 m/s²; overshoot in points of percent.
SHEET = {
    ("regulation", "fuzzy"): (4.44, 8.3, 0.0, 0.0, 0.93),
    ("regulation", "adaptive"): (3.83, 5.5, 1.8, 0.0, 0.86),
    ("regulation_absolute_30", "fuzzy"): (4.16, 7.2, 1.5, 0.037, 1.06),
    ("regulation_absolute_30", "adaptive"): (3.39, 4.9, 1.8, 0.044, 1.06),
    ("regulation_absolute_10", "universe"): (3.29, 4.8, 1.8, 0.031, 1.02),
}


@pytest.mark.parametrize("suffix", ["", "_dc"])
@pytest.mark.parametrize(("experiment", "controller"), SHEET)
def test_regulation_is_the_sheets(
    metrics: dict, experiment: str, controller: str, suffix: str
) -> None:
    rise, settle, overshoot, steady, acceleration = SHEET[experiment, controller]
    found = metrics[experiment + suffix][controller]
    assert found["rise_time"] == pytest.approx(rise, rel=0.02)
    assert found["settling_time"] == pytest.approx(settle, rel=0.02)
    assert found["overshoot"] == pytest.approx(overshoot, abs=0.1)
    # In percent of a step of 3 m/s down; the sheet has the distance alone.
    assert abs(found["steady_state_error"]) * 0.03 == pytest.approx(steady, abs=0.01)
    assert found["max_acceleration"] == pytest.approx(acceleration, abs=0.02)


def test_the_plants_agree_in_every_experiment(folder: Path, metrics: dict) -> None:
    pairs = 0
    for path in (folder / "traces").glob("*.parquet"):
        experiment, _, controller = path.stem.partition("-")
        twin = path.with_name(f"{experiment}_dc-{controller}.parquet")
        if twin.exists():
            one, other = (Run.load(p)["train.speed"] for p in (path, twin))
            assert np.max(np.abs(one - other)) < 1e-9, path.stem
            pairs += 1
    plain = [e for e in metrics if not e.endswith("_dc") and e != "runaway"]
    assert pairs == sum(len(metrics[e]) for e in plain)


def test_every_fuzzy_run_within_the_handles_limit_is_comfortable(metrics: dict) -> None:
    for experiment, rows in metrics.items():
        if experiment.startswith("regulation") and "wide" not in experiment:
            for name, row in rows.items():
                assert name == "pid_zn" or row["max_acceleration"] < 1.5
    assert metrics["regulation_wide"]["pid_zn"]["max_acceleration"] > 1.5


def test_the_pattern_stops_undisturbed(folder: Path, metrics: dict) -> None:
    for name, row in metrics["pattern"].items():
        assert row["interventions"] == row["warnings"] == 0.0
        assert abs(row["stop_error"]) < 120.0
        run = Run.load(folder / "traces" / f"pattern-{name}.parquet")
        assert run["train.speed"][-1] == 0.0  # exactly, on its brake
        assert run["train.position"][-1] - MARK == pytest.approx(row["stop_error"] / 100.0)
    assert abs(metrics["pattern"]["adaptive"]["stop_error"]) < 30.0


def limit(place: np.ndarray) -> np.ndarray:
    """The line's limit curve, written anew: 14 m/s, 11 from 150 m, and the danger point."""
    squared = np.minimum(14.0**2, 11.0**2 + 2.0 * GUARANTEED * np.maximum(150.0 - place, 0.0))
    stop = 2.0 * GUARANTEED * np.maximum(MARK + OVERLAP - place, 0.0)
    return np.sqrt(np.minimum(squared, stop))


def test_runaways_are_stopped_below_the_curve(folder: Path, metrics: dict) -> None:
    caught, free = metrics["runaway"]["atp"], metrics["runaway"]["no_atp"]
    assert caught["runs"] == free["runs"] == RUNAWAYS
    assert caught["violations"] == 0.0
    assert caught["least_margin"] > 0.0
    assert caught["standing"] == caught["emergencies"] == RUNAWAYS
    assert free["violations"] == RUNAWAYS
    samples = pq.read_table(folder / "samples" / "runaway-atp.parquet").to_pandas()
    assert (samples["emergencies"] == 1.0).all()  # latched: it comes once, and stays
    run = Run.load(folder / "traces" / "runaway-atp.parquet")
    margin = limit(run["train.position"]) - run["train.speed"]
    assert np.min(margin) == pytest.approx(samples["least_margin"][0], abs=1e-9)
    both = [
        pq.read_table(folder / "samples" / f"runaway-{n}.parquet").to_pandas()[
            ["train.mass", "train.adhesion", "train.brake_lag", "link.time", "fault_time"]
        ]
        for n in ("atp", "no_atp")
    ]
    assert both[0].equals(both[1])  # the same trains


@pytest.mark.slow
def test_ten_thousand_runaways() -> None:
    """The same, over 10,000 trains; about two minutes."""
    ensembles = {c.controller: c for c in cases() if isinstance(c, Ensemble)}
    least = dict.fromkeys(ensembles, np.inf)
    violations = dict.fromkeys(ensembles, 0)
    for name, ensemble in ensembles.items():
        campaign = replace(ensemble, runs=10_000).campaign
        for number in range(10_000):
            run = campaign.repeat(number)
            margin = float(np.min(limit(run["train.position"]) - run["train.speed"]))
            least[name] = min(least[name], margin)
            violations[name] += margin < 0.0
    print(f"least margin {least} m/s, passed {violations}")
    assert violations == {"atp": 0, "no_atp": 10_000}
    assert least["atp"] > 0.0


def test_the_ledger(ledger: list[dict[str, str]]) -> None:
    verdicts = {e["claim"]: e["verdict"] for e in ledger}
    assert len(ledger) == len(verdicts) == 14
    found = {claim.split()[0]: v for claim, v in verdicts.items()}
    assert verdicts["The acceleration stays within 1.5 m/s²"] == "holds"
    faster = verdicts["Adaptive fuzzy control is faster than conventional fuzzy control"]
    assert faster == "holds if ku = 10 on top of the base notch or ku = 30, absolute"
    accurate = verdicts["Adaptive fuzzy control is more accurate than conventional fuzzy control"]
    assert accurate == "does not hold"
    assert found["One"] == "cannot be verified"
    assert all(all(entry.values()) for entry in ledger)


def test_verdicts_are_computed_from_the_run(folder: Path, metrics: dict, ledger: list) -> None:
    before = {e["claim"]: e["verdict"] for e in ledger}
    runs = {}
    for path in (folder / "traces").glob("*.parquet"):
        experiment, _, controller = path.stem.partition("-")
        runs[experiment, controller] = Run.load(path)
    same = judge(Results("adaptive-fuzzy", {}, metrics, runs))
    assert {e.claim: e.verdict for e in same} == before
    for (a, b), claim in {
        ("adaptive", "fuzzy"): "Adaptive fuzzy control is faster",
        ("universe", "scaling"): "Contracting the universe",
        ("adaptive", "pid_zn"): "Passengers ride",
        ("adaptive", "scaling"): "With adaptive fuzzy control the train stops",
        ("atp", "no_atp"): "The ATP's emergency brake",
    }.items():
        other = {a: b, b: a}
        rows: Any = {e: {other.get(c, c): m for c, m in row.items()} for e, row in metrics.items()}
        swapped: Any = {(e, other.get(c, c)): run for (e, c), run in runs.items()}
        after = judge(Results("adaptive-fuzzy", {}, rows, swapped))
        changed = [e.claim for e in after if e.verdict != before[e.claim]]
        assert any(c.startswith(claim) for c in changed), claim


def test_what_was_not_run_cannot_be_verified() -> None:
    for entry in judge(Results("adaptive-fuzzy", {})):
        table = entry.where == "section 2.3, table 2"  # needs no run
        assert entry.verdict == ("holds" if table else "cannot be verified")


def test_figures(folder: Path) -> None:
    names = ["fig1_pattern", "fig4_regulation", "fig5_acceleration", "fig6_factors", "runaway",
             "factors_over_error", "gamma", "output_readings", "notches"]  # fmt: skip
    for name in names:
        ET.parse(folder / "figures" / f"{name}.svg")
        assert (folder / "figures" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"


def test_two_runs_are_bit_identical(folder: Path) -> None:
    for case in with_overrides(cases(), {}):
        if case.name in ("regulation-adaptive", "pattern_dc-universe", "regulation_notches-fuzzy"):
            run = case.diagram.run(case.stop, progress=False)
            first = Run.load(folder / "traces" / f"{case.name}.parquet")
            assert run.values.tobytes() == first.values.tobytes()


def test_overrides_leave_what_makes_an_experiment() -> None:
    values = {"controller.ku": 20.0, "controller.limits": (-5.0, 5.0)}
    found = {c.name: c.diagram.blocks for c in with_overrides(cases(), values)}
    assert found["regulation-adaptive"]["controller"].parameters()["ku"] == 20.0
    assert found["regulation_absolute_30-adaptive"]["controller"].parameters()["ku"] == 30.0
    assert found["regulation_wide-fuzzy"]["controller"].parameters()["limits"] == (-30.0, 30.0)
    assert found["start-fuzzy"]["train"].parameters()["speed"] == 0.0
    assert found["pattern-fuzzy"]["train"].parameters()["speed"] == 10.0
