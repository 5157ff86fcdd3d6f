"""Experiment 3: nominal stops at the seven stations, and the base step's influence."""

from ...controllers.odometry import Odometry
from ...cosim import Block, Run
from ..case import Case
from ..metrics import Metrics
from .controllers import LAWS, maker
from .loop import START, STEP, braking_loop
from .stations import STATIONS, nominal
from .stops import LONGEST, metrics, predictive
from .truth import Truth

RECORD = (
    "train.position", "train.speed", "train.acceleration", "train.standstill", "train.phase",
    "train.electric", "train.air", "controller.command",
)  # fmt: skip
STEPS = {"step_0_2": 0.2, "step_0_1": 0.1, "step_0_02": 0.02, "step_0_01": STEP}  # s
OFF_GRID = {"electric_delay": 0.8737, "air_delay": 0.7919}  # s, on none of these grids
EXACT = Odometry(position_noise=0.0, speed_noise=0.0)


def cases() -> list[Case]:
    """Return the noise-free stops of the nominal train under every controller; base steps."""
    found: list[Case] = []
    for number, station in enumerate(STATIONS):
        known, late = nominal("v6", number), nominal("v3", number)
        found += [stop_case(station.key, name, maker(name)(known), known) for name in LAWS]
        found.append(stop_case(station.key, "predictive_v6", predictive(known), known))
        found.append(stop_case(station.key, "predictive_v3", predictive(late), late))
    return [*found, *base_steps()]


def base_steps() -> list[Case]:
    """Return one stop with delays off all grids at several base steps of the master."""
    known = nominal("v6", 0)
    values = {f"{name}.time": time for name, time in OFF_GRID.items()}
    values["train.air_delay"] = OFF_GRID["air_delay"]
    loop = maker("smarc_dob_m2")(known)
    return [
        stop_case("base_step", name, loop, known, step=step, values=values)
        for name, step in STEPS.items()
    ]


def stop_case(
    experiment: str,
    name: str,
    controller: Block,
    known: Truth,
    *,
    step: float = STEP,
    values: dict[str, float] | None = None,
) -> Case:
    """Return the noise-free stop of a train; `values` by "block.parameter" are the experiment's."""
    loop = braking_loop(known, controller, EXACT, start=START, step=step)
    return Case(
        experiment, name, loop.with_values(values or {}), LONGEST, _measure, record=RECORD,
        own=tuple(values or ()),
    )  # fmt: skip


def _measure(run: Run) -> Metrics:
    return {name: value for name, value in metrics(run).items() if name != "stopped"}
