import math
from collections.abc import Callable

import casadi as ca
import pytest

from railcosim.base.errors import DeclarationError, UnitError
from railcosim.models import Plant

Declare = Callable[[Plant], object]


def declare(statement: Declare) -> Plant:
    with Plant("cart") as plant:
        plant.input("force", unit="N")
        speed = plant.state("speed", unit="m/s", output=True)
        plant.der(speed, 0.0)
        statement(plant)
    return plant


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        (lambda p: p.input("force", unit="N"), "'force': the name is taken"),
        (lambda p: p.parameter("time", 1.0, unit="s"), "the name is taken"),
        (lambda p: p.state("x", unit="m"), r"no equation der\(…\) for x"),
        (lambda p: p.input("2nd", unit="N"), "structured names"),
        (lambda p: p.input("a b", unit="N"), "structured names"),
        (lambda p: p.input("a[1]", unit="N"), "structured names"),
        (lambda p: p.input("der(x)", unit="N"), "structured names"),
        (lambda p: p.parameter("solver.x", 1.0, unit="1"), "the solver's"),
        (lambda p: p.der(p.variables("state")[0].symbol, 1.0), "given twice"),
        (lambda p: p.der(p.variables("input")[0].symbol, 1.0), "not input 'force'"),
        (lambda p: p.der(3.0, 1.0), "needs a declared state"),
        (lambda p: p.output("y", ca.MX.sym("sped"), unit="m/s"), "did you mean 'speed'"),
        (lambda p: p.output("y", p.time * math.nan, unit="s"), "holds a NaN"),
        (lambda p: p.output("y", "text", unit="s"), "not a CasADi MX expression"),
        (lambda p: p.output("y", ca.MX.eye(2), unit="s"), "not a column vector"),
        (lambda p: p.parameter("m", 1.0, unit="kg", minimum=2.0), r"outside \[2, inf\]"),
        (lambda p: p.parameter("m", "1", unit="kg"), "not a number"),
        (lambda p: p.input("f", unit="N", description="two\nlines"), "line break"),
        (lambda p: p.parameter("m", 1.0, unit="kg", minimum=2.0, maximum=1.0), "above maximum"),
        (lambda p: p.parameter("m", math.nan, unit="kg"), "finite"),
        (lambda p: p.parameter("m", "heavy", unit="kg"), "not a number"),
        (lambda p: p.parameter("m", [1.0, 2.0], unit="kg"), "2 values given for 1"),
        (lambda p: p.parameter("m", [1.0, 2.0], unit="kg", size=3), "2 values given for 3"),
        (lambda p: p.parameter("m", 1.0, unit="kg", nominal=0.0), "nominal must be positive"),
        (lambda p: p.input("f", unit="N", size=0), "size must be"),
    ],
)
def test_a_mistake_is_named_where_it_is_made(statement: Declare, message: str) -> None:
    with pytest.raises(DeclarationError, match=message) as caught:
        declare(statement)
    assert "plant 'cart'" in str(caught.value)


def test_an_unknown_unit_is_named() -> None:
    with pytest.raises(UnitError, match=r"plant 'cart', input 'f': unknown unit 'parsec'"):
        declare(lambda p: p.input("f", unit="parsec"))


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        (lambda p, x, m: p.event("e", x > 0.5, direction="rising", changes={m: 1}), "is a condit"),
        (lambda p, x, m: p.event("e", x, direction="up", changes={m: 1}), "one of rising, fall"),
        (lambda p, x, m: p.event("e", x, direction="both", changes={}), "must change something"),
        (lambda p, x, m: p.event("e", x, direction="both", changes={"mode": 1}), "not its name"),
        (lambda p, x, m: p.event("e", x, direction="both", changes={"z": 1}), "not declared here"),
        (
            lambda p, x, m: p.event(
                "e", x, direction="both", changes={p.output("y", x, unit="m/s"): 1}
            ),
            r"changes None: output\(\) returns no symbol",
        ),
        (
            lambda p, x, m: p.event("e", x, direction="both", changes={p.input("u", unit="1"): 1}),
            "not inputs; declare what an event must change as a memory",
        ),
        (
            lambda p, x, m: p.event("e", x, direction="both", when=x > 1, changes={m: 1}),
            "when depends on 'speed', which changes between events",
        ),
        (lambda p, x, m: p.time_event("e", x, changes={m: 1}), "its time depends on 'speed'"),
        (
            lambda p, x, m: p.event("e", x, direction="both", nominal=0.0, changes={m: 1}),
            "nominal must be a positive number",
        ),
        (lambda p, x, m: p.update(m, 1), "needs a declared memory, not mode 'mode'; memories: "),
        (lambda p, x, m: p.mode("n", start=0.5), "modes are integers"),
        (lambda p, x, m: p.dependent("d", x, unit="1"), "only parameters are allowed"),
        (lambda p, x, m: p.state("v[].x", unit="1"), "stands for an index; give a size"),
        (
            lambda p, x, m: p.event("e", ca.vertcat(x, x), direction="both", changes={x: 0.0}),
            "changes vectors of its own 2 elements, not of 1",
        ),
    ],
)
def test_a_mistake_about_events_is_named(statement, message: str) -> None:
    def both(plant: Plant) -> None:
        speed = next(v for v in plant.variables("state")).symbol
        statement(plant, speed, plant.mode("mode"))

    with pytest.raises(DeclarationError, match=message):
        declare(both)


def test_a_plant_without_output_is_refused() -> None:
    with pytest.raises(DeclarationError, match="no output"), Plant("mute") as plant:
        plant.der(plant.state("x", unit="1"), 0.0)


def test_nothing_is_declared_after_the_end() -> None:
    plant = declare(lambda p: None)
    with pytest.raises(DeclarationError, match="after the declaration's end"):
        plant.input("late", unit="N")


def test_an_unfinished_plant_is_refused() -> None:
    with pytest.raises(DeclarationError, match="not finished"):
        Plant("open").derivatives  # noqa: B018


def test_an_error_in_the_block_is_not_hidden_by_the_check() -> None:
    with pytest.raises(ZeroDivisionError), Plant("broken") as plant:
        plant.state("x", unit="1", start=1 / 0)


def test_vectors() -> None:
    plant = declare(lambda p: p.parameter("mass", 2.0, unit="kg", size=3, tunable=True))
    mass = plant.variables("parameter")[0]
    assert mass.element_names == ("mass[1]", "mass[2]", "mass[3]")
    assert mass.start == (2.0, 2.0, 2.0)
    assert mass.variability == "tunable"


def test_expressions_are_kept_as_written() -> None:
    """Not simplified: the C does what the equations say, operation by operation."""
    with Plant("written") as plant:
        u = plant.input("u", unit="1")
        plant.output("y", (u / 3.0) * 3.0 + 0.0 * u, unit="1")
    assert str(plant.outputs["y"]) != "u"
    y = ca.MX.sym("y")
    assert str(y + 0) == "y"  # outside, CasADi simplifies as ever


def test_a_vector_state_needs_as_many_equations() -> None:
    def statement(p: Plant) -> None:
        p.der(p.state("x", unit="1", size=3), ca.MX.zeros(2))

    with pytest.raises(DeclarationError, match="has 2 elements, the state has 3"):
        declare(statement)
