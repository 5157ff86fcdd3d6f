"""Which signals the runs keep."""

from ...models.consist import coal_train
from .loop import COUPLER

SIZE = coal_train().size
ENERGY = tuple(f"train.energy.{name}" for name in ("traction", "kinetic", "potential", "residual"))
EXTREMES = tuple(
    f"train.coupler_{name}" for name in ("maximum", "maximum_at", "minimum", "minimum_at")
)
TRAIN = ("train.speed", "train.position", *EXTREMES, *ENERGY)
LAST = f"train.vehicle[{SIZE}].speed"
SHOWN = (1, 2, 3, 4)  # couplers of the paper's figures 7 and 8
MEASURED = f"coupler[{COUPLER}].force"
FORCES = tuple(f"train.coupler[{i}].force" for i in range(1, SIZE))


def tracked(measured: str, *, gains: bool) -> tuple[str, ...]:
    """Return what a run keeps that tracks a port of the train."""
    forces = [f"coupler[{i}].force" for i in SHOWN]
    ports = dict.fromkeys([measured, *forces])
    ports.pop("speed", None)  # it is in TRAIN
    own = ("force", "kp", "ki", "kd") if gains else ("force",)
    return (
        "target.y", *(f"controller.{name}" for name in own),
        *(f"train.{port}" for port in ports), "train.group[1].applied", LAST, *TRAIN,
    )  # fmt: skip


def whole(size: int) -> tuple[str, ...]:
    """Return what a run keeps of all couplers of a train of so many vehicles."""
    joints = range(1, size)
    return (
        "train.group[1].applied",
        *TRAIN,
        *(f"train.coupler[{i}].{name}" for name in ("force", "highest", "lowest") for i in joints),
    )
