"""The heavy-haul train as a plant."""

from typing import Any

import casadi as ca

from ...base.errors import ParameterError
from ...base.railway import GRAVITY_PER_MILLE
from ..consist import Consist, coal_train
from ..consist.consist import STEP
from ..plant import Plant
from ..solver import SemiImplicitEuler
from .air_brake import declare_air_brake
from .couplers import (
    Couplers,
    Hysteresis,
    check_hysteresis,
    declare_couplers,
    declare_outputs,
    gear_forces,
    update_couplers,
)
from .energy import declare_energy, mechanical_energy
from .locomotives import declare_locomotives
from .mapping import mapped, total
from .running import Running, declare_running

BEFORE_ALL = -1e300  # s


def heavy_haul_train(
    consist: Consist | None = None, *, gradients: int = 1, hysteresis: Hysteresis = "incremental"
) -> Plant:
    """Return a train of 2 to 1000 vehicles (heavy-haul paper, eqs. 1 to 10).

    m_i a_i = F_{i−1} − F_i − W_i + FL_i − FB_i, with tension positive and coupler i behind vehicle
    i. Without a consist it is the paper's: 2 HXD1 and 100 C80. `gradients` is how many stretches
    the line may have. `hysteresis` is the form of the hysteresis: "incremental" is the reference,
    "dahl" an alternative, "switching" the naive one, which does not converge with the inner step.

    Running resistance and brake shoes are dry friction: each vehicle stands at exactly 0 m/s until
    what drives it exceeds them. `initial_speed` sets the whole train in motion at the start. The
    paper's equations 3, 4 and 7 to 10 are lost; what stands for them, and all numbers, are told
    with the parameters and in the consist.
    """
    consist = coal_train() if consist is None else consist
    if not isinstance(consist, Consist):
        raise ParameterError(f"heavy_haul_train: {consist!r} is no Consist; see read_consist")
    if type(gradients) is not int or not 1 <= gradients <= 1000:
        raise ParameterError(f"heavy_haul_train: gradients is 1 to 1000, not {gradients!r}")
    check_hysteresis(hysteresis)
    size = consist.size
    with Plant(
        "heavy_haul_train",
        description=f"Train of {size} vehicles with draft gears and air brake: {consist.name}",
        stop=90.0,
        step=0.01,
        solver=SemiImplicitEuler(inner_step=STEP, positions=("vehicle[].displacement",)),
    ) as plant:
        speed = plant.state(
            "vehicle[].speed", unit="m/s", size=size, nominal=10.0, output=True,
            description="speed of the vehicle",
        )  # fmt: skip
        displacement = plant.state(
            "vehicle[].displacement", unit="m", size=size, nominal=100.0,
            description="way from the vehicle's place in the unloaded train at the start",
        )  # fmt: skip
        plant.der(displacement, speed)
        running = declare_running(plant, consist, displacement, speed, gradients=gradients)
        locomotives = declare_locomotives(plant, consist, speed)
        shoes = declare_air_brake(plant, consist, speed, running.length)
        couplers = declare_couplers(plant, consist, hysteresis, displacement, speed)
        _motion(plant, couplers, running, locomotives.forces, shoes, speed)
        gear, stretch = update_couplers(plant, couplers, displacement, speed)
        start = _start(plant, couplers, running, displacement, speed)
        _outputs(plant, speed)
        declare_outputs(plant, couplers)
        declare_energy(
            plant, couplers=couplers, gear=gear, stretch=stretch, running=running,
            locomotives=locomotives, shoes=shoes, speed=speed, start=start,
        )  # fmt: skip
    return plant


def _motion(
    plant: Plant, couplers: Couplers, running: Running, locomotive: Any, shoes: Any, speed: Any
) -> None:
    """Give each vehicle its equation of motion (eq. 1) and its friction."""
    none = ca.MX(0.0)
    ahead, behind = ca.vertcat(none, couplers.force), ca.vertcat(couplers.force, none)

    def equations(pull: Any, hold: Any, fl: Any, w: Any, fb: Any, m: Any, slope: Any) -> list[Any]:
        per_mass = 1.0 / m
        drive = (pull - hold + fl) * per_mass - GRAVITY_PER_MILLE * slope
        return [drive, (w + fb) * per_mass]

    drive, friction = mapped(
        "motion_of_vehicle", equations, ahead, behind, locomotive, running.resistance, shoes,
        running.mass, running.slope, count=speed.shape[0],
    )  # fmt: skip
    plant.der(speed, drive)
    plant.friction(speed, friction)


def _start(
    plant: Plant, couplers: Couplers, running: Running, displacement: Any, speed: Any
) -> Any:
    """Declare what happens once, at the start; return the energy (J) that the train has then."""
    initial = plant.parameter(
        "initial_speed", 0.0, unit="m/s", nominal=10.0, minimum=-100.0, maximum=100.0,
        description="speed of the whole train at the start, over that of each vehicle",
    )  # fmt: skip
    started = plant.mode("started", minimum=0, maximum=1, description="1 after the start")
    energy = plant.memory(
        "energy.start", unit="J", nominal=1e7,
        description="kinetic and potential energy at the start",
    )  # fmt: skip
    stretch = displacement[:-1] - displacement[1:]
    force, branch = gear_forces(couplers, stretch, speed[:-1] - speed[1:], from_rest=True)
    on_branch = {} if couplers.branch is None else {couplers.branch: branch}
    plant.time_event(
        "start", BEFORE_ALL, when=started == 0,
        changes=on_branch | {
            started: 1,
            speed: speed + initial,
            couplers.gear: force,
            couplers.stretch: stretch,
            energy: sum(mechanical_energy(running, speed + initial)),
        },
        description="takes over the initial speed, and stretches the gears from rest",
    )  # fmt: skip
    return energy


def _outputs(plant: Plant, speed: Any) -> None:
    plant.output("speed", speed[0], unit="m/s", nominal=10.0, description="speed of the train")
    (rests,) = mapped(
        "rest_of_vehicle", lambda v: [ca.if_else(v == 0.0, 1.0, 0.0)], speed, count=speed.shape[0]
    )
    plant.output("standing", total(rests), unit="1", description="number of vehicles at rest")
