"""A whole run between two stations: departure to stop, under ATO, with ATP watching."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import ParameterError
from ...base.railway import JOULES_PER_KWH
from ...controllers import ATO, ATP, LimitCurve
from ...controllers.speed_curve import (
    Course,
    Driving,
    Response,
    SpeedCurve,
    fast_curve,
    minimum_energy_curve,
)
from ...cosim import Constant, Delay, Diagram, Fmu, Run
from ...fmus import build
from ...models import metro_train
from ...models.line import Section, Train
from .loop import PERIOD, STEP
from .truth import V12, Truth

STRETCHES = 12  # of gradient: FMUs have room for so many, or for twice as many, and so on
LEAD = 2.0  # s from the run's start to the curve's departure
AFTER = 8.0  # s that a run goes on behind the curve's stop
OVERSPEED = 4.2  # m/s of the supervised limits above the line's
GUARANTEED = 0.8  # m/s², by the emergency brake
ACCELERATION = 1.2  # m/s², not exceeded under traction
SERVICE_COMMAND = -1.0  # m/s²; full service braking, of the ATO as of the ATP
EMERGENCY_COMMAND = -1.45  # m/s²
OVERLAP = 150.0  # m from the mark to the danger point
BEHIND = 100.0  # m from where a lower limit begins to where it is supervised


@cache
def line_fmu(stretches: int = STRETCHES) -> Path:
    """Return the FMU of the metro train with room for so many gradients, built if need be."""
    return build(metro_train(gradients=stretches))


def room(section: Section) -> int:
    """Return how many gradients the FMU for a section has room for."""
    found = STRETCHES
    while found < len(section.gradients):
        found *= 2
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class LineRun:
    """A run that is ready to go: its section and train, the curve, and the diagram."""

    section: Section
    train: Train
    driving: Driving
    curve: SpeedCurve
    diagram: Diagram

    @property
    def stop(self) -> float:
        """How long (s) to run the diagram."""
        return float(np.ceil(LEAD + self.curve.running_time + AFTER))


def line_run(
    section: Section,
    train: Train,
    plan: SpeedCurve | float | str = "fast",
    *,
    driving: Driving | None = None,
    truth: Truth = V12,
    step: float = STEP,
) -> LineRun:
    """Return a run of the metro train's FMU along a section, from standstill to its stop.

    `plan` is the curve: "fast", the running time (s) of a minimum-energy one, or a curve. The ATO
    drives by `driving`'s curve with the numbers of table 1; what is true of the train is `truth`
    (its place, speed and gradients are not used: they are the section's). Blocks: `ato`, `atp`,
    `release`, `electric_delay`, `air_delay`, `train`; positions are the section's. Raise
    ParameterError for a curve along which the train's brakes cannot hold it.
    """
    driving = driving or Driving()
    course = Course(section, train, driving)
    curve = _curve(section, train, driving, plan)
    _check_brakes(curve, course, response(truth))
    diagram = Diagram("metro_run", step=step)
    diagram.add("ato", ATO.along(curve, course, response=response(truth), lead=LEAD, period=PERIOD))
    diagram.add("atp", protection(course))
    diagram.add("release", Constant(0.0, unit="1"))
    for name, delay in (("electric", truth.electric_delay), ("air", truth.air_delay)):
        diagram.add(f"{name}_delay", Delay(delay, initial=0.0, interpolation="hold"))
    diagram.add("train", Fmu(line_fmu(room(section)), **plant(section, train, truth)))
    for port in ("position", "speed"):
        diagram.connect(f"train.{port}", f"ato.{port}")
        diagram.connect(f"train.{port}", f"atp.{port}")
    diagram.connect("ato.command", "atp.demand")
    diagram.connect("release.y", "atp.release")
    for name in ("electric", "air"):
        diagram.connect("atp.command", f"{name}_delay.u")
        diagram.connect(f"{name}_delay.y", f"train.{name}_command")
    return LineRun(section=section, train=train, driving=driving, curve=curve, diagram=diagram)


def _curve(
    section: Section, train: Train, driving: Driving, plan: SpeedCurve | float | str
) -> SpeedCurve:
    if isinstance(plan, SpeedCurve):
        return plan
    if plan == "fast":
        return fast_curve(section, train, driving)
    if isinstance(plan, str):
        raise ParameterError(f"no plan '{plan}'; it is \"fast\", a running time in s or a curve")
    return minimum_energy_curve(section, train, driving, time=plan)


def _check_brakes(curve: SpeedCurve, course: Course, response: Response) -> None:
    """Refuse a curve that asks more of the motors than they give at full service braking."""
    at = curve.at(np.arange(0.0, curve.running_time, 0.1))
    asked = -(at.acceleration + course.resistance(at.speed, at.position))
    asked = np.where(at.speed > response.changeover_speed, asked, 0.0)
    most = -SERVICE_COMMAND * response.electric_coefficient
    worst = int(np.argmax(asked))
    if asked[worst] > most:
        raise ParameterError(
            f"section '{course.section.name}': at {at.position[worst]:.0f} m the curve asks "
            f"{asked[worst]:.2f} m/s² of the brakes, which give {most:.2f} m/s²; it is too steep "
            f"there for a deceleration of {course.driving.deceleration:g} m/s², take less "
            "(Driving(deceleration=…))"
        )


def response(truth: Truth) -> Response:
    """Return what the ATO takes for granted: the nominal numbers of a truth's brakes."""
    return Response(changeover_speed=truth.changeover_speed, fade_rate=truth.fade_rate)


def protection(course: Course) -> ATP:
    """Return the ATP of a section; the numbers are our choice.

    It takes for granted full traction until the emergency brake acts in full, 2.7 s after it is
    ordered. A train that brakes for a lower limit, or for the stop, must not look like one that
    could pass it: so what is supervised lies above the line's limits, and behind.
    """
    limits = course.limits
    ends = [*(start for start, _ in limits[1:]), course.section.length + OVERLAP]
    top = max(v for _, v in limits)
    restrictions = tuple(
        (start + BEHIND, end, v + OVERSPEED)
        for (start, v), end in zip(limits, ends, strict=True)
        if v < top and start + BEHIND < end
    )
    return ATP(
        curve=LimitCurve(
            maximum=top + OVERSPEED,
            restrictions=restrictions,
            stops=(course.section.length + OVERLAP,),
            braking=GUARANTEED,
        ),
        acceleration=ACCELERATION,
        emergency_time=2.7,
        service_time=3.0,
        warning_time=3.2,
        service_command=SERVICE_COMMAND,
        emergency_command=EMERGENCY_COMMAND,
        period=PERIOD,
    )


def plant(section: Section, train: Train, truth: Truth) -> Mapping[str, Any]:
    """Return the FMU's parameters; the last gradient is repeated.

    The plant knows one mass. Rotating masses are part of it here, and what acts by weight
    (resistance, gradients) is the less for it.
    """
    inertia = train.rotating_mass_factor
    steps = section.gradients
    steps = (*steps, *(steps[-1:] * (room(section) - len(steps))))
    values = truth.values(0.0)
    brakes = {
        name.removeprefix("train."): value
        for name, value in values.items()
        if name.startswith("train.") and "gradient" not in name
    }
    own = {
        "position": 0.0,
        "speed": 0.0,
        "motors": 0.0,
        "mass": train.mass * inertia,
        "length": train.length,
        "davis_a": truth.davis * train.davis.a / inertia,
        "davis_b": truth.davis * train.davis.b / inertia,
        "davis_c": truth.davis * train.davis.c / inertia,
        "traction_force": train.max_traction_force,
        "traction_power": train.max_power,
    }
    places = {f"gradient_position[{k}]": p for k, (p, _) in enumerate(steps, 1)}
    slopes = {f"gradient[{k}]": i / inertia for k, (_, i) in enumerate(steps, 1)}
    return {**brakes, **own, **places, **slopes}


def judged(line_run: LineRun, run: Run) -> dict[str, float]:
    """Return a run's metrics.

    `running_time` (s): from the curve's departure to standstill; `late` (s): over the curve's;
    `stop_error` (cm, positive past the mark); `energy` and `planned_energy` (kWh at the wheel);
    `max_jerk` (m/s³): the largest change of the acceleration over a control period, by the
    period, while moving; `overspeed` (m/s): the largest speed above the line's limits for the
    train's length, 0 if none; `warnings` and `emergency`: whether the ATP came up (0 or 1).
    """
    curve = line_run.curve
    speed, position = run["train.speed"], run["train.position"]
    time = np.asarray(run.frame.index)
    moving = np.flatnonzero(speed > 0.0)
    stop = float(time[moving[-1] + 1]) if moving[-1] + 1 < len(time) else float("nan")
    gap = round(PERIOD / (time[1] - time[0]))
    acceleration = run["train.acceleration"][: moving[-1] + 1]
    limits = Course(line_run.section, line_run.train, line_run.driving).lowest_limits(position)
    return {
        "running_time": stop - LEAD,
        "late": stop - LEAD - curve.running_time,
        "stop_error": 100.0 * float(position[-1] - line_run.section.length),
        "energy": float(run["train.traction_energy"][-1]) / JOULES_PER_KWH,
        "planned_energy": curve.kilowatt_hours,
        "max_jerk": float(np.abs(acceleration[gap:] - acceleration[:-gap]).max()) / PERIOD,
        "overspeed": max(0.0, float((speed - limits).max())),
        "warning": float(run["atp.warning"].max()),
        "emergency": float(run["atp.emergency"].max()),
    }
