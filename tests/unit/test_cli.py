"""The command line: what it prints, and one clear line with exit code 1 for every mistake."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from railcosim import Run
from railcosim.cli import main
from tests.unit.cosim.test_fmu_block import rewrite

CART = """
from railcosim.models import Plant

def cart():
    with Plant("cart") as plant:
        force = plant.input("force", unit="N")
        speed = plant.state("speed", unit="m/s", output=True)
        plant.der(speed, force / 1000.0)
    return plant
"""


def fails(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main([str(a) for a in arguments]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("railcosim: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return err


def test_lists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["studies"]) == 0
    assert "soft-switching" in capsys.readouterr().out
    assert main(["models"]) == 0
    out = capsys.readouterr().out
    assert "second_order_train" in out
    assert "natural_frequency" in out
    assert "[rad/s]" in out


def test_export_info_check_simulate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a stranger would: with a plant, inputs and outputs of one's own."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(CART)
    Path("in.csv").write_text("time,force\n0,100\n5,100\n5,-100\n")
    assert main(["export", "mine.py:cart"]) == 0
    assert main(["info", "cart.fmu"]) == 0
    out = capsys.readouterr().out
    assert "co-simulation" in out
    assert "force" in out
    assert main(["check", "cart.fmu"]) == 0
    assert capsys.readouterr().out.endswith("passed\n")
    assert main(["simulate", "cart.fmu", "--input", "in.csv", "--out", "r.parquet"]) == 0
    run = Run.load("r.parquet")
    assert run.columns == ("force", "speed")
    assert run["speed"][-1] == pytest.approx(0.0, abs=1e-12)
    assert run["speed"].max() == pytest.approx(0.5, abs=1e-12)
    assert main(["simulate", "cart.fmu", "--set", "force=100", "--stop", "2", "--step", "1"]) == 0
    lines = Path("result.csv").read_text().splitlines()
    assert lines[0] == "time,speed"
    assert [float(line.split(",")[1]) for line in lines[1:]] == pytest.approx([0.0, 0.1, 0.2])


def test_check_fails_with_exit_code_1(
    tmp_path: Path, train_fmu: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = rewrite(train_fmu, tmp_path / "bad.fmu", lambda n, d: (n, d.replace(b'"2.2"', b'"2.3"')))
    assert main(["check", str(path)]) == 1
    assert "FAIL" in capsys.readouterr().out


def test_mistakes_with_studies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "did you mean 'soft-switching'" in fails(capsys, "run", "soft-swiching")
    base = ("run", "soft-switching", "--out", tmp_path / "r", "--set")
    assert "no block 'trian'" in fails(capsys, *base, "trian.gain=1")
    assert "did you mean 'gain'" in fails(capsys, *base, "train.gian=1")
    assert "instance of Mamdani" in fails(capsys, *base, "controller.rules=3")
    assert "is a Real, 'high' is not" in fails(capsys, *base, "train.gain=high")
    assert "outside [0.001, inf]" in fails(capsys, *base, "train.natural_frequency=0")
    assert "valid number" in fails(capsys, *base, "controller.kp='a'")
    assert "kp must be a positive" in fails(capsys, *base, "controller.kp=-1")
    assert "NAME=VALUE" in fails(capsys, *base, "train.gain")
    assert "block.parameter" in fails(capsys, *base, "gain=1")
    (tmp_path / "file").touch()
    assert "cannot write" in fails(capsys, "run", "soft-switching", "--out", tmp_path / "file")


def test_mistakes_with_fmus(
    tmp_path: Path, train_fmu: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    exchange = rewrite(
        train_fmu,
        tmp_path / "me.fmu",
        lambda n, d: (n, d.replace(b"CoSimulation", b"ModelExchange")),
    )
    bare = rewrite(
        train_fmu, tmp_path / "bare.fmu", lambda n, d: None if "binaries" in n else (n, d)
    )
    for command in ("info", "check", "simulate"):
        assert "no file" in fails(capsys, command, tmp_path / "none.fmu")
        assert "not an FMU, or is damaged" in fails(capsys, command, text)
    assert "no co-simulation interface" in fails(capsys, "simulate", exchange)
    assert "has no binary for" in fails(capsys, "simulate", bare)
    assert "nothing to set named 'gian'" in fails(capsys, "simulate", train_fmu, "--set", "gian=1")
    assert "step must be a positive" in fails(capsys, "simulate", train_fmu, "--step", "-1")
    assert "no file" in fails(capsys, "simulate", train_fmu, "--input", tmp_path / "x.csv")
    assert "nothing to set named 'path'" in fails(capsys, "simulate", train_fmu, "--set", "path=1")
    assert "nothing to set named 'period'" in fails(
        capsys, "simulate", train_fmu, "--set", "period=1"
    )
    assert "must end in .parquet or .csv" in fails(
        capsys, "simulate", train_fmu, "--out", tmp_path / "x.txt"
    )
    assert "no folder" in fails(capsys, "simulate", train_fmu, "--out", tmp_path / "no" / "x.csv")


ORE = """
schema: railcosim-consist
schema_version: 1
name: ore
draft_gears: {G: {}}
couplers: {C: {gear: G}}
vehicles:
  Engine:
    mass: 120
    length: 20
    resistance: {constant: 2, linear: 0.01, quadratic: 0.0003, starting: 5}
    traction: {points: [[0, 400], [36, 300]]}
  Wagon: {like: Engine, mass: 80, traction: null}
train: [{vehicle: Engine}, {vehicle: Wagon, times: 2}]
"""


def test_export_of_a_train_of_ones_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("ore.yaml").write_text(ORE)
    base = ("export", "heavy_haul_train", "--consist")
    assert main([*base, "ore.yaml", "--gradients", "3", "--out", "ore.fmu"]) == 0
    capsys.readouterr()
    assert main(["info", "ore.fmu"]) == 0
    out = capsys.readouterr().out
    assert "vehicle[3].speed" in out and "vehicle[4].speed" not in out
    assert "gradient[3]" in out and "gradient[4]" not in out
    for count in ("0", "-1", "1001"):
        found = fails(capsys, *base, "ore.yaml", "--gradients", count)
        assert f"gradients is 1 to 1000, not {count}" in found
    assert "gradients is 1 to 1000, not 0" in fails(
        capsys, "export", "heavy-haul-train", "--gradients", "0"
    )
    assert "invalid int value: 'two'" in fails(capsys, *base, "ore.yaml", "--gradients", "two")
    assert "cannot read none.yaml" in fails(capsys, *base, "none.yaml")
    Path("ore.yaml").write_text(ORE.replace("train:", "trian:"))
    assert "ore.yaml:14: trian: unknown key" in fails(capsys, *base, "ore.yaml")
    for option in (("--consist", "ore.yaml"), ("--gradients", "0")):
        found = fails(capsys, "export", "second_order_train", *option)
        assert "--consist and --gradients are for heavy_haul_train" in found


def test_a_study_without_a_line_names_what_it_does_not_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = ("run", "heavy-haul", "--out", tmp_path / "r")
    assert fails(capsys, *base, "--train", "x").endswith("has no line: it takes no --train\n")
    found = fails(capsys, *base, "--from", "A", "--to", "B")
    assert found.endswith("it takes no --from and --to\n")
    assert not (tmp_path / "r").exists()


def test_mistakes_with_models(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "did you mean" in fails(capsys, "export", "second_order")
    out = tmp_path / "t.fmu"
    base = ("export", "second_order_train", "--out")
    assert "no platform 'solaris'" in fails(capsys, *base, out, "--platform", "solaris")
    assert "no folder" in fails(capsys, *base, tmp_path / "no" / "t.fmu")
    broken = tmp_path / "broken.py"
    broken.write_text("def f(:\n")
    assert "line 1: invalid syntax" in fails(capsys, "export", f"{broken}:f")
    broken.write_text("import sys\n\ndef f():\n    sys.exit(3)\n")
    assert "line 4: SystemExit" in fails(capsys, "export", f"{broken}:f")
    broken.write_text("def f():\n    raise ValueError('two\\nlines')\n")
    assert "line 2: ValueError: two lines" in fails(capsys, "export", f"{broken}:f")


def test_mistakes_in_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert "COMMAND" in fails(capsys)
    assert "invalid choice: 'rnu'" in fails(capsys, "rnu")
    assert "STUDY" in fails(capsys, "run")
    assert "--step" in fails(capsys, "check", "x.fmu", "--step", "fast")
    assert "unrecognized arguments" in fails(capsys, "studies", "--verbose")


def test_a_run_that_fails_keeps_its_rows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from railcosim.fmus import build
    from tests import plants

    fmu = build(plants.blow_up())
    text = fails(capsys, "simulate", fmu, "--stop", "2", "--out", tmp_path / "r.csv")
    assert "x is not finite" in text
    assert "the rows up to there are in" in text
    assert len((tmp_path / "r.csv").read_text().splitlines()) == 22  # to t = 1 s


def test_as_a_process(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "railcosim.cli", "info", str(tmp_path / "none.fmu")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    done = subprocess.run(
        [sys.executable, "-m", "railcosim.cli", "--version"], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout[:10]) == (0, "railcosim ")


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_a_console_that_lacks_letters_goes_on(encoding: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "railcosim.cli", "models"],
        env=os.environ | {"PYTHONIOENCODING": encoding},
        capture_output=True,
    )
    assert done.returncode == 0
    assert b"damping_ratio" in done.stdout
    assert done.stderr == b""


def test_a_full_disk_is_named() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "railcosim.cli", "models"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.returncode == 1
    assert done.stderr == "railcosim: No space left on device: standard output\n"


def test_help_is_light() -> None:
    """No timing here: what costs time is what gets imported."""
    code = (
        "import sys\nfrom railcosim.cli import main\n"
        "try: main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'casadi', 'pandas', 'fmpy', 'matplotlib', 'scipy', 'pydantic'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    assert "simulate" in done.stdout


def test_the_whole_way_without_a_system_compiler(tmp_path: Path) -> None:
    """A process that finds no compiler and an empty cache: export, build and run with zig alone."""
    environment = {k: v for k, v in os.environ.items() if k != "CC"}
    environment |= {"PATH": str(tmp_path), "RAILCOSIM_CACHE": str(tmp_path / "cache")}
    code = (
        "from railcosim import Diagram, Fmu; from railcosim.fmus import build\n"
        "from railcosim.models import second_order_train\n"
        "d = Diagram('d', step=0.1); d.add('train', Fmu(build(second_order_train()), u=1.0))\n"
        "print(d.run(10.0)['train.speed'][-1])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == pytest.approx(1.04942, abs=1e-5)  # by its formula
    assert list((tmp_path / "cache" / "zig").iterdir())
