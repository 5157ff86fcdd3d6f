"""Campaigns for the tests: a train held at a speed, drawn anew for each run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railcosim import Delay, Diagram, Fmu, Override, Run, Scenario, Step
from railcosim.controllers import PID
from railcosim.cosim.campaign import Campaign, Simulate

UNITS = {"train.gain": "1", "link.time": "s", "end": "m/s"}


def loop(fmu: Path) -> Diagram:
    made = Diagram("speed_hold", step=0.05)
    made.add("target", Step(at=1.0, to=10.0, unit="m/s"))
    made.add("pid", PID(kp=6.65, ti=2.83, td=0.707, limits=(-10.0, 10.0), period=0.05))
    made.add("link", Delay(0.4))
    made.add("train", Fmu(fmu))
    made.connect("target.y", "pid.reference")
    made.connect("train.speed", "pid.measurement")
    made.connect("pid.u", "link.u")
    made.connect("link.y", "train.u")
    return made


def measure(run: Run) -> list[dict[str, Any]]:
    """Two rows a run; a run whose train is slow by then fails."""
    speed = run["train.speed"]
    if speed[-1] < 3.2:
        raise ValueError(f"only {speed[-1]:.3f} m/s")
    return [
        {"what": "end", "end": speed[-1], "rows": len(speed)},
        {"what": "top", "end": speed.max(), "late": bool(speed.argmax() > 100)},
    ]


def disturbed(drawn: Mapping[str, Any]) -> Scenario:
    return Scenario([Override("link.y", 0.0, at=5.0, until=5.0 + drawn["gap"])])


def train_campaign(fmu: Path, **options: Any) -> Campaign:
    from scipy import stats  # not at the top: workers, which need none of it, import this module

    values: dict[str, Any] = {
        "name": "trains",
        "work": Simulate(diagram=loop(fmu), stop=10.0, measure=measure, scenario=disturbed),
        "draws": {
            "train.gain": stats.uniform(0.9, 0.2),
            "link.time": stats.truncnorm(-2.0, 2.0, 0.4, 0.1),
            "gap": [0.5, 2.0],
        },
        "runs": 60,
        "seed": 7,
        "units": UNITS,
    }
    return Campaign(**(values | options))


def table_bytes(folder: Path) -> bytes:
    return (folder / "table.parquet").read_bytes()
