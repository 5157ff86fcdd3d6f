"""A run broken off and continued, here or in another process, is the run without a break."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railcosim import Constant, Delay, Diagram, Fmu, Ramp, Run
from railcosim.base.errors import CheckpointError, DiagramError, FileError
from railcosim.cosim.algorithms import GaussSeidel, Newton, TwoPhase
from railcosim.cosim.checkpoint import Checkpoint
from railcosim.fmus import build
from tests import plants
from tests.coupled_diagrams import (
    ALGORITHMS,
    array,
    elsewhere,
    everything,
    names,
    oscillator,
    random_walk,
    wired,
)

STOP = 0.4
TICKS = (0, 1, 3, 4, 12, 13, 30, 39)  # jumps in 12 and 30, slow hits at 4, 8, …
HEAVY = "StepDoublingIterated"


def continues(rest: Run, whole: Run, tick: int) -> bool:
    """Return whether `rest` is what the whole run is from a tick on, to the last bit."""
    return (
        list(rest.frame.columns) == list(whole.frame.columns)
        and rest.time.tobytes() == whole.time[tick:].tobytes()
        and array(rest).tobytes() == array(whole)[tick:].tobytes()
    )


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_continued_at_many_ticks(algorithm) -> None:
    diagram = everything()
    ticks = TICKS[1::3] if names(algorithm).startswith(HEAVY) else TICKS
    kept = {}
    with diagram.simulation(algorithm=algorithm) as simulation:
        for tick in ticks:
            kept[tick] = simulation.advance(tick / 100).checkpoint()
        whole = simulation.advance(STOP).result()
    for tick, checkpoint in kept.items():
        assert (checkpoint.tick, checkpoint.time) == (tick, tick / 100)
        rest = diagram.run(STOP, algorithm=algorithm, resume=checkpoint)
        assert continues(rest, whole, tick), tick


def test_continued_in_another_process(tmp_path: Path) -> None:
    """With every algorithm, from a file, in the midst of a jump's surroundings."""
    wholes, jobs = [], []
    for n, algorithm in enumerate(ALGORITHMS):
        with everything().simulation(algorithm=algorithm) as simulation:
            saved = simulation.advance(0.13).checkpoint().save(tmp_path / f"{n}.checkpoint")
            wholes.append(simulation.advance(STOP).result())
        jobs.append(
            {"diagram": "everything", "stop": STOP, "algorithm": repr(algorithm),
             "resume": str(saved)}
        )  # fmt: skip
    for algorithm, rest, whole in zip(ALGORITHMS, elsewhere(tmp_path, jobs), wholes, strict=True):
        assert continues(rest, whole, 13), names(algorithm)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=names)
def test_continued_at_every_tick(algorithm, tmp_path: Path) -> None:
    diagram = everything()
    with diagram.simulation(algorithm=algorithm) as simulation:
        files = []
        for tick in range(41):
            checkpoint = simulation.advance(tick / 100).checkpoint()
            files.append(checkpoint.save(tmp_path / f"{tick}.checkpoint"))
        whole = simulation.result()
    for tick, file in enumerate(files[:-1]):
        rest = diagram.run(STOP, algorithm=algorithm, resume=Checkpoint.load(file))
        assert continues(rest, whole, tick), tick


@pytest.mark.parametrize("engines", [("python", "compiled"), ("compiled", "python")])
def test_engines_take_each_others_checkpoints(engines) -> None:
    for algorithm in (TwoPhase(), GaussSeidel(extrapolation=1)):
        diagram = everything()
        whole = diagram.run(STOP, algorithm=algorithm, engine="python")
        with diagram.simulation(algorithm=algorithm, engine=engines[0]) as simulation:
            checkpoint = simulation.advance(0.21).checkpoint()
        rest = diagram.run(STOP, algorithm=algorithm, engine=engines[1], resume=checkpoint)
        assert continues(rest, whole, 21)


def test_isolated_fmus_and_those_that_are_not_take_each_others(tmp_path: Path) -> None:
    algorithm = GaussSeidel(extrapolation=1)
    whole = everything().run(STOP, algorithm=algorithm)
    for isolated in (True, False):
        with everything(isolated=isolated).simulation(algorithm=algorithm) as simulation:
            saved = simulation.advance(0.2).checkpoint().save(tmp_path / f"{isolated}.checkpoint")
        rest = everything(isolated=not isolated).run(
            STOP, algorithm=algorithm, resume=Checkpoint.load(saved)
        )
        assert continues(rest, whole, 20)


def test_python_blocks_alone() -> None:
    algorithm = TwoPhase(loops=Newton())
    diagram = random_walk()
    whole = diagram.run(20.0, algorithm=algorithm)
    with diagram.simulation(algorithm=algorithm) as simulation:
        checkpoint = simulation.advance(10.3).checkpoint()  # noise comes in parcels of 1024
    rest = diagram.run(20.0, algorithm=algorithm, resume=checkpoint)
    assert continues(rest, whole, 1030)


def test_twice_from_one_checkpoint_and_again_from_what_follows() -> None:
    diagram = everything()
    whole = diagram.run(STOP)
    with diagram.simulation() as simulation:
        first = simulation.advance(0.1).checkpoint()
    with diagram.simulation(resume=first) as simulation:
        assert simulation.time == 0.1
        second = simulation.advance(0.25).checkpoint()
        assert continues(simulation.advance(STOP).result(), whole, 10)
    assert continues(diagram.run(STOP, resume=second), whole, 25)
    assert continues(diagram.run(STOP, resume=first), whole, 10)


def test_a_later_start_is_kept() -> None:
    blocks = {
        "ramp": Ramp(slope=1.0, at=1.5, unit="1/s"),
        "link": Delay(0.25, initial=3.0),
        "plant": Fmu(build(plants.integrator(start=1.0))),
    }
    diagram = wired(Diagram("late", step=0.1), blocks, "ramp.y link.u", "link.y plant.u")
    whole = diagram.run(2.5, start=1.2)
    with diagram.simulation(start=1.2) as simulation:
        checkpoint = simulation.advance(1.4).checkpoint()
    assert continues(diagram.run(2.5, start=1.2, resume=checkpoint), whole, 2)


def test_parameters_of_fmus_come_with_the_checkpoint_others_may_change() -> None:
    blocks = {"rate": Constant(1.0, unit="1/s"), "plant": Fmu(build(plants.integrator(start=1.0)))}
    diagram = wired(Diagram("rates", step=0.1), blocks, "rate.y plant.u")
    with diagram.simulation() as simulation:
        checkpoint = simulation.advance(0.5).checkpoint()
    faster = diagram.with_values({"rate.value": 3.0})
    run = faster.run(1.0, resume=checkpoint)
    assert run["plant.x"] == pytest.approx(3.0 * run.time, abs=1e-13)

    decay = wired(Diagram("decay", step=0.1), {"plant": Fmu(build(plants.tunable()), k=2.0)})
    with decay.simulation() as simulation:
        checkpoint = simulation.advance(0.5).checkpoint()
    rest = decay.run(1.0, resume=checkpoint)
    assert rest["plant.x"] == pytest.approx(np.exp(-2.0 * rest.time), abs=1e-9)


# What does not fit is refused


def halfway(diagram: Diagram, algorithm=None) -> Checkpoint:
    with diagram.simulation(algorithm=algorithm) as simulation:
        return simulation.advance(0.2).checkpoint()


def test_a_checkpoint_of_another_diagram_is_refused() -> None:
    taken = halfway(oscillator(0.01))
    with pytest.raises(CheckpointError, match="step"):
        oscillator(0.02).run(1.0, resume=taken)
    with pytest.raises(CheckpointError, match="algorithm"):
        oscillator(0.01).run(1.0, resume=taken, algorithm=GaussSeidel())
    with pytest.raises(CheckpointError, match="start"):
        oscillator(0.01).run(1.0, resume=taken, start=0.1)
    more = wired(oscillator(0.01), {"c": Constant(1.0)})
    with pytest.raises(CheckpointError, match="blocks"):
        more.run(1.0, resume=taken)
    with pytest.raises(DiagramError, match=r"0\.2"):
        oscillator(0.01).run(0.2, resume=taken)


def test_a_delay_of_another_length_is_refused() -> None:
    def link(time: float) -> Diagram:
        blocks = {"ramp": Ramp(), "link": Delay(time)}
        return wired(Diagram("link", step=0.1), blocks, "ramp.y link.u")

    with pytest.raises(CheckpointError, match="link"):
        link(0.5).run(1.0, resume=halfway(link(0.3)))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no archive", b"\x80\x04K\x01."])
def test_a_file_that_is_none_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.checkpoint"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"other\.checkpoint"):
        Checkpoint.load(path)
    with pytest.raises(FileError, match="missing"):
        Checkpoint.load(tmp_path / "missing.checkpoint")


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = halfway(everything()).save(tmp_path / "whole.checkpoint")
    whole = path.read_bytes()
    for n, part in enumerate((whole[: len(whole) // 2], whole[:-40], whole[:100] + whole[140:])):
        broken = tmp_path / f"broken{n}.checkpoint"
        broken.write_bytes(part)
        with pytest.raises(FileError, match="broken"):
            Checkpoint.load(broken)


def test_the_file_holds_numbers_and_nothing_to_execute(tmp_path: Path) -> None:
    path = halfway(everything()).save(tmp_path / "safe.checkpoint")
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            content = archive.read(name)
            assert not name.startswith(("/", "..")) and not name.endswith((".pkl", ".py"))
            assert not content.startswith(b"\x80")  # as pickles do
    again = Checkpoint.load(path)
    assert replace(again) == replace(halfway(everything()))
