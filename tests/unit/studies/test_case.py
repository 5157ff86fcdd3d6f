import json
from dataclasses import replace
from pathlib import Path

import pytest

from railcosim import Diagram, Fmu, Gain, Ramp, Run
from railcosim.base.errors import DiagramError, FileError, ParameterError
from railcosim.fmus import build
from railcosim.studies.case import Case, run_cases, with_overrides
from railcosim.studies.metrics import Metrics
from railcosim.studies.results import prepare, write_data, write_run
from tests import plants


def case(name: str, gain: float) -> Case:
    diagram = Diagram(name, step=0.1)
    diagram.add("ramp", Ramp(slope=1.0))
    diagram.add("k" if gain > 1.0 else "small", Gain(gain))
    diagram.connect("ramp.y", "k.u" if gain > 1.0 else "small.u")
    return Case("ramp", name, diagram, 1.0, lambda run: {"end": float(run.values[-1, -1])})


def test_overrides_apply_where_the_parameter_exists() -> None:
    changed = with_overrides([case("a", 2.0), case("b", 0.5)], {"k.k": 7.0, "ramp.slope": 2.0})
    results = run_cases("test", changed, {"end": "1"})
    assert results.metrics == {"ramp": {"a": {"end": 14.0}, "b": {"end": 1.0}}}
    assert results.parameters["ramp"]["a"]["k.k"] == 7.0


def test_what_makes_an_experiment_stays_under_overrides() -> None:
    """A factor of 1.2 is 1.2 times the override; a case's own parameter stays."""
    more = replace(case("more", 2.0), factors={"k.k": 1.2})
    own = replace(case("own", 3.0), own=("k.k",))
    results = run_cases("test", with_overrides([case("a", 2.0), more, own], {"k.k": 10.0}), {})
    ends = {name: row["end"] for name, row in results.metrics["ramp"].items()}
    assert ends == pytest.approx({"a": 10.0, "more": 12.0, "own": 3.0})
    plain = run_cases("test", with_overrides([more], {}), {})
    assert plain.metrics["ramp"]["more"]["end"] == pytest.approx(2.4)


def test_an_override_that_fits_nowhere_is_an_error() -> None:
    both = [case("a", 2.0), case("b", 0.5)]
    with pytest.raises(DiagramError, match="no block 'kk'"):
        with_overrides(both, {"kk.k": 1.0})
    with pytest.raises(
        ParameterError, match="no 'k' of the study has a parameter 'kp'; there are: k"
    ):
        with_overrides(both, {"k.kp": 1.0})
    with pytest.raises(ParameterError, match="valid number"):
        with_overrides(both, {"k.k": "one"})
    with pytest.raises(ParameterError, match=r"block\.parameter"):
        with_overrides(both, {"k": 1.0})


def test_a_failing_run_loses_nothing_before_it(tmp_path: Path) -> None:
    diagram = Diagram("blow", step=0.1)
    diagram.add("plant", Fmu(build(plants.blow_up())))
    bad = replace(case("bad", 2.0), diagram=diagram, stop=2.0)
    results = run_cases("test", [case("a", 2.0), bad, case("c", 2.0)], {"end": "1"})
    assert results.failure is not None
    assert "ramp-bad: block 'plant': fmi2DoStep" in results.failure
    assert list(results.metrics["ramp"]) == ["a"]
    prepare(tmp_path / "out")
    write_data(tmp_path / "out", results)
    write_run(tmp_path / "out", results, command="x", overrides={}, seconds=0.0)
    names = {p.name for p in (tmp_path / "out" / "traces").iterdir()}
    assert names == {"ramp-a.parquet", "ramp-bad.parquet"}
    assert json.loads((tmp_path / "out" / "run.json").read_text())["failure"] == results.failure


def test_an_interrupted_study_keeps_the_runs_before() -> None:
    def interrupt(run: Run) -> Metrics:
        raise KeyboardInterrupt

    stopped = replace(case("stopped", 2.0), measure=interrupt)
    results = run_cases("test", [case("a", 2.0), stopped, case("c", 2.0)], {"end": "1"})
    assert results.failure == "ramp-stopped: interrupted"
    assert list(results.metrics["ramp"]) == ["a"]


def test_an_earlier_runs_results_are_cleared_and_nothing_else(tmp_path: Path) -> None:
    prepare(tmp_path)
    results = run_cases("test", [case("a", 2.0)], {"end": "1"})
    write_data(tmp_path, results)
    write_run(tmp_path, results, command="x", overrides={}, seconds=0.0)
    for name in ("traces/mine.parquet", "figures/mine.png", "mine.txt"):
        (tmp_path / name).touch()
    prepare(tmp_path)
    left = {p.name for p in tmp_path.rglob("*") if p.is_file()}
    assert left == {"mine.parquet", "mine.png", "mine.txt"}


def test_a_folder_that_cannot_be_written_is_named_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(FileError, match="cannot write to"):
        prepare(tmp_path / "file")
