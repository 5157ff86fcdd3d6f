"""The study precise-braking: its stops, campaigns and ledger, and runs on a line of one's own."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railcosim.cli import main
from railcosim.studies.case import Case, run_cases, with_overrides
from railcosim.studies.metrics import UNITS
from railcosim.studies.precise_braking import STUDY, line_cases, spreads, stopping
from railcosim.studies.precise_braking.stations import STATIONS
from railcosim.studies.results import Results

LINE = {
    "metadata": {"id": "harbour", "library version": "TTOBench v1.4",
                 "stop names": ["Oak", "Pine", "Harbour"]},
    "stops": {"unit": "m", "values": [0, 700, 1600]},
    "speed limits": {"units": {"position": "m", "velocity": "km/h"},
                     "values": [[0, 60], [1000, 70]]},
    "gradients": {"units": {"position": "m", "slope": "permil"},
                  "values": [[k * 40, (k % 5) - 2] for k in range(17)]},
}  # fmt: skip


@pytest.fixture(scope="module")
def stops() -> Results:
    """The nominal stops of every station with the observer, and all base steps."""
    wanted = ("smarc_dob_m2", "predictive_v6", *stopping.STEPS)
    cases = [case for case in stopping.cases() if case.controller in wanted]
    return run_cases("precise-braking", with_overrides(cases, {}), UNITS)


def test_every_nominal_stop_is_within_ten_centimetres(stops: Results) -> None:
    assert stops.failure is None
    for station in STATIONS:
        for name in ("smarc_dob_m2", "predictive_v6"):
            error = stops.get(station.key, name, "stop_error")
            assert error is not None
            assert abs(error) <= 10.0


def test_the_base_step_does_not_matter(stops: Results) -> None:
    """0.2, 0.1, 0.02 and 0.01 s with delays on none of their grids, within 1e-6 m."""
    errors = [stops.get("base_step", name, "stop_error") for name in stopping.STEPS]
    assert None not in errors
    assert max(errors) - min(errors) <= 1e-4  # type: ignore[type-var, operator]


def test_the_stop_error_is_that_of_the_trace(stops: Results) -> None:
    run = stops.runs[STATIONS[0].key, "smarc_dob_m2"]
    assert run["train.standstill"][-1] == 1
    assert run["train.speed"][-1] == 0.0
    error = stops.get(STATIONS[0].key, "smarc_dob_m2", "stop_error")
    assert error == pytest.approx(100.0 * run["train.position"][-1], rel=1e-12)


def small(experiment: str, name: str) -> Any:
    found = {(c.experiment, c.controller): c for c in spreads.cases()}
    return replace(found[experiment, name], runs=1)  # type: ignore[type-var]


def test_a_campaign_of_stops_and_one_of_chains(monkeypatch: pytest.MonkeyPatch) -> None:
    """One stop a station, every station; chains have rows for each stop."""
    monkeypatch.setattr(spreads, "CHAIN", spreads.SETTLED + 2)
    chains = small("learned_benign", "predictive_v3")
    chains = replace(chains, draws={"station": [3]})
    cases: list[Case] = [small("spread_full", "smarc_dob_m2"), chains]
    results = Results("precise-braking", dict(UNITS))
    for case in cases:
        case.collect(results, lambda n: None, "serial")
    spread = results.samples["spread_full", "smarc_dob_m2"]
    assert sorted(spread["station"]) == list(range(7))
    assert spread["true_mass_ratio"].between(0.94, 1.06).all()
    assert np.abs(spread["stop_error"]).max() < 100.0
    chain = results.samples["learned_benign", "predictive_v3"]
    assert list(chain["stop"]) == list(range(spreads.SETTLED + 2))
    assert results.get("learned_benign", "predictive_v3", "stops") == 2.0


def test_the_ledger_tells_what_could_not_be_verified(stops: Results) -> None:
    """Nothing but the stops was run: claims on anything else are not judged."""
    ledger = {entry.claim: entry.verdict for entry in STUDY.judge(stops)}
    step = "Ours: the stop does not depend on the master's base step"
    variance = "Ours: table 4's variance is the standard deviation of four stops, in whole "
    assert ledger.pop(step) == "holds"
    assert ledger.pop(variance + "centimetres") == "holds"
    assert set(ledger.values()) == {"cannot be verified"}


def test_the_ledger_follows_the_measurements(stops: Results) -> None:
    worse = Results("precise-braking", dict(UNITS))
    worse.metrics = json.loads(json.dumps(stops.metrics))
    error = stops.get("base_step", "step_0_2", "stop_error")
    assert error is not None
    worse.metrics["base_step"]["step_0_2"]["stop_error"] = error + 0.01
    ledger = {entry.claim: entry.verdict for entry in STUDY.judge(worse)}
    assert ledger["Ours: the stop does not depend on the master's base step"] == "does not hold"


def test_figures_are_those_whose_experiments_were_run(stops: Results) -> None:
    assert set(STUDY.figures(stops)) == {"figure7", "figure8"}
    assert STUDY.figures(Results("precise-braking", {})) == {}


def test_a_run_on_a_line_of_ones_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """More gradients than the usual FMU has room for; arrival within 1 s and 30 cm."""
    monkeypatch.setattr(line_cases, "SHARES", (1.1, 1.2))
    line = tmp_path / "harbour.json"
    line.write_text(json.dumps(LINE))
    out = tmp_path / "out"
    way = ["--line", str(line), "--from", "Oak", "--to", "Pine"]
    assert main(["run", "precise-braking", *way, "--out", str(out)]) == 0
    metrics = json.loads((out / "metrics.json").read_text())["experiments"]
    for row in metrics["run"].values():
        assert abs(row["late"]) <= 1.0
        assert abs(row["stop_error"]) <= 30.0
        assert row["emergency"] == row["warning"] == 0.0
    energies = [row["planned_energy"] for row in metrics["energy"].values()]
    assert energies == sorted(energies, reverse=True)
    assert (out / "figures" / "run.png").stat().st_size > 10_000
    told = json.loads((out / "run.json").read_text())["command"]
    assert told.endswith(f"--line {line} --from Oak --to Pine")
    assert "claims" not in capsys.readouterr().out


def test_a_run_that_misses_its_plan_is_told() -> None:
    results = Results("precise-braking", dict(UNITS))
    good: dict[str, float | None] = {"stop_error": 3.0, "late": -0.1, "emergency": 0.0}
    results.metrics["run"] = {
        "fast": good, "far": {**good, "stop_error": -6800.0},
        "stopped": {**good, "emergency": 1.0}, "never": {**good, "late": None},
    }  # fmt: skip
    told = STUDY.unmet(results)
    assert [words.split("'")[1] for words in told] == ["far", "stopped", "never"]
    assert "braked by the ATP" in told[1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["precise-braking", "--from", "Lishuiqiao"], "needs --from and --to; stops: Tiantong"),
        (["precise-braking", "--from", "Lishuiqiao", "--to", "Lishuiqao"], "Lishuiqiao"),
        (["precise-braking", "--from", "Lishuiqiao", "--to", "Lishuiqiao"], "Lishuiqiao"),
        (["precise-braking", "--line", "none.json", "--from", "A", "--to", "B"], "none.json"),
        (["station-stop", "--from", "A", "--to", "B"], "has no line"),
    ],
)
def test_mistakes_on_a_line(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", *words, "--out", str(tmp_path / "out")]) == 1
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()
