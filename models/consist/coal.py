"""The coal train of the heavy-haul paper: HXD1 locomotives, C80 wagons, MT-2 draft gears.

Where each number is from is said at the function that gives it: paper (the heavy-haul paper),
public page (makers' and encyclopaedias' data), derived, from memory, or our choice.
"""

from collections.abc import Sequence

from ...base.errors import ParameterError
from ..line.train import KMH
from .checks import Pairs
from .consist import LONGEST, Consist, EndOfTrain
from .draft_gear import Coupler, DraftGear
from .vehicle import Envelope, RunningResistance, ShoeBrake, Vehicle

POWER = 9.6e6  # W of an HXD1 at the wheel, public page
IN_A_SET = 3  # C80 wagons that drawbars join to a set; our choice

# km/h and kN. Each last point lies beyond where the power takes over, so the force has no step;
# the corner at 23 t is where 715.8 − 3.169 V is 700 kN.
_TRACTION = {
    25: ((0.0, 760.0), (5.0, 760.0), (70.0, 513.0)),
    23: ((0.0, 700.0), (15.8 / 3.169, 700.0), (75.0, 478.125)),
}
_ELECTRIC_BRAKE = ((2.0, 0.0), (10.0, 461.0), (75.0, 461.0))
_MASS = {25: 200e3, 23: 184e3}  # kg


def hxd1(*, axle_load: int = 25) -> Vehicle:
    """Return an HXD1, both sections as one vehicle, with an axle load of 25 or 23 t.

    Mass: paper at 25 t (200 t), derived at 23 t (184 t). Length, 760 and 700 kN at the start,
    9.6 MW: public page. The lines 779 − 3.8 V and 715.8 − 3.169 V kN between: derived. Electric
    brake 461 kN up to 75 km/h and then 9.6 MW: public page; its fading from 10 to 2 km/h: our
    choice. Resistance: paper. The air brake of the locomotive is not used: our choice.
    Raise ParameterError for another axle load.
    """
    if axle_load not in tuple(_MASS):
        raise ParameterError(f"an HXD1 has an axle load of 25 or 23 t, not {axle_load!r}")
    return Vehicle(
        name="HXD1",
        mass=_MASS[axle_load],
        length=35.222,
        resistance=RunningResistance(
            constant=1.4, linear=0.0038, quadratic=0.0003, starting=5.0
        ),
        traction=Envelope(points=_si(_TRACTION[axle_load]), power=POWER),
        electric_brake=Envelope(points=_si(_ELECTRIC_BRAKE), power=POWER),
    )  # fmt: skip


def c80(*, loaded: bool = True) -> Vehicle:
    """Return a C80 coal wagon, of 100 t loaded and of 20 t empty.

    Masses: paper (10 000 t in 100 wagons), public page for the tare. Length: 12 m, public page.
    Resistance loaded: paper; empty: the rules' for empty wagons, from memory, with the paper's
    starting value. Brake: see ShoeBrake; empty, the cylinder pressure is 40 % of the loaded one, as
    an empty-load valve makes it, our choice.
    """
    if loaded:
        resistance = RunningResistance(
            constant=0.92, linear=0.0048, quadratic=0.000125, starting=3.5
        )
        return Vehicle(
            name="C80", mass=100e3, length=12.0, resistance=resistance, brake=ShoeBrake()
        )
    return Vehicle(
        name="C80 empty",
        mass=20e3,
        length=12.0,
        resistance=RunningResistance(
            constant=2.23, linear=0.0053, quadratic=0.000675, starting=3.5
        ),
        brake=ShoeBrake(cylinder_pressure=168e3),
    )  # fmt: skip


def mt2() -> DraftGear:
    """Return the two MT-2 draft gears of a joint in series: 166 mm, 2.27 MN.

    Stroke (83 mm each) and force: public page; the curve, on which a gear takes 59.7 kJ, and all
    else: our choice.
    """
    return DraftGear(name="MT-2")


def coal_train(
    *,
    locomotives: int = 2,
    wagons: int = 100,
    axle_load: int = 25,
    loaded: bool = True,
    end_of_train: EndOfTrain | None = None,
    distributed: bool | Sequence[int] = False,
) -> Consist:
    """Return HXD1 locomotives and C80 wagons; the paper's are 2 and 100 (10 000 t behind them).

    Three wagons each are a set, drawbars within it and couplers else. The paper's train has a
    controllable end-of-train device, here with `end_of_train=EndOfTrain()`. All locomotives are
    in front, but with `distributed` half of them (the larger half) are, and the rest behind half of
    the wagons. A list says it for each locomotive: how many wagons are before it, as (0, 51).
    Raise ParameterError for a train that cannot be.
    """
    _check_count("locomotives", locomotives, 1)
    _check_count("wagons", wagons, 0)
    before = _before(locomotives, wagons, distributed)
    engine, wagon = hxd1(axle_load=axle_load), c80(loaded=loaded)
    coupler = Coupler(gear=mt2())
    drawbar = Coupler(gear=coupler.gear, slack=0.0)
    vehicles: list[Vehicle] = []
    couplers: list[Coupler] = []
    for count in range(wagons + 1):
        if count > 0:
            vehicles.append(wagon)
            couplers.append(coupler if (count - 1) % IN_A_SET == 0 else drawbar)
        engines = before.count(count)
        vehicles += [engine] * engines
        couplers += [coupler] * engines
    return Consist(
        name=f"{locomotives} HXD1 + {wagons} {wagon.name}",
        vehicles=tuple(vehicles),
        couplers=tuple(couplers[1:]),  # each is before its vehicle
        end_of_train=end_of_train,
    )


def _check_count(field: str, value: int, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= LONGEST:
        raise ParameterError(f"coal train: {field} must be {least} to {LONGEST}, not {value!r}")


def _before(locomotives: int, wagons: int, distributed: bool | Sequence[int]) -> list[int]:
    """Return for each locomotive how many wagons are before it."""
    if isinstance(distributed, bool):
        leading = (locomotives + 1) // 2 if distributed else locomotives
        middle = round(wagons / 2 / IN_A_SET) * IN_A_SET
        return [0] * leading + [middle] * (locomotives - leading)
    whole = isinstance(distributed, Sequence) and all(type(count) is int for count in distributed)
    if not whole:
        raise ParameterError(
            "coal train: distributed must be true, false or a list of whole numbers, one for each "
            f"locomotive: how many wagons are before it; not {distributed!r}"
        )
    before = list(distributed)
    if len(before) != locomotives or before != sorted(before) or before[0] != 0:
        raise ParameterError(
            f"coal train: distributed must say for each of the {locomotives} locomotives how many "
            f"wagons are before it, from 0 and not falling, but is {before}"
        )
    for count in before:
        if not 0 <= count <= wagons or (count % IN_A_SET and count != wagons):
            raise ParameterError(
                f"coal train: no locomotive can be behind {count} of {wagons} wagons; sets of "
                f"{IN_A_SET} are not parted"
            )
    return before


def _si(points: Pairs) -> Pairs:
    """Return (km/h, kN) pairs in m/s and N."""
    return tuple((velocity / KMH, 1e3 * force) for velocity, force in points)
