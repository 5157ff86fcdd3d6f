"""Pacing against a clock of our own, exactly; and once against the real one."""

from dataclasses import dataclass, field
from fractions import Fraction
from time import perf_counter

import pytest

from railcosim.base.errors import ParameterError
from railcosim.cosim.clock import Clock
from railcosim.cosim.results.pacing import Pace, Pacer, PacingReport


@dataclass
class Wall:
    """A clock on the wall that only moves when somebody sleeps, works or looks at it."""

    time: float = 1000.0
    look: float = 2.0**-20  # s that a look at it takes: so waiting without sleep ends, too
    sleeps: list[float] = field(default_factory=list)
    overslept: float = 0.0

    def now(self) -> float:
        self.time += self.look
        return self.time

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.sleeps.append(seconds)
        self.time += seconds + self.overslept


def pacer(wall: Wall, pace: Pace | None = None, clock: Clock | None = None) -> Pacer:
    return Pacer(pace or Pace(), clock or Clock(Fraction(1, 4)), wall.now, wall.sleep)


def test_every_tick_comes_when_it_is_due() -> None:
    wall = Wall()
    paced = pacer(wall)
    times = []
    for k in range(9):
        paced.wait(k)
        times.append(wall.time)
    assert [t - times[0] for t in times] == pytest.approx([k / 4 for k in range(9)], abs=2e-5)
    assert sum(wall.sleeps) == pytest.approx(2.0, abs=9 * 3e-4)  # it does not burn the time
    report = paced.report()
    assert (report.ticks, report.missed, report.late) == (9, 0, ())
    assert report.worst <= 2e-5


@pytest.mark.parametrize(("factor", "seconds"), [(2.0, 5.0), (0.5, 20.0), (10, 1.0)])
def test_the_factor(factor: float, seconds: float) -> None:
    wall = Wall()
    paced = pacer(wall, Pace(factor=factor))
    paced.wait(0)
    start = wall.time
    for k in range(1, 41):
        paced.wait(k)
    assert wall.time - start == pytest.approx(seconds, abs=2e-5)


def test_no_drift() -> None:
    """A million ticks of a step that is no float, each sleeping a little too long."""
    wall = Wall(overslept=1e-4)
    paced = pacer(wall, clock=Clock(Fraction(1, 1000)))
    paced.wait(0)
    start = wall.time
    for k in range(100_000, 1_100_000, 100_000):
        paced.wait(k)
        assert wall.time - start == pytest.approx(k / 1000, abs=2e-4)


def test_late_ticks_are_counted_and_caught_up() -> None:
    """Tick 2 takes 0.6 s of its 0.25: ticks 3 and 4 are late, 5 is due again."""
    wall = Wall()
    paced = pacer(wall, clock=Clock(Fraction(1, 4), Fraction(7)))
    came = []
    for k in range(8):
        paced.wait(k)
        came.append(wall.time - 1000.0)
        wall.time += 0.6 if k == 2 else 0.0
    report = paced.report()
    assert report.missed == 2
    assert [(one.tick, one.time) for one in report.late] == [(3, 7.75), (4, 8.0)]
    assert [one.lateness for one in report.late] == pytest.approx([0.35, 0.1], abs=1e-4)
    assert report.worst == pytest.approx(0.35, abs=1e-4)
    assert came[5:] == pytest.approx([1.25, 1.5, 1.75], abs=1e-4)


def test_the_tolerance() -> None:
    for tolerance, missed in ((0.0625, 0), (0.03125, 3)):
        wall = Wall(look=0.0)
        paced = pacer(wall, Pace(tolerance=tolerance))
        for k in range(4):
            wall.time = 1000.0 + 0.25 * k + (0.0625 if k else 0.0)
            paced.wait(k)
        assert paced.report().missed == missed


def test_only_the_first_twenty_late_ticks_are_listed() -> None:
    wall = Wall()
    paced = pacer(wall)
    for k in range(100):
        paced.wait(k)
        wall.time += 0.5
    report = paced.report()
    assert (report.ticks, report.missed) == (100, 99)
    assert [one.tick for one in report.late] == list(range(1, 21))
    assert report.worst == pytest.approx(99 * 0.25, abs=0.01)


def test_a_pause_is_no_delay() -> None:
    wall = Wall()
    paced = pacer(wall)
    for k in range(4):
        paced.wait(k)
    wall.time += 100.0
    paced.anchor(4)
    start = wall.time
    for k in range(4, 9):
        paced.wait(k)
    assert wall.time - start == pytest.approx(1.0, abs=2e-5)
    assert paced.report().missed == 0


def test_the_report_reads_well_and_can_be_kept() -> None:
    wall = Wall()
    paced = pacer(wall, Pace(factor=2))
    for k in range(3):
        paced.wait(k)
    assert str(paced.report()).startswith("2 × real time: no deadline of 3 missed, latest tick")
    wall.time += 0.2
    paced.wait(3)
    report = paced.report()
    assert str(report) == (
        "2 × real time: 1 of 4 deadlines missed by more than 1 ms, latest tick 75 ms, "
        "first at t = 0.75 s"
    )
    assert PacingReport.from_dict(report.to_dict()) == report


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"factor": 0.0}, "factor must be a positive number, not 0.0"),
        ({"factor": "2"}, "factor must be a positive number, not '2'"),
        ({"factor": float("inf")}, "factor must be a positive number"),
        ({"factor": True}, "factor must be a positive number"),
        ({"tolerance": -1e-3}, "tolerance must be a number of seconds from 0, not -0.001"),
        ({"tolerance": None}, "tolerance must be"),
    ],
)
def test_wrong_values(values: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Pace(**values)


def test_against_the_real_clock() -> None:
    """No tick comes early, and the last one when it is due; how late depends on the machine."""
    paced = Pacer(Pace(factor=5), Clock(Fraction(1, 100)))
    paced.wait(0)
    start = perf_counter()
    for k in range(1, 51):
        paced.wait(k)
        assert perf_counter() - start > k / 500 - 1e-4
    assert perf_counter() - start < 0.1 + paced.report().worst + 0.05
