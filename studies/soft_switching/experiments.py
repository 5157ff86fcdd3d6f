"""The experiments: step, pulse, perturbed plants, line profile, and a transport delay of ours."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...cosim import Block, Constant, Delay, Diagram, Fmu, Profile, Pulse, Run, Step, Sum
from ...fmus import build
from ...models import second_order_train
from ..case import Case
from ..comfort import comfort
from ..metrics import Metrics, disturbance_response, step_response, tracking
from .controllers import LINE_UP, VARIANT_OWN, VARIANTS

BASE_STEP = 0.01  # s; the controllers sample every 0.05 s

# Line profile (ours: the paper's is lost), (s, m/s): traction, cruise, coasting, braking.
PROFILE = (
    (0.0, 0.0), (10.0, 8.0), (30.0, 16.0), (70.0, 16.0), (100.0, 14.5), (110.0, 14.5),
    (115.0, 16.0), (140.0, 16.0), (148.0, 10.0), (170.0, 10.0), (182.5, 0.0), (195.0, 0.0),
)  # fmt: skip

DELAYS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0)  # s; without delay it is the step experiment
PULSE_WIDTH, PULSE_HEIGHT = 15.0, -0.2  # s and control units, at the plant's input
PULSES = {"pulse": 20.0, "pulse_late": 60.0}  # s; at 60 s the single neuron has settled too

STEP = Step(to=1.0, unit="m/s")
SWING = 0.2  # control units, 1 % of ±10: a smaller turn of u is no reversal
QUIET = Constant(0.0, unit="1")


@dataclass(frozen=True)
class Experiment:
    """Reference, disturbance and delay (s) of an experiment, and its metrics.

    `factors` multiply the train's parameters; `own` are parameters that make the experiment what
    it is, so that an override leaves them.
    """

    name: str
    stop: float
    reference: Block
    measure: Callable[[Run], Metrics]
    disturbance: Block = QUIET
    delay: float = 0.0
    factors: tuple[tuple[str, float], ...] = ()
    own: tuple[str, ...] = ()

    def diagram(self, controller: Block, fmu: Path) -> Diagram:
        """Return the control loop with this controller."""
        loop = Diagram(self.name, step=BASE_STEP)
        loop.add("reference", self.reference)
        loop.add("controller", controller)
        loop.add("link", Delay(self.delay, interpolation="hold"))
        loop.add("disturbance", self.disturbance)
        loop.add("sum", Sum("++"))
        loop.add("train", Fmu(fmu))
        loop.connect("reference.y", "controller.reference")
        loop.connect("train.speed", "controller.measurement")
        loop.connect("controller.u", "link.u")
        loop.connect("link.y", "sum.u1")
        loop.connect("disturbance.y", "sum.u2")
        loop.connect("sum.y", "train.u")
        return loop

    def case(self, name: str, controller: Block, fmu: Path) -> Case:
        """Return the experiment under a controller."""
        return Case(
            self.name,
            name,
            self.diagram(controller, fmu),
            self.stop,
            self.measure,
            own=(*self.own, *VARIANT_OWN.get(name, ())),
            factors={f"train.{parameter}": factor for parameter, factor in self.factors},
        )


def _comfort(run: Run) -> Metrics:
    return comfort(run.time, run["train.acceleration"], run["controller.u"], swing=SWING)


def _step(run: Run) -> Metrics:
    return step_response(run.time, run["train.speed"], run["reference.y"]) | _comfort(run)


def _pulse(run: Run) -> Metrics:
    signals = (run["train.speed"], run["reference.y"], run["disturbance.y"])
    return disturbance_response(run.time, *signals) | _comfort(run)


def _profile(run: Run) -> Metrics:
    return tracking(run.time, run["train.speed"], run["reference.y"]) | _comfort(run)


def delay_name(delay: float) -> str:
    """Return the experiment's name for a delay in s: "delay_100ms"."""
    return f"delay_{round(1000 * delay)}ms"


EXPERIMENTS = (
    Experiment("step", 60.0, STEP, _step),
    # At 20 s, as in the paper, and at 60 s (ours).
    *(
        Experiment(
            name,
            at + 60.0,
            STEP,
            _pulse,
            disturbance=Pulse(at=at, width=PULSE_WIDTH, height=PULSE_HEIGHT, unit="1"),
            own=("disturbance.at",),
        )
        for name, at in PULSES.items()
    ),
    Experiment("gain_plus_20", 60.0, STEP, _step, factors=(("gain", 1.2),)),
    # wn + 20 %, read twice: with the numerator K wn² held, so that the gain falls by 1.2², and
    # with the gain held, so that the numerator grows.
    Experiment(
        "frequency_plus_20_numerator_held",
        60.0,
        STEP,
        _step,
        factors=(("natural_frequency", 1.2), ("gain", 1.0 / (1.2 * 1.2))),
    ),
    Experiment(
        "frequency_plus_20_gain_held", 60.0, STEP, _step, factors=(("natural_frequency", 1.2),)
    ),
    Experiment("profile", 195.0, Profile(PROFILE, unit="m/s"), _profile),
    *(
        Experiment(delay_name(delay), 60.0, STEP, _step, delay=delay, own=("link.time",))
        for delay in DELAYS
    ),
)


def cases() -> list[Case]:
    """Return every run of the study; builds the train's FMU."""
    fmu = build(second_order_train())
    found = []
    for experiment in EXPERIMENTS:
        controllers = LINE_UP | VARIANTS if experiment.name == "step" else LINE_UP
        found += [experiment.case(name, block, fmu) for name, block in controllers.items()]
    return found
