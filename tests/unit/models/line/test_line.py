"""Lines and sections: positions, directions, profiles, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.models.line import Line, Section, Stop

LINE = Line(
    name="sample",
    length=3000.0,
    stops=(
        Stop(name="Alder", position=0.0),
        Stop(name="Birch Road", position=1000.0, local_name="桦树路"),
        Stop(name="Cedar", position=2600.0),
    ),
    speed_limits=((0.0, 20.0), (900.0, 15.0), (1000.0, 22.0), (1500.0, 10.0), (1600.0, 22.0)),
    gradients=((0.0, 0.0), (400.0, -5.0), (1400.0, 3.0), (2500.0, 1.0)),
)


def test_a_section_begins_at_its_departure_stop():
    section = LINE.section("Birch Road", "Cedar")
    assert section.length == 1600.0
    assert section.gradients == ((0.0, -5.0), (400.0, 3.0), (1500.0, 1.0))
    assert section.speed_limits == ((0.0, 22.0), (500.0, 10.0), (600.0, 22.0))
    assert section.name == "Birch Road–Cedar"


def test_against_the_direction_positions_are_mirrored_and_gradients_negated():
    section = LINE.section("Cedar", "Birch Road")
    assert section.length == 1600.0
    assert section.gradients == ((0.0, -1.0), (100.0, -3.0), (1200.0, 5.0))
    assert section.speed_limits == ((0.0, 22.0), (1000.0, 10.0), (1100.0, 22.0))


def test_a_section_may_run_through_stops():
    assert LINE.section("Alder", "Cedar").length == 2600.0


def test_a_value_begins_at_its_position_and_holds_beyond_the_ends():
    section = LINE.section("Birch Road", "Cedar")
    assert section.gradient_at(math.nextafter(400.0, 0.0)) == -5.0
    assert section.gradient_at(400.0) == 3.0
    assert section.limit_at(-3.0) == 22.0
    assert section.gradient_at(1700.0) == 1.0
    assert section.elevation(-10.0) == pytest.approx(0.05)
    assert section.elevation(1610.0) - section.elevation(1600.0) == pytest.approx(0.01)


def test_a_level_line_needs_no_gradients():
    stops = (Stop(name="Alder", position=0.0), Stop(name="E", position=9.0))
    line = Line(name="level", length=10.0, stops=stops, speed_limits=((0.0, 5.0),))
    assert line.section("E", "Alder").gradients == ((0.0, 0.0),)


def test_the_front_may_speed_up_when_the_rear_has_left_the_slow_stretch():
    section = LINE.section("Birch Road", "Cedar", train_length=150.0)
    # The train leaves with its rear in the 15 m/s before the stop.
    assert section.speed_limits == ((0.0, 15.0), (150.0, 22.0), (500.0, 10.0), (750.0, 22.0))


@pytest.mark.parametrize("name", ["Birch Road", "birch road", "BirchRoad", "birch-road", "桦树路"])
def test_a_stop_is_found_by_either_name_however_it_is_spaced(name: str):
    assert LINE.stop(name).position == 1000.0


def test_an_unknown_stop_is_named_with_the_known_ones_and_the_nearest():
    with pytest.raises(
        ParameterError,
        match="no stop 'Ceder' on line 'sample'; stops: Alder, Birch Road, Cedar; "
        "did you mean 'Cedar'",
    ):
        LINE.section("Alder", "Ceder")
    with pytest.raises(ParameterError, match="no stop ''"):
        LINE.stop("")


def test_a_section_needs_two_stops():
    with pytest.raises(ParameterError, match="are the same stop"):
        LINE.section("Cedar", "cedar")
    with pytest.raises(ParameterError, match="must not be negative"):
        LINE.section("Alder", "Cedar", train_length=-1.0)


def test_interstations_are_the_neighbouring_pairs():
    assert LINE.interstations == (("Alder", "Birch Road"), ("Birch Road", "Cedar"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"length": 0.0}, "the length must be positive"),
        ({"length": math.inf}, "the length must be positive and finite"),
        ({"length": 2500.0}, r"gradients\[3\]\[0\]: 2500 m is not before the end at 2500 m"),
        ({"length": 2550.0}, r"stops\[2\]: 2600 m is not on the line, 0 to 2550 m"),
        ({"gradients": ()}, "gradients: no .position, value. pair"),
        ({"gradients": ((1.0, 0.0),)}, r"gradients\[0\]\[0\]: the first position must be 0"),
        ({"gradients": ((0.0, 0.0), (5.0, math.nan))}, r"gradients\[1\]\[1\]: nan ‰ is not within"),
        ({"gradients": ((0.0, 300.0),)}, r"gradients\[0\]\[1\]: 300 ‰ is not within -150 to 150"),
        ({"gradients": ((0.0, 0.0), (math.nan, 1.0))}, r"gradients\[1\]\[0\]: .*not finite"),
        ({"speed_limits": ((0.0, 0.0),)}, r"speed_limits\[0\]\[1\]: 0 km/h is not within 1 to 720"),
        (
            {"speed_limits": ((0.0, 9.0), (7.0, 8.0), (7.0, 9.0))},
            r"speed_limits\[2\]\[0\]: 7 m does not lie after the 7 m before it",
        ),
        ({"stops": LINE.stops[:1]}, "stops: a line needs two stops or more, not 1"),
        ({"stops": LINE.stops[::-1]}, r"stops\[1\]: 1000 m does not lie after the 2600 m"),
        (
            {"stops": (*LINE.stops, Stop(name="birchroad", position=2700.0))},
            r"stops\[3\]: 'birchroad' is also the name of stop 1",
        ),
        ({"stops": (Stop(name=" ", position=0.0), *LINE.stops[1:])}, r"stops\[0\]: .* no name"),
    ],
)
def test_a_line_that_cannot_be_is_refused_with_the_place(changes: dict, message: str):
    with pytest.raises(ParameterError, match=rf"line 'sample': {message}"):
        replace(LINE, **changes)


def test_a_section_that_cannot_be_is_refused():
    with pytest.raises(ParameterError, match=r"section 's': speed_limits\[1\]\[0\]: 50 m is not"):
        Section(name="s", length=50.0, gradients=((0.0, 0.0),), speed_limits=((0, 9), (50, 8)))


def test_random_sections_agree_with_the_line_sampled_on_a_fine_grid():
    rng = np.random.default_rng(20240703)
    for _ in range(40):
        line, cells = random_line(rng)
        first, last = rng.choice(len(line.stops), 2, replace=False)
        train_length = float(rng.choice([0.0, 1.0, 37.0, 200.0]))
        start, end = line.stops[first], line.stops[last]
        section = line.section(start.name, end.name, train_length=train_length)
        sign = 1 if end.position > start.position else -1
        assert section.length == abs(end.position - start.position)
        # In the middles of cells of 1 m, seen from the line and without any of the profiles' code.
        offsets = np.arange(int(section.length)) + 0.5
        indices = np.floor(start.position + sign * offsets).astype(int)
        assert [section.gradient_at(x) for x in offsets] == list(sign * cells["gradient"][indices])
        under = [covered(cells["limit"], index, sign, train_length) for index in indices]
        assert [section.limit_at(x) for x in offsets] == under
        heights = np.cumsum(sign * cells["gradient"][indices]) / 1000.0
        assert [section.elevation(x + 0.5) for x in offsets] == pytest.approx(heights, abs=1e-10)


def random_line(rng: np.random.Generator) -> tuple[Line, dict[str, np.ndarray]]:
    """A line with all its positions at whole metres, and its values in each metre."""
    length = int(rng.integers(50, 400))
    places = np.sort(rng.choice(length + 1, int(rng.integers(2, 7)), replace=False))
    cells, steps = {}, {}
    for name, low, high in (("gradient", -30, 31), ("limit", 3, 25)):
        begins = np.sort(rng.choice(np.arange(1, length), int(rng.integers(0, 8)), replace=False))
        begins = np.concatenate(([0], begins))
        values = rng.integers(low, high, len(begins)).astype(float)
        steps[name] = tuple(zip(begins.astype(float).tolist(), values.tolist(), strict=True))
        cells[name] = np.repeat(values, np.diff([*begins, length]))
    stops = tuple(Stop(name=f"stop {at}", position=float(at)) for at in places)
    line = Line(name="random", length=float(length), stops=stops, gradients=steps["gradient"],
                speed_limits=steps["limit"])  # fmt: skip
    return line, cells


def covered(cells: np.ndarray, front: int, sign: int, train_length: float) -> float:
    """The lowest of the cells under a train whose front is in the middle of cell `front`."""
    under = front - sign * np.arange(int(train_length) + 1)
    return float(cells[np.clip(under, 0, len(cells) - 1)].min())


def test_positions_that_differ_by_rounding_only_do_no_harm():
    rng = np.random.default_rng(5)
    for _ in range(100):
        # Multiples of 0.1 m: sums and differences of them meet within rounding, not exactly.
        length = float(rng.integers(300, 900)) / 10
        begins = np.unique(rng.integers(1, int(10 * length), 30)) / 10
        values = rng.integers(-20, 20, len(begins) + 1)
        gradients = ((0.0, float(values[0])), *zip(begins.tolist(), map(float, values[1:])))  # noqa: B905
        stops = [float(at) / 10 for at in np.unique(rng.integers(0, int(10 * length), 5))]
        line = Line(
            name="tenths", length=length, gradients=gradients,
            stops=tuple(Stop(name=str(at), position=at) for at in (*stops, length)),
            speed_limits=tuple((at, 25.0 + value / 10) for at, value in gradients),
        )  # fmt: skip
        heights = (
            np.concatenate(([0.0], np.cumsum(values * np.diff([0.0, *begins, length])))) / 1000.0
        )
        for start, end in ((stops[0], length), (length, stops[1]), (stops[1], stops[0])):
            section = line.section(str(start), str(end), train_length=11.3)
            where = np.linspace(0.0, section.length, 7)
            on_line = start + np.sign(end - start) * where
            z = np.interp([start, *on_line], [0.0, *begins, length], heights)
            assert [section.elevation(x) for x in where] == pytest.approx(z[1:] - z[0], abs=1e-12)
