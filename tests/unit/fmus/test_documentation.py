"""The page is read back: its MathML is evaluated by a small reader and compared (tests.pages)."""

import random
import time
from collections.abc import Callable
from html.parser import HTMLParser
from importlib import resources
from typing import Any

import casadi as ca
import pytest

from railcosim.base.errors import DeclarationError
from railcosim.fmus.documentation import documentation_page
from railcosim.fmus.documentation.naming import number
from railcosim.models import Plant, second_order_train
from railcosim.models.solver import DormandPrince, Rodas, SemiImplicitEuler
from tests import plants
from tests.pages import check_page, parsed, parts

# Plants


def bouncing() -> Plant:
    """Dependents, modes, memories, updates, state events and a repeating time event."""
    with Plant("bouncing", description="hits <hard> & bounces", solver=DormandPrince()) as plant:
        g = plant.parameter("g", 9.81, unit="m/s2", description="gravity (ISO 80000), a < b & c")
        e = plant.parameter("restitution", 0.8, unit="1", maximum=1.0, tunable=True)
        rho = plant.parameter("rho", 1.2, unit="kg/m3")
        area = plant.parameter("c_A", 6.5, unit="m2")
        mass = plant.parameter("mass", 8e4, unit="kg", minimum=1.0)
        drag = plant.dependent("drag", 0.5 * rho * area / mass, unit="1/m")
        x = plant.state("x", unit="m", start=1.0, output=True)
        v = plant.state("v", unit="m/s")
        n = plant.mode("count", output=True)
        brake = plant.mode("brake", start=1, minimum=0, maximum=2)
        due = plant.memory("t_next", unit="s", start=2.0)
        peak = plant.memory("peak", unit="m", output=True)
        u = plant.input("u", unit="N", minimum=-1e5, maximum=1e5)
        curve = 1.0 + 0.02 * ca.fabs(v) + 0.001 * v * v
        resistance = ca.if_else(ca.fabs(v) < 0.1, 10.0 * v, ca.sign(v) * curve)
        limited = ca.fmin(ca.fmax(u / mass, -1.0), 1.0)
        braking = ca.if_else(brake == 2, -3.0 * v, ca.if_else(brake == 1, limited, 0.0))
        plant.der(x, v)
        plant.der(v, -g + braking - drag * ca.fabs(v) * v - resistance / 3.6)
        plant.output("energy", 0.5 * mass * v**2 + mass * g * x, unit="J")
        plant.output("moving", ca.fabs(v) > 1e-3, unit="1")
        plant.event("bounce", x, direction="falling", when=n < 100, changes={v: -e * v, n: n + 1})
        plant.event("turn", v, direction="both", changes={peak: x}, description="top & bottom")
        also = ca.logic_and(brake < 2, n != 3)
        changes = {due: due + 2.0, brake: ca.if_else(brake == 0, 1, 0)}
        plant.time_event("tick", due, when=also, changes=changes)
        plant.update(peak, ca.fmax(peak, x))
    return plant


def long_train(n: int) -> Plant:
    """Vehicles of a mapped function, couplers between them, sums over them, vector events."""
    solver = SemiImplicitEuler(positions=("x",))
    with Plant("long_train", solver=solver) as plant:
        u = plant.input("u", unit="1")
        m = plant.parameter("m", [8e4 + i for i in range(n)], unit="kg", size=n)
        stiffness = plant.parameter("k", 1e6, unit="N/m", size=n - 1)
        slack = plant.parameter("slack", 0.02, unit="m")
        force = plant.parameter("vehicle[].F_max", 1e4, unit="N", size=n)
        x = plant.state("x", unit="m", size=n)
        v = plant.state("v", unit="m/s", size=n, output=True)
        on = plant.mode("vehicle[].braking", size=n)
        peak = plant.memory("peak", unit="N", size=n - 1)
        total = plant.dependent("total_mass", ca.sum1(m), unit="kg")
        gap = x[:-1] - x[1:]
        pull = ca.if_else(ca.fabs(gap) < slack, 0, stiffness * (gap - ca.sign(gap) * slack))
        names = ("m", "v", "front", "rear", "u", "limit", "on")
        mv, vv, front, rear, uu, limit, brake = symbols = [ca.MX.sym(s) for s in names]
        drive = uu * ca.if_else(uu > 0, limit, 2 * limit / (1 + vv * vv / 400))
        held = ca.if_else(brake == 1, 0.1 * limit * ca.sign(vv), 0)
        vehicle = ca.Function("vehicle", symbols, [(front - rear + drive - held) / mv - 1e-6 * vv])
        ends = (ca.vertcat(0, pull).T, ca.vertcat(pull, 0).T)
        a = vehicle.map(n)(m.T, v.T, *ends, u, force.T, on.T).T
        plant.der(x, v)
        plant.der(v, a)
        plant.output("pull", pull, unit="N")
        plant.output("mean", ca.dot(m, v) / total, unit="m/s")
        plant.output("power", ca.dot(a * m, v), unit="W")
        plant.output("largest", ca.mmax(pull), unit="N")
        plant.event("hot", v - 30, direction="rising", when=on == 0, changes={on: 1})
        plant.event("cold", v - 28, direction="falling", when=on == 1, changes={on: 0})
        plant.update(peak, ca.fmax(peak, ca.fabs(pull)))
    return plant


def tanks() -> Plant:
    """A stiff plant with vectors of other shapes, fixed elements and a change of a whole vector."""
    with Plant("tanks", solver=Rodas()) as plant:
        omega = plant.parameter("omega", [1.0, 2.0, 3.0], unit="rad/s", size=3)
        level = plant.state("level", unit="m", size=3, start=[1.0, 0.5, 0.25], output=True)
        flow = plant.state("i", unit="A")
        reset = plant.memory("reset", unit="m", size=3, start=[0.1, 0.2, 0.3])
        plant.der(level, ca.vertcat(-omega[0] * level[0], level[:2] - ca.sqrt(level[1:])))
        plant.der(flow, omega[2] * level[0] - flow + plant.time)
        plant.output("matrix", ca.mtimes(ca.DM([[1, 0, -2], [0.5, 3, 1 / 3.6]]), level), unit="m")
        plant.event("empty", ca.sum1(level), direction="falling", changes={level: reset})
    return plant


EVERY: tuple[Callable[[], Plant], ...] = (
    second_order_train, plants.everything, plants.integrator, plants.pendulum, plants.tunable,
    plants.switching, plants.resting, plants.undefined, plants.blow_up, bouncing, tanks,
    lambda: long_train(3), lambda: long_train(40),
)  # fmt: skip


# The equations are those declared


@pytest.mark.parametrize("plant", EVERY)
def test_every_equation_is_the_declared_one(plant: Callable[[], Plant]) -> None:
    check_page(plant())


def of_expressions(*expressions: Callable[[ca.MX, ca.MX, ca.MX, ca.MX], Any]) -> Plant:
    """Return a plant with outputs in two states, a parameter and a mode."""
    with Plant("outputs") as plant:
        x, y = plant.state("x", unit="1"), plant.state("y_max", unit="1")
        p, n = plant.parameter("speed", 1.0, unit="1"), plant.mode("mode")
        plant.der(x, y)
        plant.der(y, x)
        for k, expression in enumerate(expressions):
            plant.output(f"out_{k}", expression(x, y, p, n), unit="1")
    return plant


def repeating(a: Any, b: Any, y: Any) -> Any:
    return 1 - a - a * a + b * y - b * (1 / y) + b


def inverses(x: Any, y: Any) -> Any:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("inverses", [a, b], [(1 / a) * b + (1 / a) * (1 / b) * (-1 / a)])
    return function(x, y)


def test_operations() -> None:
    check_page(
        of_expressions(
            lambda x, y, p, n: 0 + x * 1 - (-y) + 0 * p,
            lambda x, y, p, n: x - (y - (p - x)) - (-x + y),
            lambda x, y, p, n: x / y / p + x / (y / p) - (x / y) / (p / x) + 1 / x * y,
            lambda x, y, p, n: -(x**2) + (-x) ** 2 + (-x) ** 3 - x**-2 + ca.fabs(x) ** 0.5,
            lambda x, y, p, n: (x + y) ** 2 * (x + y) * x * 2 * x * y**3,
            lambda x, y, p, n: (
                ca.fabs(x) ** y + 2**x + (x * y) ** 2 + (x / y) ** 3 + ca.exp(x) ** p
            ),
            lambda x, y, p, n: ca.sin(x) ** 2 - ca.cos(-x * y) * ca.tan(ca.atan(x) / 2),
            lambda x, y, p, n: ca.sqrt(x * x + y * y) + ca.hypot(x, y) + ca.exp(-(x * x)),
            lambda x, y, p, n: (
                ca.log(1 + x * x) + ca.log10(2 + y * y) + ca.log1p(x * x) + ca.expm1(x)
            ),
            lambda x, y, p, n: ca.atan2(x, y) + ca.asinh(x) + ca.tanh(y) + ca.cosh(x) - ca.sinh(y),
            lambda x, y, p, n: ca.floor(x) - ca.ceil(y) * ca.sign(p) + ca.fmod(x, y),
            lambda x, y, p, n: ca.remainder(x, y) + ca.copysign(x, y) + ca.asin(ca.sin(x)),
            lambda x, y, p, n: (
                ca.fmin(x, ca.fmin(y, p)) - 2 * ca.fmax(ca.fmax(x, y), ca.fmin(p, 1))
            ),
            lambda x, y, p, n: 0.1 + 0.2 + x * (0.1 + 0.2) + 1e-6 * y + 2.5e9 * p - 1e300 * x,
            lambda x, y, p, n: (
                x * (1e6) ** 2 + ca.fabs(y) ** (1 / 3.6) - 3.14159 * ca.pi * x / 180 * (1 / 3)
            ),
            lambda x, y, p, n: (
                ca.if_else(x > 0, y, ca.if_else(y <= 1, -p, x)) * ca.if_else(n, x, y)
            ),
            lambda x, y, p, n: x + ca.if_else(x > 0, y, 0) - ca.if_else(y > x, 0, p) + y,
            lambda x, y, p, n: (x > 0) * y + (1 - (x > 0)) * p - (y < 1) * (x < 1) + (x >= y),
            lambda x, y, p, n: ca.logic_or(ca.logic_and(x > 0, y > 0), ca.logic_not(n == 2)),
            lambda x, y, p, n: ca.logic_and(
                ca.logic_or(x > 0, n), ca.logic_not(ca.logic_and(y, p < x))
            ),
            lambda x, y, p, n: ca.conditional(n, [x, y, p], x * y) + ca.if_else(n != 1, x, y, True),
            lambda x, y, p, n: ca.if_else(n <= 1, x, y) - ca.if_else(n < 2, y, p) * (n > 0),
            lambda x, y, p, n: ca.if_else(ca.logic_not(n >= 1), x, ca.logic_not(n != 2)),
            lambda x, y, p, n: inverses(x, y),
            lambda x, y, p, n: repeating(x + y, 1 / x, y),
            lambda x, y, p, n: 1 - (2 - 3 * x) - 4 * (y - 5) / (x - (-6)),
            lambda x, y, p, n: x - ca.fmax(y, -ca.inf) + ca.if_else(x > y, ca.fmin(x, ca.inf), 1),
        ),
        seeds=25,
    )


def test_what_is_readable() -> None:
    """Precedence that only the eye sees, and formulas as people write them."""

    def shown(expression: Callable[..., Any]) -> str:
        block = parts(parsed(documentation_page(of_expressions(expression))))["Outputs"][1]
        return "".join(block.itertext()).replace("\u2062", " ").replace("\u2061", "")

    assert shown(lambda x, y, p, n: 0 + 1 * x) == "out_0=x"
    assert shown(lambda x, y, p, n: 2 * x * x * p) == "out_0=2 x2⋅speed"
    assert shown(lambda x, y, p, n: (x / y) ** 2.5) == "out_0=(xymax)2.5"
    assert shown(lambda x, y, p, n: x - (y - p)) == "out_0=x−ymax+speed"
    assert shown(lambda x, y, p, n: ca.if_else(x > 0, y, p)) == (
        "out_0={ymaxif\xa0x>0speedotherwise"
    )
    assert shown(lambda x, y, p, n: x * (ca.pi / 180)) == "out_0=π180 x"
    assert shown(lambda x, y, p, n: x / 3.6 + (0.1 + 0.2)) == "out_0=x3.6+0.3"
    assert shown(lambda x, y, p, n: x * (1 / 3.6) * 1e-6) == "out_0=13.6⋅10−6 x"


def grown(source: random.Random, leaves: list[Any], depth: int) -> Any:
    """Return a random expression; what it repeats is shared."""
    pool = list(leaves)
    unary = [ca.fabs, ca.sin, ca.sign, ca.floor, lambda a: -a, lambda a: a * a, ca.tanh]
    binary = [
        lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, ca.fmin, ca.fmax,
        lambda a, b: a / (1 + b * b), lambda a, b: a < b, lambda a, b: a >= b,
        ca.logic_and, ca.logic_or, lambda a, b: ca.logic_not(a == b),
        lambda a, b: ca.if_else(a > 0, b, a), lambda a, b: ca.if_else(a, 0, b),
        lambda a, b: (ca.fabs(a) + 1) ** ca.tanh(b), lambda a, b: -a / (2 + ca.fabs(b)) * b,
    ]  # fmt: skip
    for _ in range(depth):
        if source.random() < 0.3:
            pool.append(source.choice(unary)(source.choice(pool[-4:])))
        else:
            pool.append(source.choice(binary)(source.choice(pool[-4:]), source.choice(pool)))
    return pool[-1]


@pytest.mark.parametrize("seed", range(40))
def test_random_expressions(seed: int) -> None:
    source = random.Random(seed)

    def expression(*leaves: Any) -> Any:
        return grown(source, [*leaves, 0, 1, -2.5], source.choice((3, 8, 25)))

    check_page(of_expressions(*[expression] * 6), seeds=10)


@pytest.mark.parametrize("n", [12, 40])
def test_vectors(n: int) -> None:
    """Uniform, with neighbours, with ends of their own, irregular, in sums, in parts of sums."""
    with Plant("vectors") as plant:
        x = plant.state("x", unit="1", size=n, output=True)
        c = plant.parameter("c", 2.0, unit="1", size=n + 1)
        k = plant.parameter("k", 3.0, unit="1")
        plant.der(x, -k * x)
        plant.output("lag", x[1:] - c[: n - 1] * x[: n - 1], unit="1")
        plant.output("ends", ca.vertcat(k, x[1:-1] * x[0] - x[2:] + x[:-2], x[0]), unit="1")
        plant.output("shifted", c[1:] * x + ca.sum1(c), unit="1")
        plant.output("middle", ca.sum1(x[2:]) - ca.sum1(x[:5] * c[1:6]) + ca.sumsqr(x), unit="1")
        plant.output("differences", ca.sum1((x[1:] - x[:-1]) ** 2) / ca.norm_2(c), unit="1")
        plant.output("extremes", ca.mmax(x) - ca.mmin(x * c[:n]), unit="1")
        plant.output("nested", ca.dot(x, c[:n] * ca.sum1(x)) * ca.sum1(c), unit="1")
        table = ca.DM([[1 + i * j % 7 for j in range(3)] for i in range(6)])
        plant.output("table", ca.mtimes(table, x[:3]), unit="1")
        plant.output("sums", x + ca.sum1(x[:7] * ca.sum1(c[:6])), unit="1")
        plant.output("mean", (ca.sum1(x) / n - x) * c[1:], unit="1")
        plant.output("outer", ca.sum1(ca.sum2(ca.mtimes(x, c[:n].T))), unit="1")
        plant.output("same", ca.repmat(k * k, 9, 1), unit="1")
    check_page(plant, seeds=5)


def test_a_thousand_vehicles_are_checked_and_quick() -> None:
    plant = long_train(1000)
    documentation_page(long_train(3))  # what is loaded once does not count
    start = time.process_time()
    page = documentation_page(plant)
    assert time.process_time() - start < 1.0
    assert len(page) < 100_000
    check_page(plant, seeds=1)


def sums_in_pieces(n: int) -> Plant:
    """Sums and extremes in chains side by side, places of extremes, numbered elements."""
    with Plant("pieces") as plant:
        x = plant.state("x", unit="1", size=n, output=True)
        c = plant.parameter("c", 2.0, unit="1", size=n)
        plant.der(x, -c * x)
        a, b = ca.SX.sym("a"), ca.SX.sym("b")
        deep = a
        for _ in range(2):
            deep = ca.fmax(deep - b, 0.5 * deep * deep) / (1.0 + ca.fabs(deep))
        force = ca.Function("deep", [a, b], [deep]).map(n)(x.T, c.T).T
        part = n // 3
        chains = [force[k * part : (k + 1) * part] for k in range(3)]
        rest = force[3 * part :]
        plant.output("sum", ca.sum1(chains[0] + chains[1] + chains[2]) + ca.sum1(rest), unit="1")
        most = ca.fmax(ca.mmax(ca.fmax(ca.fmax(*chains[:2]), chains[2])), ca.mmax(rest))
        plant.output("most", most, unit="1")
        behind = ca.if_else(force == most, -ca.DM(range(1, n + 1)), -1e9)
        plant.output("at", -ca.mmax(behind), unit="1")
        plant.output("numbered", ca.dot(ca.DM(range(3, 3 + 2 * n, 2)), x) - x[2], unit="1")
        plant.output("neighbours", ca.sum1(x[1:] + x[:-1]) + ca.sum1(c * x), unit="1")
        plant.output("twice", ca.sum1(x[: n // 2] + x[: n // 2]), unit="1")
        plant.output("own", ca.DM(range(n)) * x - ca.sum1(c), unit="1")
    return plant


@pytest.mark.parametrize("n", [17, 61])
def test_sums_in_pieces_and_numbers_of_elements(n: int) -> None:
    check_page(sums_in_pieces(n), seeds=2)


def test_length_costs_little_and_hides_nothing() -> None:
    short, long = (documentation_page(sums_in_pieces(n)) for n in (61, 601))
    assert len(long) < 1.1 * len(short)
    assert "left out" not in long


def test_a_long_chain_of_single_elements_is_a_sum() -> None:
    with Plant("chained") as plant:
        x = plant.state("x", unit="1", size=2000, output=True)
        plant.der(x, -x)
        total = ca.sum1(x[:3])
        for k in range(3, 2000):
            total = total + x[k]
        plant.output("total", total, unit="1")
    assert "left out" not in documentation_page(plant)
    check_page(plant, seeds=1)


def test_one_element_of_its_own_is_in_no_pattern() -> None:
    with Plant("odd_one") as plant:
        x = plant.state("x", unit="1", size=30, output=True)
        scale = ca.DM([1.5] * 17 + [1.5 + 1e-15] + [1.5] * 12)
        plant.der(x, -scale * x)
        plant.output("total", ca.dot(scale, x), unit="1")
    block = parts(parsed(documentation_page(plant)))["States"]
    assert ["i=1,…,17,19,…,30" in "".join(e.itertext()) for e in block[1:]] == [True, False]


# What has no formula


def test_irregular_vectors_say_what_they_leave_out() -> None:
    numbers = ca.DM([float(k * k % 101) for k in range(50)])
    with Plant("irregular") as plant:
        x = plant.state("x", unit="1", size=50, output=True)
        plant.der(x, numbers * x)
        plant.output("sum", ca.dot(numbers, x), unit="1")
    page = documentation_page(plant)
    assert "The equations of the other 46 of 50 elements are left out here." in page
    assert "5.0" not in "".join(parsed(page).itertext())


def test_functions_and_what_cannot_be_expanded() -> None:
    gradient = ca.interpolant("gradient", "linear", [[0.0, 1.0, 2.0]], [0.0, 1.0, 4.0])
    with Plant("calls") as plant:
        x = plant.state("x", unit="1", size=8, output=True)
        matrix = plant.parameter("matrix", [2.0, 1.0, 1.0, 3.0], unit="1", size=4)
        pairs = ca.MX.sym("q")
        f = ca.Function("f", [pairs], [gradient(pairs) - pairs]).map(8)
        plant.der(x, f(x.T).T)
        plant.output("solved", ca.solve(ca.reshape(matrix, 2, 2), x[:2]), unit="1")
        deep = x[0]
        for k in range(300):
            deep = ca.sin(deep) + x[k % 8]
        plant.output("deep", deep, unit="1")
        crossing = ca.solve(ca.reshape(matrix, 2, 2), x[:2])[0]
        plant.event("cross", crossing, direction="rising", changes={x: 0})
    page = parsed(documentation_page(plant))
    found = parts(page)
    derivative = "".join(found["States"][1].itertext())
    assert "gradient" in derivative and len(found["States"]) == 2  # one for all elements
    codes = [c.text or "" for part in found["Outputs"] for c in part.iter("code")]
    assert len(codes) == 2 and "reshape(matrix)" in codes[0] and "sin(" in codes[1]
    event = "".join("".join(e.itertext()) for e in found["Events"])
    assert "rises above 0" in event


def test_a_plant_that_is_not_finished() -> None:
    with pytest.raises(DeclarationError, match="not finished"):
        documentation_page(Plant("empty"))


# The page


class Wellformed(HTMLParser):
    """Checks that what is opened is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.attributes += attrs

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag in ("meta", "mspace")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize("plant", EVERY)
def test_the_page_is_well_formed_and_needs_no_network(plant: Callable[[], Plant]) -> None:
    page = documentation_page(plant())
    parser = Wellformed()
    parser.feed(page)
    assert parser.open == []
    assert all((value or "").startswith("#") for name, value in parser.attributes if name == "href")
    assert not {"src", "onload", "action"} & {name for name, _ in parser.attributes}
    assert "<script" not in page and "http" not in page and "@import" not in page
    assert parsed(page).get("lang") == "en"


@pytest.mark.parametrize("plant", EVERY)
def test_everything_declared_appears(plant: Callable[[], Plant]) -> None:
    made = plant()
    page = parsed(documentation_page(made, tool="railcosim 9", guid="{1-2}"))
    said = " ".join(" ".join(page.itertext()).split())
    assert page.findtext("head/title") == made.name
    assert made.description in said and "railcosim 9" in said and "{1-2}" in said
    cells = {cell.text for cell in page.iter("code")}
    for v in made.variables():
        assert {v.element_names[0], v.element_names[-1], v.unit} <= cells
        assert v.description in said
    assert {e.name for e in made.events} <= cells
    assert all(e.description in said for e in made.events)
    assert {f"solver.{name}" for name in made.solver.settings} <= cells
    assert type(made.solver).__name__ in cells
    assert f"from 0 to {number(made.stop)} s in steps of {number(made.step)} s" in said


def table(page: str, heading: str) -> list[dict[str, str]]:
    """Return a table's rows by its columns' headings."""
    section = parsed(page).find(".//section[@id='variables']")
    elements = list(section if section is not None else ())
    titles = [e.text for e in elements]
    found = next(e for e in elements[titles.index(heading) :] if e.get("class") == "table")
    heads = ["".join(e.itertext()) for e in found.iter("th")]
    rows = [["".join(cell.itertext()) for cell in row.iter("td")] for row in found.iter("tr")]
    return [dict(zip(heads, row, strict=True)) for row in rows if row]


def test_tables() -> None:
    page = documentation_page(bouncing())
    restitution = table(page, "Parameters")[1]
    assert restitution["start"] == "0.8" and restitution["max"] == "1"
    assert restitution["variability"] == "tunable"
    assert table(page, "Inputs")[0]["min"] == "-100000"
    assert [row["also"] for row in table(page, "States")] == ["output", ""]
    kinds = {row["name"]: row["kind"] for row in table(page, "Outputs")}
    assert kinds == {
        "x": "state", "count": "mode", "peak": "memory", "energy": "computed",
        "moving": "computed",
    }  # fmt: skip
    vectors = documentation_page(long_train(40))
    masses = table(vectors, "Parameters")[0]
    assert masses["name"] == "m[1] … m[40]" and masses["start"] == "80000 … 80039"
    assert "vehicle[40].braking" in table(vectors, "Modes")[0]["name"]
    assert table(documentation_page(plants.everything()), "States")[0]["start"] == "1, -1"


def test_text_is_escaped() -> None:
    with Plant("escaped", description='a < b & "c" <script>alert(1)</script>\x00') as plant:
        x = plant.state("x", unit="1", output=True, description="</td> & <i>")
        plant.der(x, 1.0)
        plant.event("e", x, direction="both", changes={x: 0}, description="x < 0 & so on")
    page = documentation_page(plant, tool='<tool> & "co"')
    said = "".join(parsed(page).itertext())
    for part in ('a < b & "c" <script>alert(1)</script>', "</td> & <i>", "x < 0 & so on", "<tool>"):
        assert part in said
    assert "<script>" not in page


def test_settings_and_choices_of_solvers() -> None:
    page = documentation_page(second_order_train(), solver=Rodas(relative_tolerance=1e-5))
    assert "solver.relative_tolerance" in page and "1e-5" in page and "L-stable" in page
    assert "<code>positions</code>: <code>x</code>" in documentation_page(long_train(3))


def test_the_same_plant_gives_the_same_page() -> None:
    for plant in EVERY:
        assert documentation_page(plant()) == documentation_page(plant())


def test_the_caller_s_way_of_tracing_is_left_alone() -> None:
    ca.GlobalOptions.setSimplificationOnTheFly(True)
    documentation_page(second_order_train())
    assert ca.GlobalOptions.getSimplificationOnTheFly()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.1, "0.1"), (-0.0, "0"), (2.0, "2"), (1e-6, "1e-6"), (1500000.0, "1500000"),
        (2.1e11, "2.1e11"), (1e22, "1e22"), (-8e7, "-8e7"), (12345678.0, "12345678"),
    ],
)  # fmt: skip
def test_numbers(value: float, expected: str) -> None:
    assert number(value) == expected and float(expected) == value


def test_the_icon_is_a_small_png() -> None:
    data = resources.files("railcosim.fmus").joinpath("icon.png").read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n") and len(data) < 4096
