"""Ensembles: seeded, counted as a whole, and kept when a run fails."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from scipy import stats

from railcosim import Constant, Diagram, Gain, Run
from railcosim.cosim.campaign import Drawn
from railcosim.cosim.scenario import Override, Scenario
from railcosim.studies.case import run_cases, with_overrides
from railcosim.studies.ensemble import Ensemble, spread
from railcosim.studies.metrics import Metrics
from railcosim.studies.results import prepare, write_data

UNITS = {"end": "m", "source.value": "m", "gain.k": "1", "at": "s", "mean_end": "m", "sd_end": "m",
         "largest_end": "m"}  # fmt: skip


def diagram() -> Diagram:
    made = Diagram("line", step=0.1)
    made.add("source", Constant(2.0, unit="m"))
    made.add("gain", Gain(1.0))
    made.connect("source.y", "gain.u")
    return made


def draw(generator: np.random.Generator) -> dict[str, float]:
    return {"source.value": generator.uniform(1.0, 3.0), "at": generator.uniform(0.0, 1.0)}


def measure(run: Run) -> Metrics:
    return {"end": float(run["gain.y"][-1])}


def summarise(samples: pd.DataFrame) -> Metrics:
    return spread(samples, "end")


def ensemble(**options: object) -> Ensemble:
    values = {
        "draws": draw,
        "summarise": summarise,
        "runs": 20,
        "seed": 7,
        "own": ("source.value",),
    }
    return Ensemble("line", "gain", diagram(), 1.0, measure, **(values | options))  # pyright: ignore


def test_samples_and_summary() -> None:
    results = run_cases("s", with_overrides([ensemble()], {"gain.k": 2.0}), UNITS)
    samples = results.samples["line", "gain"]
    assert list(samples.columns) == ["run", "source.value", "at", "end"]
    assert samples["end"].tolist() == (2.0 * samples["source.value"]).tolist()
    assert len(set(samples["source.value"])) == 20
    found = results.metrics["line"]["gain"]
    assert found["mean_end"] == pytest.approx(samples["end"].mean())
    assert found["sd_end"] == pytest.approx(samples["end"].std())
    assert results.seeds["line-gain"] == {"ensemble": 7}


def test_a_run_can_be_repeated_alone_and_seeds_matter() -> None:
    many = run_cases("s", [ensemble()], UNITS).samples["line", "gain"]
    alone = ensemble().campaign.repeat(13)
    assert alone["gain.y"][-1] == many["end"][13]
    other = run_cases("s", [ensemble(seed=8)], UNITS).samples["line", "gain"]
    assert not set(other["end"]) & set(many["end"])
    more = run_cases("s", [ensemble(runs=30)], UNITS).samples["line", "gain"]
    assert more["end"].tolist()[:20] == many["end"].tolist()


def test_scenarios_from_what_was_drawn() -> None:
    def scenario(drawn: object) -> Scenario:
        return Scenario([Override("source.y", 9.0, at=drawn["at"])])  # type: ignore[index]  # pyright: ignore

    samples = run_cases("s", [ensemble(scenario=scenario)], UNITS).samples["line", "gain"]
    assert set(samples["end"]) == {9.0}


def chain(case: Ensemble, drawn: Drawn, generator: np.random.Generator) -> list[Metrics]:
    rows: list[Metrics] = []
    for stop in range(3):
        value = drawn["source.value"] + generator.normal()
        run = case.diagram.with_values({"source.value": value}).run(case.stop)
        rows.append({"stop": float(stop), **case.measure(run)})
    return rows


def test_work_of_ones_own_with_several_rows_a_run() -> None:
    case = ensemble(
        work=chain, draws={"source.value": stats.uniform(1.0, 2.0)}, sampling="latin_hypercube"
    )
    results = run_cases("s", with_overrides([case], {"gain.k": 2.0}), UNITS | {"stop": "1"})
    samples = results.samples["line", "gain"]
    assert results.count == 20
    assert list(samples.columns) == ["run", "source.value", "stop", "end"]
    assert list(samples["stop"]) == [0.0, 1.0, 2.0] * 20
    noise = [np.random.default_rng([7, run]).normal() for run in range(20)]
    expected = 2.0 * (samples["source.value"][::3] + noise)
    assert samples["end"][::3].tolist() == expected.tolist()
    assert results.runs == {}


def test_what_was_computed_is_kept_when_a_run_fails(tmp_path: Path) -> None:
    def fails_late(generator: np.random.Generator) -> dict[str, float]:
        value = generator.uniform(1.0, 3.0)
        return {"source.value": value, "gain.k": 1e308 if value > 2.9 else 1.0}

    case = ensemble(draws=fails_late, runs=200)
    results = run_cases("s", [case], UNITS)
    samples = results.samples["line", "gain"]
    failed = samples["run"][samples["error"].notna()].tolist()
    assert len(samples) == 200
    assert 0 < len(failed) < 30
    assert results.failure is not None
    assert f"line-gain: run {failed[0]} of seed 7" in results.failure
    assert f"({len(failed)} of 200 runs failed)" in results.failure
    assert results.runs["line", "gain"].failure
    assert results.metrics == {}
    prepare(tmp_path)
    write_data(tmp_path, results)
    table = pq.read_table(tmp_path / "samples" / "line-gain.parquet")
    assert table.num_rows == len(samples)
    assert table.schema.field("end").metadata == {b"unit": b"m"}
    assert json.loads((tmp_path / "metrics.json").read_text())["experiments"] == {}
    assert "samples/line-gain.parquet" in results.written


def test_spread_of_nothing() -> None:
    assert set(spread(pd.DataFrame({"end": [np.nan]}), "end").values()) == {None}
