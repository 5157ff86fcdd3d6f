"""Beijing Line 5 and its train, against what the study says of them."""

from itertools import pairwise

import pytest

from railcosim.models.line import SEVEN_RUNS, beijing_line_5, metro_b

LENGTHS = [1544, 1305, 1286, 3000, 1838, 1122, 1025, 1059]
APPROACH_AND_PLATFORM = [(-3, 0), (2, 0), (5, 1), (-12, 2), (3, -2), (-5, 2), (6, -2)]


def test_the_interstations_have_their_distances():
    line = beijing_line_5()
    assert [line.section(*pair).length for pair in line.interstations] == LENGTHS
    assert line.stop("惠新西街北口").name == "Huixinxijiebeikou"


def test_every_way_of_the_line_can_be_run_in_both_directions():
    line = beijing_line_5()
    limits = {80 / 3.6, 65 / 3.6, 60 / 3.6}
    for start in line.stops:
        for end in line.stops:
            if start != end:
                section = line.section(start.name, end.name, train_length=118.0)
                back = line.section(end.name, start.name)
                assert section.length == back.length
                assert section.elevation(section.length) == pytest.approx(
                    -back.elevation(back.length), abs=1e-9
                )
                assert {limit for _, limit in section.speed_limits} <= limits


@pytest.mark.parametrize("number", range(7))
def test_the_seven_runs_have_their_approaches_and_platforms(number: int):
    section = beijing_line_5().section(*SEVEN_RUNS[number])
    approach, platform = APPROACH_AND_PLATFORM[number]
    assert section.gradient_at(0.0) == section.gradient_at(section.length - 400.1) == 0.0
    assert section.gradient_at(section.length - 400.0) == approach
    assert section.gradient_at(section.length - 120.1) == approach
    assert section.gradient_at(section.length - 120.0) == platform
    assert section.gradient_at(section.length + 5.0) == platform


def test_the_seven_runs_join_end_to_start():
    assert all(run[1] == following[0] for run, following in pairwise(SEVEN_RUNS))
    line = beijing_line_5()
    assert sum(line.section(*run).length for run in SEVEN_RUNS) == sum(LENGTHS)


def test_the_train_is_the_one_of_the_study():
    train = metro_b()
    assert (train.mass, train.max_traction_force, train.max_power) == (240e3, 280e3, 2.8e6)
    assert [train.mass_at(load) for load in ("AW0", "AW2", "AW3")] == [200e3, 285e3, 312e3]
    assert train.davis.a == pytest.approx(2.031, rel=1e-12)
    assert train.davis.b == pytest.approx(0.0622, rel=1e-12)
    assert train.davis.c == pytest.approx(0.001807, rel=1e-12)
    assert (train.max_speed, train.length) == (80 / 3.6, 118.0)
    assert (train.service_deceleration, train.emergency_deceleration) == (1.0, 1.2)
    assert train.rotating_mass_factor == 1.0
