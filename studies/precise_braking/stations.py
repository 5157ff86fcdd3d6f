"""The seven runs of the paper's table 3, in line order, and what the paper says of each."""

from dataclasses import dataclass, replace

from ...base.errors import ParameterError, listing
from .truth import TRAINS, Truth


@dataclass(frozen=True)
class Station:
    """A station at which one of the paper's runs ends.

    `approach` and `platform` are gradients in ‰ (synthetic, our choice). The paper's stopping
    accuracies in cm: table 3 (absolute values) for SMARC, SMC and PID, and table 4's mean and
    "variance" for SMARC, which is a standard deviation of four integer stops.
    """

    name: str
    origin: str
    approach: float
    platform: float
    smarc: float
    smc: float
    pid: float
    mean: float
    deviation: float

    @property
    def key(self) -> str:
        """The name as metrics have it."""
        return self.name.lower()


STATIONS = (
    Station("Lishuiqiao", "Tiantongyuannan", -3.0, 0.0, 7.26, 11.8, 31.2, -2.00, 9.25),
    Station("Beiyuanlubei", "Lishuiqiao", 2.0, 0.0, 4.50, 12.3, 26.1, -6.75, 11.26),
    Station("Datunludong", "Beiyuanlubei", 5.0, 1.0, 3.88, 15.2, 35.1, -3.75, 6.38),
    Station("Huixinxijiebeikou", "Datunludong", -12.0, 2.0, 4.63, 10.2, 20.6, 4.25, 5.36),
    Station("Huixinxijienankou", "Huixinxijiebeikou", 3.0, -2.0, 3.57, 12.9, 30.2, -2.00, 8.51),
    Station("Hepingxiqiao", "Huixinxijienankou", -5.0, 2.0, 4.19, 18.3, 25.8, 1.75, 0.43),
    Station("Hepinglibeijie", "Hepingxiqiao", 6.0, -2.0, 2.14, 15.6, 35.1, 4.00, 1.41),
)

# Table 2: speed error in cm/s, computing time in s
FIDELITY = {"precise": (25.827, 49.5), "coarse": (117.26, 50.3)}


def nominal(train: str, station: int) -> Truth:
    """Return the nominal numbers of a train ("v12", "v6", "v3") at station 0 to 6.

    Raise ParameterError for a train or station that is not there.
    """
    if station not in range(len(STATIONS)):
        names = listing(f"{k} {s.name}" for k, s in enumerate(STATIONS))
        raise ParameterError(f"no station {station!r}; stations by number: {names}")
    if train not in TRAINS:
        raise ParameterError(f"no train '{train}'; trains: {listing(TRAINS)}")
    place = STATIONS[station]
    return replace(TRAINS[train], approach=place.approach, platform=place.platform)
