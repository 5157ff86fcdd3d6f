"""Runs without a controller: violent starts, the gears' loop, and the brake wave."""

from ...cosim import Constant, Delay, Diagram, Fmu, Profile
from ...models.consist import Consist, EndOfTrain, coal_train
from ...models.heavy_haul import Hysteresis
from ..case import Case
from .loop import rolling_at_rest, train_fmu
from .measures import whole_train_and_energy
from .recorded import SIZE, whole
from .targets import DOWNHILL_SPEED

FORMS: tuple[Hysteresis, ...] = ("incremental", "dahl", "switching")
INNER_STEPS = (0.005, 0.002, 0.001, 0.0005)  # s
DAMPINGS = (0.0, 2.5e4, 5e4, 1e5)  # N·s/m
STEP = 0.01  # s
VIOLENT, GENTLE = 400e3, 40e3  # N/s
HIGHEST = 1140e3  # N, of both locomotives
SERVICE = 100.0  # kPa


def ramp(rate: float, stop: float) -> Profile:
    """Return the locomotives' force (N): at a rate (N/s) up to 1140 kN, and held."""
    return Profile(((0.0, 0.0), (HIGHEST / rate, HIGHEST), (stop + 1.0, HIGHEST)), unit="N")


def open_loop(
    name: str, force: Profile, values: dict[str, float], *, hysteresis: Hysteresis = "incremental"
) -> Diagram:
    """Return the paper's train under a force that is given."""
    diagram = Diagram(name, step=STEP)
    diagram.add("demand", force)
    diagram.add("release", Constant(0.0, unit="kPa"))
    diagram.add("train", Fmu.with_values(train_fmu(hysteresis=hysteresis), values))
    diagram.connect("demand.y", "train.group[1].force")
    diagram.connect("release.y", "train.group[1].reduction")
    return diagram


def train_cases() -> list[Case]:
    """Return the cases; builds the FMUs of all three hysteresis forms and of three consists."""
    return [*_violent(), _free(), *_damped(), _gentle(), *_waves()]


def _case(experiment: str, name: str, diagram: Diagram, stop: float, size: int = SIZE) -> Case:
    return Case(
        experiment, name, diagram, stop, whole_train_and_energy, record=whole(size), long=True
    )


def _violent() -> list[Case]:
    """Return the violent start with each form of hysteresis and each inner step."""
    found = []
    for form in FORMS:
        for inner in INNER_STEPS:
            values = {"solver.inner_step": inner}
            diagram = open_loop("violent_start", ramp(VIOLENT, 25.0), values, hysteresis=form)
            name = f"{form}_{inner_name(inner)}"
            found.append(_case("violent_start", name, diagram, 25.0))
    return found


def _free() -> Case:
    """Return the violent start of a train without a greater resistance at rest."""
    diagram = open_loop("violent_start", ramp(VIOLENT, 25.0), rolling_at_rest())
    return _case("violent_start", "incremental_rolling", diagram, 25.0)


def inner_name(step: float) -> str:
    """Return an inner step (s) as in a name: "500us"."""
    return f"{round(1e6 * step)}us"


def _damped() -> list[Case]:
    found = []
    for damping in DAMPINGS:
        values = {f"coupler[{i}].damping": damping for i in range(1, SIZE)}
        diagram = open_loop("damping", ramp(VIOLENT, 25.0), values)
        found.append(_case("damping", f"damping_{round(damping / 1e3)}", diagram, 25.0))
    return found


def _gentle() -> Case:
    """Return the open-loop start on +6 ‰ at 40 kN/s."""
    diagram = open_loop("open_loop_start", ramp(GENTLE, 60.0), {"gradient[1]": 6.0})
    return _case("open_loop_start", "open_loop", diagram, 60.0)


def _waves() -> list[Case]:
    """Return a service application on the level, from the front alone and from both ends."""
    device = EndOfTrain()
    trains = {
        "front_only": coal_train(),
        "end_of_train": coal_train(end_of_train=device),
        "distributed": coal_train(distributed=True),
    }
    return [
        _case("brake_wave", name, _braked(consist), 60.0, consist.size)
        for name, consist in trains.items()
    ]


def _braked(consist: Consist) -> Diagram:
    """Return a train that is braked at 1 s: its other sources follow after the radio delay."""
    diagram = Diagram("brake_wave", step=STEP)
    diagram.add("train", Fmu.with_values(train_fmu(consist), {"initial_speed": DOWNHILL_SPEED}))
    diagram.add("coasting", Constant(0.0, unit="N"))
    steps = ((0.0, 0.0), (1.0, 0.0), (1.0, SERVICE), (61.0, SERVICE))
    diagram.add("handle", Profile(steps, unit="kPa"))
    for k in range(1, len(consist.groups) + 1):
        diagram.connect("coasting.y", f"train.group[{k}].force")
    diagram.connect("handle.y", "train.group[1].reduction")
    radio = {f"group[{k}].reduction": consist.radio_delay
             for k in range(2, len(consist.groups) + 1)}  # fmt: skip
    if consist.end_of_train is not None:
        radio["end_of_train.reduction"] = consist.end_of_train.radio_delay
    for number, (port, delay) in enumerate(radio.items()):
        diagram.add(f"radio{number + 1}", Delay(delay, interpolation="hold"))
        diagram.connect("handle.y", f"radio{number + 1}.u")
        diagram.connect(f"radio{number + 1}.y", f"train.{port}")
    return diagram
