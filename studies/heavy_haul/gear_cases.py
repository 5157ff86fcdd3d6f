"""The force over the stroke of a gear (Fig. 3), and runs that are computed without a diagram."""

import numpy as np

from ...base.railway import JOULES_PER_KWH
from ...controllers import FuzzyPID
from ...cosim import Profile, Run
from ...models.consist import coal_train
from ...models.heavy_haul import Hysteresis
from ..case import Case
from ..computed import Computed, Rows
from ..metrics import Metrics
from .measures import KILONEWTON
from .newmark import simulate
from .train_cases import FORMS, HIGHEST, VIOLENT, open_loop

WATCHED = 20  # the coupler whose loop is drawn: behind a set, so it has slack
NEWMARK_STEP = 0.002  # s
# (s, N): pulled, eased, pulled further, let go, pushed and let go.
CYCLE = (
    (0.0, 0.0), (15.0, 700e3), (25.0, 250e3), (40.0, 1300e3), (55.0, 0.0), (75.0, -500e3),
    (95.0, 0.0), (96.0, 0.0),
)  # fmt: skip


def gear_cases() -> list[Case]:
    """Return the gears' loops, the violent start by Newmark-β, and the tables' errors."""
    return [
        *(_loop(form) for form in FORMS),
        Computed.of("newmark", _newmark),
        Computed.of("inference", _inference),
    ]


def _loop(form: Hysteresis) -> Case:
    values = {"initial_speed": 10.0}
    diagram = open_loop("gear_loop", Profile(CYCLE, unit="N"), values, hysteresis=form)
    ports = (
        f"train.coupler[{WATCHED}].force", f"train.vehicle[{WATCHED}].position",
        f"train.vehicle[{WATCHED + 1}].position", f"train.vehicle[{WATCHED}].speed",
        f"train.vehicle[{WATCHED + 1}].speed",
    )  # fmt: skip
    return Case("gear_loop", form, diagram, 95.0, loop_area, record=ports)


def stretch_and_force(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return the watched joint's stretch (m) and its gears' force (N), damping taken off."""
    consist = coal_train()
    ahead, behind = (f"train.vehicle[{WATCHED + k}]" for k in (0, 1))
    stretch = run[f"{ahead}.position"] - run[f"{behind}.position"]
    stretch = stretch - consist.vehicles[WATCHED - 1].length
    damping = consist.couplers[WATCHED - 1].damping
    relative = run[f"{ahead}.speed"] - run[f"{behind}.speed"]
    return stretch, run[f"train.coupler[{WATCHED}].force"] - damping * relative


def loop_area(run: Run) -> Metrics:
    """Return the work (kWh) that the watched gears took over the whole cycle."""
    stretch, force = stretch_and_force(run)
    return {"energy": float(np.trapezoid(force, stretch)) / JOULES_PER_KWH}


def _newmark() -> Rows:
    """Return the violent start by the paper's method."""

    def force(t: float) -> float:
        return min(VIOLENT * t, HIGHEST)

    made = simulate(coal_train(), stop=25.0, step=NEWMARK_STEP, force=force,
                    gradients=((0.0, 0.0),), record=100)  # fmt: skip
    found: Metrics = {
        "peak_tension": float(made.highest.max()) / KILONEWTON,
        "peak_tension_at": float(made.highest.argmax() + 1),
        "peak_compression": float(-made.lowest.min()) / KILONEWTON,
        "peak_compression_at": float(made.lowest.argmin() + 1),
        "end_speed": float(made.speed[-1, 0]),
        "evaluations_per_step": made.iterations / round(25.0 / NEWMARK_STEP),
    }
    return {"newmark": (found, None)}


def _inference() -> Rows:
    """Return the errors of the 121² table, on the tables' scale ±6."""
    rows = {}
    for extreme in (6.0, 2.0):
        controller = FuzzyPID(extreme=extreme)
        for gain, (rms, largest) in controller.table_error().items():
            name = f"{gain}_{'large' if extreme == 6.0 else 'little'}"
            rows[name] = ({"table_error": rms, "largest_table_error": largest}, None)
    return rows
