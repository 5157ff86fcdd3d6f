"""Trains and sections for the tests of speed curves."""

from typing import Any

from railcosim.models.line import Davis, Section, Train, metro_b

METRO = metro_b()


def train(**changes: Any) -> Train:
    """Return the metro train with other numbers."""
    fields = {name: getattr(METRO, name) for name in METRO.__dataclass_fields__}
    return Train(**{**fields, **changes})


def section(length: float, *, gradients: Any = ((0.0, 0.0),), limits: Any = None) -> Section:
    """Return a section; level and at 80 km/h if nothing else is said."""
    limits = limits or ((0.0, 80.0 / 3.6),)
    return Section(name="A–B", length=length, gradients=gradients, speed_limits=limits)


FRICTIONLESS = Davis(a=0.0, b=0.0, c=0.0)
VARIED = section(
    3000.0,
    gradients=((0.0, 0.0), (500.0, 20.0), (900.0, -25.0), (1500.0, 3.0)),
    limits=((0.0, 16.0), (600.0, 21.0), (1200.0, 14.0), (1260.0, 11.0), (1300.0, 22.0),
            (1600.0, 19.0), (2800.0, 12.0)),
)  # fmt: skip
