"""`railcosim sweep`: what its options mean, and one sweep from end to end."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from scipy import stats

from railcosim.base.errors import RailcosimError
from railcosim.cli import main
from railcosim.studies.sweeping import campaign_of, parse_draws


def test_draws_as_they_are_written() -> None:
    draws = parse_draws(
        ["a.b=uniform(0.9, 1.1)", "c=normal(2,0.5)", "d=triangular(1,2,4)", "e=integers(1,6)",
         "f=0.8,0.9,1", "g=linspace(0,1,3)", "h=stats.weibull_min(1.7)", "i=3", "j='x',None"]
    )  # fmt: skip
    assert draws["a.b"].support() == pytest.approx((0.9, 1.1))
    assert draws["c"].stats() == (2.0, 0.25)
    assert draws["d"].mean() == pytest.approx(7.0 / 3.0)
    assert draws["e"].pmf([0, 1, 6, 7]) == pytest.approx([0.0, 1 / 6, 1 / 6, 0.0])
    assert (draws["f"], draws["g"]) == ([0.8, 0.9, 1], [0.0, 0.5, 1.0])
    assert draws["h"].mean() == stats.weibull_min(1.7).mean()
    assert (draws["i"], draws["j"]) == ([3], ["x", None])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a.b", "write block.parameter=uniform"),
        ("a.b=", "write block.parameter=uniform"),
        ("a.b=unifrom(1,2)", "no distribution 'unifrom'; .*did you mean 'uniform'"),
        ("a.b=uniform(1)", "uniform takes numbers: low, high"),
        ("a.b=uniform(1,x)", "uniform takes numbers"),
        ("a.b=stats.kstest(1, 2)", "stats.kstest"),
        ("a.b=1,two", "'two' is no value"),
        ("a.b=uniform(2,1)", "there is no such distribution; uniform takes low, high"),
        ("a.b=normal(2,-1)", "there is no such distribution; normal takes mean, standard dev"),
        ("a.b=triangular(3,1,2)", "there is no such distribution; triangular takes low, mode"),
    ],
)
def test_what_is_no_draw(text: str, words: str) -> None:
    with pytest.raises(RailcosimError, match=words):
        parse_draws([text])


def test_a_parameter_is_drawn_once() -> None:
    with pytest.raises(RailcosimError, match="'a.b' is drawn twice"):
        parse_draws(["a.b=1,2", "a.b=uniform(1,2)"])


def test_which_case() -> None:
    with pytest.raises(RailcosimError, match="choose by --case: stop-open_loop, "):
        campaign_of("station-stop")
    with pytest.raises(RailcosimError, match="no case 'stop-smoth'.*did you mean 'stop-smooth'"):
        campaign_of("station-stop", case="stop-smoth")
    with pytest.raises(RailcosimError, match="--sampling goes with --draw"):
        campaign_of("station-stop", case="stop-smooth", sampling="sobol")
    with pytest.raises(RailcosimError, match="draws nothing by itself"):
        campaign_of("soft-switching", case="step-pid_zn")


def test_a_sweep_and_its_going_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["sweep", "station-stop", "--case", "stop-smooth", "--out", str(tmp_path)]
    command += ["--runs", "2", "--workers", "1", "--draw", "train.lag=uniform(0.2,0.3)"]
    command += ["--draw", "train.speed=5,6", "--set", "train.mass=2.2e5"]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert "train.speed [m/s]" in out
    assert "4 runs; " in out
    table = pq.read_table(tmp_path / "table.parquet")
    assert table["train.speed"].to_pylist() == [5, 5, 6, 6]
    assert table.schema.field("stop_error").metadata == {b"unit": b"cm"}
    assert main(command) == 0
    capsys.readouterr()
    assert main([*command, "--seed", "9"]) == 1
    err = capsys.readouterr().err
    assert "holds another campaign; what differs: its seed (there 4, here 9)" in err
    assert main([*command, "--seed", "9", "--fresh"]) == 0
    assert json.loads((tmp_path / "campaign.json").read_text())["seed"] == 9


def test_a_run_that_fails_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["sweep", "station-stop", "--case", "stop-smooth", "--out", str(tmp_path)]
    assert main([*command, "--workers", "1", "--draw", "train.lag=0.3,-1.0"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2].startswith("2 runs, 1 of them failed; ")
    assert lines[-1].startswith("the first that failed: run 1, ")
