"""One stop of a train at a station, and chains of stops with a controller that learns."""

import math
import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...base.railway import GRAVITY_PER_MILLE
from ...controllers.odometry import Odometry
from ...controllers.predictive_stop import (
    PARAMETERS,
    BrakingModel,
    Learning,
    Plan,
    PredictiveStop,
    Prior,
    Probe,
    ProbingStop,
    Samples,
    trimmed,
)
from ...controllers.predictive_stop.cheap_stop import cheap_stop
from ...controllers.predictive_stop.controller import BRAKING, SETTLING, STANDING
from ...cosim.block import Block
from ...cosim.run import Run
from ...cosim.runner import Runner
from ...cosim.scenario import Scenario, SetParameter
from .drift import DRIFTS
from .loop import PERIOD, START, braking_loop
from .stations import nominal
from .truth import Truth

AIR = ("air_delay", "air_lag", "air_gain", "changeover_speed", "fade_rate")
ELECTRIC = ("electric_delay", "electric_lag", "electric_gain", "approach", "platform", "davis")
ENDING = 0.4  # share of the level that is left of it in a soft ending, our choice
DAMPING = (0.1, 0.15)  # m per m/s², without and with a soft ending
SOFTENING = (1.3, 1.9)  # it comes down to that between these speeds over V_sw
LONGEST = 40.0  # s
MOST_KEPT = 16  # loops
_KEPT = threading.local()
PROBE = Probe()
Make = Callable[[Truth], Block]  # a controller, from what it may know: the nominal numbers


def predictive(
    known: Truth,
    *,
    scale: float = 0.0,
    balises: tuple[float, ...] = (),
    soft: bool = False,
    damping: float | None = None,
) -> PredictiveStop:
    """Return a predictive stop with the nominal prior.

    With a `soft` ending the brake is at ENDING of its level when the air brake comes on: the train
    takes longer to stop, and the control has time to see what the air brake does. `scale` is the
    sd of the wheel's scale, `balises` where the odometry has them.
    """
    prior = Prior.nominal(
        changeover_speed=known.changeover_speed,
        fade_rate=known.fade_rate,
        approach=known.approach,
        platform=known.platform,
        scale=scale,
    )
    slow, fast = (k * known.changeover_speed for k in SOFTENING)
    damping = DAMPING[soft] if damping is None else damping
    plan = Plan(damping=damping, ending=ENDING if soft else 1.0, slow=slow, fast=fast)
    return PredictiveStop(prior=prior, model=BrakingModel(balises=balises), plan=plan)


def cheap(known: Truth, **options: Any) -> PredictiveStop:
    """Return the cheap variant, with the options of `predictive`."""
    whole = predictive(known, **options)
    return cheap_stop(whole.prior, model=whole.model, plan=whole.plan)


def probing(known: Truth, *, probe: Probe = PROBE, **options: Any) -> ProbingStop:
    """Return the variant that tries the air brake out, with the options of `predictive`."""
    whole = predictive(known, **options)
    model = replace(whole.model, probe=probe)
    return ProbingStop(prior=whole.prior, model=model, plan=whole.plan)


def parameters(truth: Truth) -> dict[str, float]:
    """Return the truth as parameters of a predictive stop: all that a stop does not begin anew."""
    return {
        "electric_delay": truth.electric_delay,
        "electric_lag": truth.electric_lag,
        "electric_gain": truth.electric_coefficient / truth.mass_ratio,
        "air_delay": truth.air_delay,
        "air_lag": truth.air_lag,
        "air_gain": truth.air_gain / truth.mass_ratio,
        "changeover_speed": truth.changeover_speed,
        "fade_rate": truth.fade_rate,
        "approach": truth.approach * GRAVITY_PER_MILLE,
        "platform": truth.platform * GRAVITY_PER_MILLE,
        "davis": truth.davis,
    }


def told(controller: PredictiveStop, truth: Truth, names: Collection[str]) -> PredictiveStop:
    """Return an oracle: the controller when it knows the true values of some parameters."""
    values = {name: v for name, v in parameters(truth).items() if name in names}
    return replace(controller, prior=controller.prior.known(values))


def odometry(
    generator: np.random.Generator, scale: float = 0.0, balises: tuple[float, ...] = ()
) -> Odometry:
    """Return odometry with a seed, and a wheel scale of sd `scale`, from the generator."""
    seed, draw = int(generator.integers(2**31)), float(generator.standard_normal())
    return Odometry(scale=scale * draw, balises=balises, seed=seed)


def run_stop(
    truth: Truth,
    controller: Block,
    sensors: Block,
    *record: str,
    scenario: Scenario | None = None,
) -> Run:
    """Return the run of a stop, with what `metrics` needs.

    Stops that differ in the truth, the sensors' numbers and a predictive stop's options share
    program and FMU, kept from stop to stop in each thread.
    """
    names = ("train.position", "train.standstill", "train.acceleration", "controller.command")
    free = isinstance(controller, PredictiveStop)
    key = (type(controller) if free else controller, type(sensors), record)
    kept: dict[Any, Runner] = _KEPT.__dict__.setdefault("runners", {})
    if key not in kept:
        if len(kept) >= MOST_KEPT:
            kept.pop(next(iter(kept))).close()
        loop = braking_loop(truth, controller, sensors, start=START)
        kept[key] = loop.runner(LONGEST, record=[*names, *record])
    values = dict(truth.values(START, probes="probe" in controller.outputs))
    for block, of in {"odometry": sensors, **({"controller": controller} if free else {})}.items():
        values |= {f"{block}.{name}": value for name, value in of.parameters().items()}
    return kept[key].run(values, scenario)


def metrics(run: Run) -> dict[str, float]:
    """Return what a stop is judged by.

    stop_error (cm, positive: past the mark); command_travel (m/s²): Σ |Δ command| until
    standstill; max_jerk (m/s³): the largest |a(t + 0.2 s) − a(t)|/0.2 s before standstill;
    stop_time (s) from the run's start.
    """
    standing = np.flatnonzero(run["train.standstill"] == 1)
    last = int(standing[0]) if standing.size else len(run.time) - 1
    every = round(PERIOD / (run.time[1] - run.time[0]))
    command = run["controller.command"][: last + 1]
    a = run["train.acceleration"][:last]
    jerk = np.abs(a[every:] - a[:-every]) / PERIOD
    return {
        "stop_error": 100.0 * float(run["train.position"][-1]),
        "command_travel": float(np.abs(np.diff(command)).sum()),
        "max_jerk": float(jerk.max()),
        "stop_time": float(run.time[last]),
        "stopped": float(standing.size > 0),
    }


def _station(
    drawn: Mapping[str, Any], generator: np.random.Generator
) -> tuple[int, dict[str, float]]:
    """Return the station's number, and what a row is to show of it: nothing if it was given."""
    if "station" in drawn:
        return int(drawn["station"]), {}
    station = int(generator.integers(7))
    return station, {"station": station}


def one_stop(
    drawn: Mapping[str, Any],
    generator: np.random.Generator,
    *,
    make: Make = predictive,
    train: str = "v6",
    spread: float = 1.0,
    scale: float = 0.0,
    balises: tuple[float, ...] = (),
    known: Collection[str] = (),
) -> dict[str, float]:
    """Return metrics and draws of one stop: the truth is drawn around the nominal numbers.

    `drawn` may give the "station" (0 to 6), else it is drawn too. `known` are parameters that the
    predictive stop is told, for limits of what is possible.
    """
    station, shown = _station(drawn, generator)
    about = nominal(train, station)
    truth = about.drawn(generator, spread)
    sensors = odometry(generator, scale, balises)
    controller = make(about)
    if known:
        assert isinstance(controller, PredictiveStop)
        controller = told(controller, truth, known)
    run = run_stop(truth, controller, sensors)
    draws = {f"true_{name}": value for name, value in asdict(truth).items()}
    return {**shown, **metrics(run), **draws}


def samples_of(run: Run, probe: Probe | None = None) -> tuple[tuple[float, ...], Samples]:
    """Return the last estimate of a predictive stop's run, and what it has seen.

    `probe` is that of a run in which the air brake was tried out.
    """
    every = round(PERIOD / (run.time[1] - run.time[0]))
    seen = {
        name: run[name][::every]
        for name in ("odometry.position", "odometry.speed", "controller.command")
    }
    phase = run["controller.phase"][::every]
    awake = np.flatnonzero(phase >= 1)
    standing = np.flatnonzero(phase == STANDING)
    first = int(awake[0])
    end = min(int(standing[0]) + SETTLING, len(phase)) if standing.size else len(phase)
    positions, speeds, commands = (tuple(column[first:end].tolist()) for column in seen.values())
    theta = tuple(float(run[f"controller.{name}"][-1]) for name in PARAMETERS)
    probed = math.inf
    if probe is not None:
        braking = int(np.flatnonzero(phase >= BRAKING)[0])
        probed = (braking - first + round(probe.after / PERIOD)) * PERIOD
    return theta, Samples(positions, speeds, commands[:-1], probed)


def revealed_stop(
    drawn: Mapping[str, Any],
    generator: np.random.Generator,
    *,
    train: str = "v6",
    spread: float = 1.0,
    soft: bool = False,
) -> dict[str, float]:
    """Return metrics of a stop of an oracle that is told all of the air brake as it comes on."""
    station, shown = _station(drawn, generator)
    about = nominal(train, station)
    truth = about.drawn(generator, spread)
    sensors = odometry(generator)
    controller = told(predictive(about, soft=soft), truth, ELECTRIC)
    first = run_stop(truth, controller, sensors, "train.changeover_time")
    onset = round(float(first["train.changeover_time"][-1]) + truth.air_delay, 2)
    prior = told(controller, truth, AIR).prior
    reveal = Scenario([SetParameter("controller.prior", prior, at=onset)])
    return {**shown, **metrics(run_stop(truth, controller, sensors, scenario=reveal))}


def learning_chain(
    drawn: Mapping[str, Any],
    generator: np.random.Generator,
    *,
    train: str = "v6",
    drift: str = "benign",
    stops: int = 60,
    way: str = "learning",
    scale: float = 0.0,
    balises: tuple[float, ...] = (),
    soft: bool = False,
) -> list[dict[str, float]]:
    """Return metrics of stops of one train at one station, one after the other.

    The truth drifts as `drift` ("benign" or "harsh") has it. By `way` a predictive stop learns its
    prior from stop to stop ("learning", or "probing" where it tries the air brake out each time),
    or the cheap variant trims its aim ("trim"). `drawn` may give the "station" (0 to 6), else it is
    drawn too.
    """
    station, shown = _station(drawn, generator)
    about = nominal(train, station)
    make = {"learning": predictive, "probing": probing, "trim": cheap}[way]
    controller = make(about, scale=scale, balises=balises, soft=soft)
    learning = Learning.begin(controller.prior)
    record = [f"controller.{name}" for name in ("phase", *PARAMETERS)]
    wheel = scale * float(generator.standard_normal())
    rows: list[dict[str, float]] = []
    for k, truth in enumerate(DRIFTS[drift].chain(about, generator, stops)):
        sensors = Odometry(scale=wheel, balises=balises, seed=int(generator.integers(2**31)))
        run = run_stop(truth, controller, sensors, "odometry.position", "odometry.speed", *record)
        rows.append({"stop": k, **shown, **metrics(run)})
        if way == "trim":
            controller = trimmed(controller, float(run["odometry.position"][-1]))
        else:
            learning = learning.after(controller.model, *samples_of(run, controller.model.probe))
            controller = replace(controller, prior=learning.prior)
    return rows
