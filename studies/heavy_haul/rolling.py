"""A rolling line whose waves are about as long as the train; synthetic, ours."""

from functools import cache

from ...models.line import Line, Section, Stop

LENGTH = 15e3  # m
LIMIT = 80.0 / 3.6  # m/s

# (length in m, ‰): waves of 1.5, 2, 2.5 and 3 km, a sag, a level stretch and a crest.
STRETCHES = (
    (1000.0, 0.0),
    (750.0, 6.0), (750.0, -6.0),
    (1000.0, 6.0), (1000.0, -6.0),
    (1250.0, 6.0), (1250.0, -6.0),
    (1500.0, 6.0), (1500.0, -6.0),
    (500.0, 0.0),
    (800.0, -6.0), (800.0, 6.0),
    (700.0, 0.0),
    (600.0, 4.0), (600.0, -4.0),
    (1000.0, 0.0),
)  # fmt: skip


@cache
def rolling_line() -> Line:
    """Return the line, 15 km with a limit of 80 km/h and gradients of ±6 ‰."""
    begins, gradients = 0.0, []
    for length, slope in STRETCHES:
        gradients.append((begins, slope))
        begins += length
    return Line(
        name="Rolling",
        length=begins,
        stops=(Stop(name="West", position=0.0), Stop(name="East", position=begins)),
        speed_limits=((0.0, LIMIT),),
        gradients=tuple(gradients),
        description="Synthetic, ours: waves of 1.5 to 3 km, a sag and a crest",
    )


def rolling_section() -> Section:
    """Return the way along the whole line."""
    return rolling_line().section("West", "East")
