"""The handlings on the rolling line, on the whole train: speed held by PID, and ours by plan."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...base.errors import ParameterError
from ...base.railway import JOULES_PER_KWH
from ...controllers import FuzzyPID, SamplePID
from ...controllers.train_handling import (
    Aims,
    Handling,
    HandlingDriver,
    Journey,
    RigidTrain,
    notched,
    optimal_handling,
)
from ...cosim import Constant, Diagram, Fmu, Profile, Run
from ...models.consist import Consist, coal_train
from ...models.line import Section
from ..case import Case
from ..metrics import Metrics
from .loop import train_fmu
from .measures import KILONEWTON
from .reduced_train import reduced_train
from .rolling import rolling_section

START, CRUISE = 40.0 / 3.6, 60.0 / 3.6  # m/s
RAMP = 200.0  # s, from the one to the other
STEP = 0.1  # s
LATE = 1.02  # share of the time after which a run ends at the latest
# The paper's gains are per sample. At 0.1 s its ki is 0.03 1/s, which suits a train's speed, and
# N per m/s: 2.6 MN, of which kp takes 0.8; ours. Universes in m/s; ours.
PER_SPEED, UNIVERSE, UNIVERSE_OF_CHANGE = 2.6e6, 1.0, 0.02
RATE = 60e3  # N/s, for all controllers
NOTCH = 95e3  # N, a sixteenth of what both locomotives pull at the start


@dataclass(frozen=True, kw_only=True)
class Ride:
    """The train, the line and the journey that all handlings have to do.

    Raise ParameterError for a train with more than one group of locomotives, or an end-of-train
    device: the diagrams do not command them.
    """

    consist: Consist
    section: Section
    start_speed: float = START
    cruise: float = CRUISE
    ramp: float = RAMP

    def __post_init__(self) -> None:
        if len(self.consist.groups) > 1 or self.consist.end_of_train is not None:
            raise ParameterError(
                f"ride of '{self.consist.name}': needs a train with one group of locomotives and "
                "no end-of-train device"
            )

    @property
    def time(self) -> float:
        """The time in s: up to cruising speed along S(t/ramp), then on with it."""
        ramp = self.ramp * (self.start_speed + self.cruise) / 2.0
        return self.ramp + (self.section.length - ramp) / self.cruise

    @property
    def journey(self) -> Journey:
        """The journey of the same time and the same speeds at its ends."""
        return Journey(
            section=self.section, start_speed=self.start_speed, end_speed=self.cruise,
            time=self.time,
        )  # fmt: skip

    def target(self, time: Any) -> Any:
        """Return the speed (m/s) to be tracked; S = 10 x³ − 15 x⁴ + 6 x⁵."""
        x = np.clip(np.asarray(time, dtype=float) / self.ramp, 0.0, 1.0)
        share = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
        return self.start_speed + (self.cruise - self.start_speed) * share


def rolling_ride() -> Ride:
    """Return the paper's train on the rolling line."""
    return Ride(consist=coal_train(), section=rolling_section())


def _diagram(name: str, ride: Ride) -> Diagram:
    section = ride.section
    places, slopes = zip(*section.gradients, strict=True)
    diagram = Diagram(name, step=STEP)
    fmu = Fmu(
        train_fmu(ride.consist, gradients=len(places)), initial_speed=ride.start_speed,
        gradient_position=list(places), gradient=list(slopes),
    )  # fmt: skip
    diagram.add("train", fmu)
    return diagram


def speed_tracking(ride: Ride, controller: SamplePID, target: Any = None) -> Diagram:
    """Return a diagram in which a controller tracks a speed over time, `target` (s) -> m/s."""
    diagram = _diagram("speed_tracking", ride)
    times = np.arange(0.0, math.ceil(LATE * ride.time) + 1.0)
    speeds = (target or ride.target)(times)
    points = tuple(zip(times.tolist(), np.asarray(speeds).tolist(), strict=True))
    diagram.add("target", Profile(points, unit="m/s"))
    diagram.add("driver", controller)
    diagram.add("release", Constant(0.0, unit="kPa"))
    diagram.connect("target.y", "driver.reference")
    diagram.connect("train.speed", "driver.measurement")
    diagram.connect("release.y", "train.group[1].reduction")
    _connect_force(diagram)
    return diagram


def by_plan(ride: Ride, driver: HandlingDriver) -> Diagram:
    """Return a diagram in which a driver follows a plan."""
    diagram = _diagram("by_plan", ride)
    diagram.add("driver", driver)
    for port in ("position", "speed"):
        diagram.connect(f"train.{port}", f"driver.{port}")
    diagram.connect("driver.reduction", "train.group[1].reduction")
    _connect_force(diagram)
    return diagram


def _connect_force(diagram: Diagram) -> None:
    for port in ("upper", "lower"):
        diagram.connect(f"train.group[1].{port}", f"driver.{port}")
    diagram.connect("driver.force", "train.group[1].force")


def paper_pid() -> SamplePID:
    """Return the paper's PID for a speed."""
    return SamplePID(unit="m/s", scale=PER_SPEED, period=STEP, rate=RATE)


def paper_fuzzy_pid() -> FuzzyPID:
    """Return the paper's fuzzy adaptive PID for a speed, folded."""
    return FuzzyPID(
        unit="m/s", scale=PER_SPEED, period=STEP, rate=RATE, universe=UNIVERSE,
        change_universe=UNIVERSE_OF_CHANGE,
    )  # fmt: skip


def ride_handling(ride: Ride, aims: Aims | None = None) -> Handling:
    """Return our plan for a ride."""
    return optimal_handling(reduced_train(ride.consist), ride.journey, aims=aims)


def record(ride: Ride) -> tuple[str, ...]:
    """Return what `judged` needs of a run."""
    names = ("position", "speed", "group[1].applied", "energy.traction", "energy.electric_brake")
    return (
        *(f"train.{name}" for name in names),
        *(
            f"train.coupler[{i}].{name}"
            for name in ("force", "highest", "lowest")
            for i in _joints(ride)
        ),
    )


def run_ride(ride: Ride, diagram: Diagram) -> Run:
    """Run a diagram until the train must have arrived."""
    return diagram.run(math.ceil(LATE * ride.time), record=record(ride), progress=False)


class Judged(NamedTuple):
    """What came of a run up to the end of its way; forces in kN, energies in kWh at the wheel.

    The peaks are those of all inner steps, `rms_coupler_force` is over time and couplers,
    `max_force_rate` (kN/s) the largest change of a coupler's force over 0.1 s, `net_energy` the
    traction's work less what the electric brake takes. `running_time` (s) and `end_speed` (m/s)
    are NaN for a train that did not arrive.
    """

    running_time: float
    end_speed: float
    peak_tension: float
    peak_compression: float
    rms_coupler_force: float
    max_force_rate: float
    traction_energy: float
    net_energy: float


UNITS = dict(zip(Judged._fields, ("s", "m/s", "kN", "kN", "kN", "kN/s", "kWh", "kWh"), strict=True))


def coupler_forces(ride: Ride, run: Run) -> Any:
    """Return the forces (N) of a run, rows × couplers."""
    return np.stack([run[f"train.coupler[{i}].force"] for i in _joints(ride)], axis=1)


def judged(ride: Ride, run: Run) -> Judged:
    """Return what came of a run."""
    position, times = run["train.position"], np.asarray(run.frame.index)
    arrived = int(np.searchsorted(position, ride.section.length))
    late = arrived >= len(position)
    last = len(position) - 1 if late else arrived
    force = coupler_forces(ride, run)[: last + 1]
    highest = max(run[f"train.coupler[{i}].highest"][last] for i in _joints(ride))
    lowest = min(run[f"train.coupler[{i}].lowest"][last] for i in _joints(ride))
    traction, braked = (
        float(run[f"train.energy.{name}"][last]) / JOULES_PER_KWH
        for name in ("traction", "electric_brake")
    )
    return Judged(
        running_time=math.nan if late else float(np.interp(ride.section.length, position, times)),
        end_speed=math.nan if late else float(run["train.speed"][last]),
        peak_tension=float(highest) / KILONEWTON,
        peak_compression=-float(lowest) / KILONEWTON,
        rms_coupler_force=float(np.sqrt(np.mean(force**2))) / KILONEWTON,
        max_force_rate=float(np.abs(np.diff(force, axis=0)).max()) / STEP / KILONEWTON,
        traction_energy=traction,
        net_energy=traction - braked,
    )


def _joints(ride: Ride) -> range:
    return range(1, ride.consist.size)


def diagrams(ride: Ride, handling: Handling, *, notch: float = NOTCH) -> dict[str, Diagram]:
    """Return the handlings that are compared, by name.

    `pid` and `fuzzy_pid` track the speed as the paper does; `plan` is ours, `plan_notched` the
    same by notches. To tell plan and controller apart: `pid_on_plan` tracks our plan's speed
    over time, `plan_alone` has no feedback at all.
    """
    rigid = RigidTrain(train=reduced_train(ride.consist), section=ride.section)
    by_notches = notched(handling, rigid, notch=notch)

    def planned(time: Any) -> Any:
        return np.interp(time, handling.time, handling.speed)

    return {
        "pid": speed_tracking(ride, paper_pid()),
        "fuzzy_pid": speed_tracking(ride, paper_fuzzy_pid()),
        "plan": by_plan(ride, HandlingDriver.along(handling)),
        "plan_notched": by_plan(ride, HandlingDriver.along(by_notches)),
        "pid_on_plan": speed_tracking(ride, paper_pid(), planned),
        "plan_alone": by_plan(ride, HandlingDriver.along(handling, gain=0.0)),
    }


def handling_cases() -> list[Case]:
    """Return the runs on the rolling line; our plan is found first, which takes some seconds."""
    ride = rolling_ride()
    stop = math.ceil(LATE * ride.time)
    return [
        Case(
            "handling", name, diagram, stop, partial(measured, ride), record=record(ride), long=True
        )
        for name, diagram in diagrams(ride, ride_handling(ride)).items()
    ]


def measured(ride: Ride, run: Run) -> Metrics:
    """Return what came of a run, as a study's metrics."""
    found = judged(ride, run)._asdict()
    return {name: None if math.isnan(value) else value for name, value in found.items()}
