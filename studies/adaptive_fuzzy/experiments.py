"""The experiments on the speed loop: from 10 to 7 m/s, and from rest to 10 m/s."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ...cosim import Block, Constant, Diagram, Fmu, Quantiser, Run
from ...fmus import build
from ...models import dc_drive_train, second_order_train_on_line
from ..case import Case
from ..comfort import comfort
from ..metrics import Metrics, step_response
from . import pattern, runaway
from .controllers import LINE_UP, PERIOD, absolute, wide

STOP = 40.0  # s
SWING = 0.2  # notches, 1 % of ±10: a smaller turn of u is no reversal
NOTCH = 1.0  # of a handle with whole notches

# Every experiment is run on the identified plant and, suffix _dc, on the physical one.
PLANTS: Mapping[str, Callable[[], Path]] = {
    "": lambda: build(second_order_train_on_line()),
    "_dc": lambda: build(dc_drive_train()),
}


@dataclass(frozen=True)
class Regulation:
    """A change of speed from `before` to `target` (m/s) under some controllers.

    The train runs at `before`, without acceleration, when the target is set at time 0. With
    `notch` the handle knows only whole multiples of it.
    """

    name: str
    before: float
    target: float
    controllers: Mapping[str, Block]
    notch: float | None = None
    own: tuple[str, ...] = ()

    def diagram(self, controller: Block, fmu: Path) -> Diagram:
        """Return the control loop with this controller."""
        loop = Diagram(self.name, step=PERIOD)
        loop.add("reference", Constant(self.target, unit="m/s"))
        loop.add("controller", controller)
        loop.add("train", Fmu(fmu, speed=self.before, brake=0.0, trip=0.0))
        loop.connect("reference.y", "controller.reference")
        loop.connect("train.speed", "controller.measurement")
        if self.notch is None:
            loop.connect("controller.u", "train.notch")
        else:
            loop.add("handle", Quantiser(self.notch))
            loop.connect("controller.u", "handle.u")
            loop.connect("handle.y", "train.notch")
        return loop

    def measure(self, run: Run) -> Metrics:
        """Return the metrics of the change of speed, and of the ride."""
        response = step_response(
            run.time, run["train.speed"], run["reference.y"], start=float(run["train.speed"][0])
        )
        control = run["controller.u" if self.notch is None else "handle.y"]
        return response | comfort(run.time, run["train.acceleration"], control, swing=SWING)

    def cases(self, suffix: str, fmu: Path) -> list[Case]:
        """Return the runs on one plant."""
        return [
            Case(
                self.name + suffix,
                name,
                self.diagram(controller, fmu),
                STOP,
                self.measure,
                own=("train.speed", "train.brake", "train.trip", *self.own),
            )
            for name, controller in self.controllers.items()
        ]


_ABSOLUTE = ("controller.base_gain", "controller.ku")

REGULATIONS = (
    Regulation("regulation", 10.0, 7.0, LINE_UP),
    Regulation("regulation_absolute_10", 10.0, 7.0, absolute(10.0), own=_ABSOLUTE),
    Regulation("regulation_absolute_30", 10.0, 7.0, absolute(30.0), own=_ABSOLUTE),
    Regulation("regulation_notches", 10.0, 7.0, LINE_UP, notch=NOTCH, own=("handle.interval",)),
    # The FMUs' own bound on the notch is told by `info`, and not enforced by them.
    Regulation("regulation_wide", 10.0, 7.0, wide(30.0), own=("controller.limits",)),
    Regulation("start", 0.0, 10.0, LINE_UP),
)


def cases() -> list[Case]:
    """Return every run of the study; builds the trains' FMUs."""
    found: list[Case] = []
    for suffix, plant in PLANTS.items():
        fmu = plant()
        for regulation in REGULATIONS:
            found += regulation.cases(suffix, fmu)
        found += pattern.cases(suffix, fmu)
    return found + runaway.cases(PLANTS["_dc"]())
