import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest

from railcosim.base.errors import DeclarationError, UnitError
from railcosim.models import Plant
from railcosim.models.dae_builder import plant_of
from railcosim.models.expressions import exact_expressions
from railcosim.models.solver import DormandPrince, RungeKutta4
from railcosim.models.variable import Variable
from tests.daes import ALL, ball, chain, damper, thermostat

Make = Callable[[], ca.DaeBuilder]


def variable(plant: Plant, name: str) -> Variable:
    return next(v for v in plant.variables() if v.name == name)


def evaluator(plant: Plant, expressions: list[ca.MX]) -> Callable[..., list[np.ndarray]]:
    """Return a function of time and values by name; dependents follow from the parameters."""
    dependents = plant.variables("dependent")
    exact = ca.substitute(
        [ca.MX(e) for e in expressions],
        [v.symbol for v in dependents],
        [plant.dependents[v.name] for v in dependents],
    )
    given = [v for v in plant.variables() if v.kind not in ("dependent", "output")]
    function = ca.Function("f", [plant.time, *(v.symbol for v in given)], exact)

    def evaluate(time: float, values: dict[str, np.ndarray]) -> list[np.ndarray]:
        at = [values.get(v.name, np.array(v.start)) for v in given]
        return [np.array(r).ravel() for r in function.call([time, *at])]

    return evaluate


def everything(plant: Plant) -> tuple[list[str], list[ca.MX]]:
    names = [*plant.derivatives, *plant.outputs]
    return names, [*plant.derivatives.values(), *plant.outputs.values()]


def drawn(plant: Plant, random: np.random.Generator) -> dict[str, np.ndarray]:
    given = plant.variables("input", "parameter", "state", "mode", "memory")
    return {v.name: random.uniform(0.1, 3.0, v.length) for v in given}


def own(dae: ca.DaeBuilder, time: float, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what CasADi's own function gives for der(x), der(q) and y."""
    for name in dae.c():  # before the first create(), which keeps them
        if name in values:
            dae.set([name], list(values[name]))
    inputs = ["t", "x", "q", "u", "p", "d", "z"]
    results = ["alg", "ode", "quad", "y"]
    function = dae.create("f", inputs, results)
    slope = dae.create("g", inputs, ["jac_alg_z"])
    dependents = dae.dependent_fun("d", ["p"], ["d"]) if dae.d() else None
    sides = [
        np.concatenate([values[n] for n in of()] or [np.zeros(0)])
        for of in (dae.x, dae.q, dae.u, dae.p)
    ]
    d = dependents(sides[-1]) if dependents else []
    z = np.zeros(sum(dae.numel(n) for n in dae.z()))
    given = [time if dae.has_t() else ca.DM(0, 1), *sides, d]
    if len(z):  # linear: one step of Newton's method is exact
        z = ca.solve(slope(*given, z), -function(*given, z)[0])
    labels = (
        [("", n) for n in dae.z()],
        [("der", n) for n in dae.x()],
        [("der", n) for n in dae.q()],
    )
    found = {}
    for result, entries in zip(
        function.call([*given, z]), [*labels, [("", n) for n in dae.y()]], strict=True
    ):
        flat, at = np.array(result).ravel(), 0
        for label, name in entries:
            found[f"{label}({name})" if label else name] = flat[at : at + dae.numel(name)]
            at += dae.numel(name)
    for name in dae.z():
        np.testing.assert_allclose(found.pop(name), 0.0, atol=1e-12)
    return found


@pytest.mark.parametrize("make", ALL)
def test_a_plant_computes_what_casadi_computes(make: Make) -> None:
    dae = make()
    plant = plant_of(dae)
    names, expressions = everything(plant)
    evaluate = evaluator(plant, expressions)
    exposed = [v.name for v in plant.variables() if v.exposed]
    assert {*exposed, *plant.outputs} == set(dae.y())
    random = np.random.default_rng(7)
    for _ in range(20):
        time, values = float(random.uniform(0.0, 9.0)), drawn(plant, random)
        reference = own(make(), time, values)
        for name, value in zip(names, evaluate(time, values), strict=True):
            key = f"der({name})" if name in plant.derivatives else name
            np.testing.assert_allclose(value, reference[key], rtol=1e-12, atol=1e-12)
        for name in exposed:
            np.testing.assert_array_equal(values[name], reference[name])


def test_the_damper_computes_what_its_equations_say() -> None:
    plant = plant_of(damper())
    evaluate = evaluator(plant, everything(plant)[1])
    assert everything(plant)[0] == ["position", "speed", "pull", "energy"]
    random = np.random.default_rng(3)
    for _ in range(20):
        values = drawn(plant, random)
        f, m, k, c, s, v = (
            values[n][0] for n in ("force", "mass", "stiffness", "damping", "position", "speed")
        )
        pull = k * s + c * v
        right = [v, (f - pull) / m, pull, 0.5 * (m * v * v + k * s * s)]
        np.testing.assert_allclose(np.ravel(evaluate(0.0, values)), right, rtol=1e-13)


def test_declarations_are_carried_over() -> None:
    plant = plant_of(damper())
    assert (plant.name, plant.stop, plant.step) == ("damper", 4.0, 0.02)
    assert [(v.name, v.kind, v.variability) for v in plant.variables()] == [
        ("force", "input", "continuous"),
        ("mass", "parameter", "fixed"),
        ("stiffness", "parameter", "tunable"),
        ("damping", "parameter", "tunable"),
        ("position", "state", "continuous"),
        ("speed", "state", "continuous"),
        ("pull", "output", "continuous"),
        ("energy", "output", "continuous"),
    ]
    force, mass, pull = (variable(plant, name) for name in ("force", "mass", "pull"))
    assert (force.unit, force.start, force.minimum, force.maximum) == ("N", (1,), (-50,), (50,))
    assert (mass.unit, mass.start, mass.minimum, mass.maximum) == ("kg", (2.0,), (0.1,), None)
    assert (pull.unit, pull.minimum, pull.nominal) == ("N", (-100.0,), None)
    position, speed = variable(plant, "position"), variable(plant, "speed")
    assert (position.description, position.nominal, position.exposed) == ("from rest", (2,), True)
    assert not speed.exposed
    assert variable(plant_of(ball()), "restitution").unit == "1"


def test_the_order_of_equations_does_not_matter() -> None:
    """CasADi's own functions take an undefined w for 0 here: casadi/casadi issue 4096."""
    dae = ca.DaeBuilder("unordered")
    k = dae.add("k", "parameter", "tunable", {"start": 3.0})
    twice = dae.add("twice", "calculatedParameter", "tunable")
    thrice = dae.add("thrice", "calculatedParameter", "tunable")
    x, w1, w2 = dae.add("x", {"start": 2.0}), dae.add("w1"), dae.add("w2", "output")
    for left, right in ((thrice, twice + k), (twice, 2 * k)):
        with suppress(RuntimeError):  # CasADi takes the equation, and then complains
            dae.eq(left, right)
    dae.eq(dae.der(x), -w2)
    dae.eq(w2, w1**2)
    dae.eq(w1, thrice * x)
    plant = plant_of(dae)
    assert [v.name for v in plant.variables("dependent")] == ["twice", "thrice"]
    np.testing.assert_allclose(
        np.ravel(evaluator(plant, everything(plant)[1])(0.0, {})), [-(18.0**2), 18.0**2]
    )


def test_vectors_dependents_and_quadratures() -> None:
    plant = plant_of(chain())
    assert variable(plant, "v").element_names == ("v[1]", "v[2]", "v[3]")
    assert variable(plant, "u").start == (1.0, 2.0, 3.0)
    assert variable(plant, "jerk").size == 3
    assert [(v.name, v.variability) for v in plant.variables("dependent")] == [
        ("twice", "tunable"),
        ("thrice", "tunable"),
    ]
    assert [v.name for v in plant.variables("state")] == ["v", "work"]


def test_a_bouncing_ball() -> None:
    plant = plant_of(ball())
    (event,) = plant.events
    assert (event.kind, event.direction, event.name) == ("state", "falling", "when_1")
    assert variable(plant, "bounces").kind == "mode"
    evaluate = evaluator(plant, [event.expression, *event.changes.values()])
    values = {"height": np.array([0.25]), "speed": np.array([-3.0]), "bounces": np.array([4.0])}
    assert list(event.changes) == ["speed", "bounces"]
    np.testing.assert_allclose(np.ravel(evaluate(0.0, values)), [0.25, 2.4, 5.0])


def test_discrete_variables_and_time_events() -> None:
    plant = plant_of(thermostat())
    heating, tick = variable(plant, "heating"), variable(plant, "tick")
    assert (heating.kind, heating.minimum, heating.maximum) == ("mode", (0.0,), (1.0,))
    assert (heating.start, heating.exposed) == ((1.0,), True)
    assert (tick.kind, tick.unit, tick.start, tick.exposed) == ("memory", "s", (10.0,), False)
    assert list(plant.derivatives) == ["warmth"]
    assert [(e.kind, list(e.changes)) for e in plant.events] == [
        ("state", ["heating"]),
        ("state", ["heating"]),
        ("time", ["tick", "seen"]),
    ]
    assert str(plant.events[2].expression) == "tick"


@pytest.mark.parametrize("make", [ball, thermostat])
def test_events_change_what_casadi_changes(make: Make) -> None:
    dae = make()
    plant = plant_of(dae)
    states = plant.variables("state", "mode", "memory")
    random = np.random.default_rng(5)
    for i, event in enumerate(plant.events):
        own_change = dae.transition(f"t{i}", i)
        after = [event.changes.get(v.name, v.symbol) for v in states]
        evaluate = evaluator(plant, after)
        for _ in range(5):
            values = drawn(plant, random)
            x = np.concatenate([values[n] for n in dae.x()])
            p = np.concatenate([values[n] for n in dae.p()] or [np.zeros(0)])
            time = 1.0 if dae.has_t() else ca.DM(0, 1)
            wanted = np.array(own_change(time, x, [], p, [])[0]).ravel()
            ours = dict(zip([v.name for v in states], evaluate(1.0, values), strict=True))
            np.testing.assert_allclose(
                np.concatenate([ours[n] for n in dae.x()]), wanted, rtol=1e-14
            )


def snapshot(dae: ca.DaeBuilder) -> list[object]:
    """Everything that can be read of a DaeBuilder; variables by identity."""
    names = dae.all()
    expressions = [str(e) for c in ("ode", "alg", "wdef", "y") for e in dae.outputs(c)]
    found = [dae.str(True), names, expressions]
    for name in names:
        reads = (dae.category, dae.causality, dae.variability, dae.unit, dae.start, dae.type)
        found.append((name, *(read(name) for read in reads)))
        found.append((dae.var(name).__hash__(), repr(dae.attribute("value", [name]))))
    return found


@pytest.mark.parametrize("make", ALL)
def test_the_dae_builder_is_not_changed(make: Make) -> None:
    dae = make()
    before = snapshot(dae)
    first = plant_of(dae)
    assert snapshot(dae) == before
    assert ca.GlobalOptions.getSimplificationOnTheFly()
    assert repr(plant_of(dae)) == repr(first)


def test_equations_are_kept_as_written() -> None:
    dae = ca.DaeBuilder("written")
    with exact_expressions():
        u, w, y = dae.add("u", "input"), dae.add("w"), dae.add("y", "output")
        dae.eq(w, (u / 3.0) * 3.0)
        dae.eq(y, w + 0.0 * u)
    assert str(plant_of(dae).outputs["y"]) == "(((u/3)*3)+(0*u))"


def test_without_outputs_every_state_is_one() -> None:
    dae = ca.DaeBuilder("rocket")
    h, v = dae.add("h", {"unit": "m"}), dae.add("v", {"unit": "m/s"})
    dae.eq(dae.der(h), v)
    dae.eq(dae.der(v), -9.81)
    assert all(variable(plant_of(dae), name).exposed for name in ("h", "v"))


def test_constants_take_their_value_as_casadi_does() -> None:
    dae = model()
    g = dae.add("g", "parameter", "fixed", {"start": 9.0})
    height = dae.add("height", "output", "constant")
    dae.set("g", 9.81)
    dae.set("height", 2.5)
    dae.eq(dae.add("y", "output"), g * height)
    plant = plant_of(dae)
    assert variable(plant, "g").start == (9.81,)
    assert float(ca.evalf(plant.outputs["height"])) == 2.5
    assert str(plant.outputs["y"]) == "(g*2.5)"


def test_an_initial_equation_in_constants_is_a_start_value() -> None:
    dae = model()
    c = dae.add("c", "local", "constant", {"start": 3.0})
    dae.set_init("x", 2.0 * c)
    assert variable(plant_of(dae), "x").start == (6.0,)


def test_solvers() -> None:
    dae = model()
    assert isinstance(plant_of(dae).solver, RungeKutta4)
    dae.set_tolerance(1e-8)
    assert plant_of(dae).solver == DormandPrince(relative_tolerance=1e-8)
    assert isinstance(plant_of(dae, solver=RungeKutta4()).solver, RungeKutta4)


def test_an_output_may_be_a_dependent_parameter_or_eliminated() -> None:
    dae = chain()
    dae.set_causality("power", "local")
    dae.eliminate("w")
    dae.set_causality("power", "output")
    plant = plant_of(dae)
    assert "power" in plant.outputs
    assert "drag" not in [v.name for v in plant.variables()]


def test_assignments_that_print_alike_are_told_apart() -> None:
    dae = model()
    n = dae.add("n", "output", "discrete")
    x = dae.var("x")
    dae.when(x > 2, [dae.assign("n", n + 1.00000001)])
    dae.when(x > 3, [dae.assign("n", n + 1.00000002)])
    shared = dae.assign("n", n + 5)
    dae.when(x > 4, [shared])
    dae.when(x > 5, [shared, dae.reinit("x", ca.sum1(ca.DM([[1, 2], [3, 4]]) @ ca.vertcat(x, n)))])
    plant = plant_of(dae)
    one = {"n": np.array([0.0]), "x": np.array([1.0])}
    steps = [evaluator(plant, [e.changes["n"]])(0.0, one)[0][0] for e in plant.events]
    assert steps == [1.00000001, 1.00000002, 5.0, 5.0]
    assert evaluator(plant, [plant.events[3].changes["x"]])(0.0, one)[0][0] == 4.0


def test_the_time_need_not_be_declared() -> None:
    dae = model()
    dae.eq(dae.add("y", "output"), 2.0 * dae.var("time"))
    plant = plant_of(dae)
    assert evaluator(plant, [plant.outputs["y"]])(3.0, {})[0][0] == 6.0


def test_explicit_algebraic_equations_are_solved() -> None:
    dae = model()
    z = [dae.add(f"z{i}") for i in range(3)]
    x, y = dae.var("x"), dae.add("y", "output")
    dae.eq(0, z[0] - z[1] + x)  # for z0 or z1: what comes after tells which
    dae.eq(0, z[1] - z[2])
    dae.eq(2 * x, z[0])
    dae.eq(y, z[2])
    plant = plant_of(dae)
    assert evaluator(plant, [plant.outputs["y"]])(0.0, {})[0][0] == 3.0


def test_categories_that_casadi_changes() -> None:
    dae = ca.DaeBuilder("m", "", {"detect_quad": True})
    n, work, clock = dae.add("n", "output", "discrete"), dae.add("work"), dae.add("clock")
    x = dae.add("x", "output", {"start": 1.0})
    dae.eq(dae.der(x), -x * ca.cos(clock))
    dae.eq(dae.der(work), x)
    dae.eq(dae.der(clock), 1.0)
    dae.when(x > 2, [dae.assign("n", n + 1)])
    dae.set_category("clock", "t")
    plant = plant_of(dae)
    assert [(v.name, v.kind) for v in plant.variables()] == [
        ("x", "state"),
        ("n", "memory"),
        ("work", "state"),
    ]
    rate = evaluator(plant, [plant.derivatives["x"]])(2.0, {"x": np.array([3.0])})[0][0]
    assert rate == pytest.approx(-3.0 * math.cos(2.0))


# Refusals


def model() -> ca.DaeBuilder:
    """x' = -x, from 1."""
    dae = ca.DaeBuilder("m")
    x = dae.add("x", "output", {"start": 1.0})
    dae.eq(dae.der(x), -x)
    return dae


def _implicit(dae: ca.DaeBuilder) -> None:
    z = dae.add("z")
    dae.eq(0, z**3 + z - dae.var("x"))


def _linear(dae: ca.DaeBuilder) -> None:
    z1, z2 = dae.add("z1"), dae.add("z2")
    dae.eq(0, z1 - ca.sin(z2))
    dae.eq(0, z2 - ca.cos(z1))


def _hidden(dae: ca.DaeBuilder) -> None:
    z, w = dae.add("z"), dae.add("w")
    dae.eq(w, z**2)
    dae.eq(0, w - dae.var("x"))


def _overdetermined(dae: ca.DaeBuilder) -> None:
    dae.eq(0, 2 * dae.var("x") - 1)


def _loop(dae: ca.DaeBuilder) -> None:
    a, b = dae.add("a"), dae.add("b", "output")
    dae.eq(a, 2 * b)
    dae.eq(b, a + 1)


def _undefined_rate(dae: ca.DaeBuilder) -> None:
    dae.der(dae.add("v"))


def _left_out(dae: ca.DaeBuilder) -> None:
    q = dae.add("q", "output")
    dae.eq(dae.der(q), dae.var("x"))
    dae.set_category("q", "")


def _rate_output(dae: ca.DaeBuilder) -> None:
    dae.set_causality("der(x)", "output")


def _dependent_of_state(dae: ca.DaeBuilder) -> None:
    d = dae.add("d", "calculatedParameter", "fixed")
    with pytest.raises(RuntimeError):
        dae.eq(d, 2 * dae.var("x"))


def _initial_parameter(dae: ca.DaeBuilder) -> None:
    p = dae.add("p", "parameter", "tunable", {"start": 1.0})
    dae.set_init("x", 2 * p)


def _initial_output(dae: ca.DaeBuilder) -> None:
    y = dae.add("y", "output")
    dae.eq(y, dae.var("x"))
    dae.set_init("y", ca.MX(1.0))


def _start_and_value(dae: ca.DaeBuilder) -> None:
    dae.set("x", 4.0)


def _whole_state(dae: ca.DaeBuilder) -> None:
    n = dae.add("n", "local", "continuous", {"type": "Int32"})
    dae.eq(dae.der(n), 1)


def _whole_output(dae: ca.DaeBuilder) -> None:
    n = dae.add("n", "output", "continuous", {"type": "Int32"})
    dae.eq(n, 2 * dae.var("x"))


def _matrix_output(dae: ca.DaeBuilder) -> None:
    dae.eq(dae.add("y", "output", {"dimension": [2, 2]}), ca.MX.ones(4))


def _assigned(kind: str) -> Callable[[ca.DaeBuilder], None]:
    def change(dae: ca.DaeBuilder) -> None:
        words: Any = kind.split()
        a = dae.add("a", *words)
        if kind == "output":
            dae.eq(a, 2 * dae.var("x"))
        dae.when(dae.var("x") < 0.5, [dae.assign("a", ca.MX(1.0))])

    return change


def _twice(dae: ca.DaeBuilder) -> None:
    dae.when(dae.var("x") < 0.5, [dae.reinit("x", ca.MX(1)), dae.reinit("x", ca.MX(2))])


def _vector_condition(dae: ca.DaeBuilder) -> None:
    v = dae.add("v", "local", "discrete", {"dimension": [2]})
    dae.when(v > 1, [dae.assign("v", ca.MX.zeros(2))])


def _holds(dae: ca.DaeBuilder) -> None:
    dae.when(dae.var("x") > 0.5, [dae.reinit("x", ca.MX(0))])


def _past(dae: ca.DaeBuilder) -> None:
    dae.when(dae.var("time") > -1.0, [dae.reinit("x", ca.MX(0))])


def _ambiguous(dae: ca.DaeBuilder) -> None:
    first = dae.reinit("x", dae.var("x") + 1.00000001)
    second = dae.reinit("x", dae.var("x") + 1.00000002)
    dae.when(dae.var("x") > 2, [first])
    dae.when(dae.var("x") > 3, [second])


def _not_a_number(dae: ca.DaeBuilder) -> None:
    dae.eq(dae.add("y", "output"), math.nan * dae.var("x"))


def _foreign(dae: ca.DaeBuilder) -> None:
    dae.when(ca.MX.sym("speed") < 0, [dae.reinit("x", ca.MX(0))])


def added(*arguments: Any) -> Callable[[ca.DaeBuilder], None]:
    def change(dae: ca.DaeBuilder) -> None:
        dae.add(*arguments)

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        # Names, shapes, types
        (added("a[1]", "input"), r"'a\[1\]'.*structured names.*dimension=\[n\]"),
        (added("2nd", "input"), "'2nd'.*structured names.*call it '_2nd'"),
        (added("a b", "input"), "'a b'.*structured names.*call it 'a_b'"),
        (added("solver.x", "input"), "'solver.x'.*the solver's; call it 'solver_x'"),
        (added("a[]", "input"), r"'a\[\]'.*index"),
        (_rate_output, r"'der\(x\)'.*an output with a name of its own"),
        (added("m", "input", {"dimension": [2, 3]}), "'m' is a matrix .2 × 3."),
        (_matrix_output, "'y' is a matrix"),
        (added("s", "parameter", {"type": "String"}), "'s' is of type String"),
        (added("n", "parameter", {"type": "Int32", "start": 2}), "'n' is of type Int32.*Float64"),
        (added("b", "input", {"type": "Boolean"}), "'b' is of type Boolean.*inputs are real"),
        (added("e", {"type": "Enumeration"}), "'e' is of type Enumeration"),
        (added("n", {"type": "Int32", "unit": "m"}), "'n' is of type Int32 with unit 'm'"),
        (added("n", {"type": "Int32", "start": 0.5}), "mode 'n': modes are integers"),
        (_whole_state, "'n' is of type Int32.*derivative"),
        (_whole_output, "'n' is of type Int32.*outputs are real"),
        # Numbers
        (added("u", "input", {"start": 2, "max": 1}), r"input 'u': start 2 lies outside"),
        (added("u", "input", {"min": 2, "max": 1}), "input 'u': minimum lies above maximum"),
        (added("u", "input", {"nominal": -1}), "input 'u': nominal must be positive"),
        (added("c", "parameter", "fixed"), r"'c' has no value; set it with dae.set\('c', …\)"),
        (_start_and_value, r"'x' has the start \[1.0\].*the value \[4.0\].*set_start"),
        (_not_a_number, "output 'y' holds a NaN"),
        (lambda dae: dae.set_start_time(5.0), "starts at 5 s.*set_start_time"),
        (lambda dae: dae.set_stop_time(-1.0), "stop must be a positive time"),
        # Equations
        (_implicit, "gives z implicitly.*dae.eq.z, …."),
        (_linear, "z[12], z[12] depend on each other, an algebraic loop"),
        (_hidden, "gives z implicitly"),
        (_overdetermined, "0 == .*one too many"),
        (_loop, "depend on each other, an algebraic loop"),
        (added("lost"), r"no equation for 'lost'; write dae.eq\(lost, …\)"),
        (_undefined_rate, r"no equation for 'v'"),
        (added("d", "calculatedParameter", "fixed"), "dependent parameter 'd' has no equation"),
        (_dependent_of_state, "dependent 'd' depends on 'x'; only parameters"),
        (_left_out, "'q' is an output without a category; use dae.set_category"),
        (_initial_parameter, "'x' starts at .*depends on 'p'.*numbers"),
        (_initial_output, "'y' has an initial equation"),
        # Events
        (_assigned("output"), "'a' is assigned by when-equation 1 but is neither"),
        (_assigned("input"), "'a' is assigned by when-equation 1 but is neither"),
        (_assigned("parameter tunable"), "'a' is assigned by when-equation 1 but is neither"),
        (_twice, "when-equation 1 assigns 'x' twice"),
        (_vector_condition, "when-equation 1 .*vector condition"),
        (_holds, "condition of when-equation 1 .*holds at the start already"),
        (_past, "condition of when-equation 1 .*holds at the start already"),
        (_ambiguous, "when-equation 1: cannot tell which of several assignments to 'x'"),
        (_foreign, "uses 'speed', not declared here"),
    ],
)
def test_what_a_plant_cannot_express_is_refused_by_name(
    change: Callable[[ca.DaeBuilder], object], message: str
) -> None:
    dae = model()
    change(dae)
    with pytest.raises(DeclarationError, match=message) as caught:
        plant_of(dae)
    assert "'m'" in str(caught.value)
    assert ca.GlobalOptions.getSimplificationOnTheFly()


def test_an_unknown_unit_is_refused_by_name() -> None:
    dae = model()
    dae.set_unit("x", "m/s^2")
    with pytest.raises(UnitError, match=r"state 'x': unknown unit 's\^' in 'm/s\^2' .*m/s2"):
        plant_of(dae)


def test_what_is_no_model_is_refused() -> None:
    with pytest.raises(DeclarationError, match="takes a casadi.DaeBuilder"):
        plant_of(ca.DaeBuilder())
    with pytest.raises(DeclarationError, match="takes a casadi.DaeBuilder"):
        plant_of(cast(Any, None))
    with pytest.raises(DeclarationError, match="'empty' has neither outputs nor states"):
        plant_of(ca.DaeBuilder("empty"))


def test_an_older_casadi_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    dae = model()
    monkeypatch.delattr(ca.DaeBuilder, "symbolic")
    with pytest.raises(DeclarationError, match="'m': DaeBuilders are read from CasADi 3.8 on"):
        plant_of(dae)


@pytest.mark.parametrize(("name", "remedy"), [("my model", "my_model"), ("a.b", "no dots")])
def test_the_name_must_name_an_fmu(name: str, remedy: str) -> None:
    dae = ca.DaeBuilder(name)
    dae.eq(dae.der(dae.add("x")), 1.0)
    with pytest.raises(DeclarationError, match=f"'{name}'.*{remedy}"):
        plant_of(dae)


def test_a_loaded_fmu_is_refused(tmp_path: Path) -> None:
    (tmp_path / "modelDescription.xml").write_text(
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="1">'
        '<ModelExchange modelIdentifier="m"/>'
        '<ModelVariables><ScalarVariable name="x" valueReference="1"><Real/></ScalarVariable>'
        "</ModelVariables><ModelStructure/></fmiModelDescription>"
    )
    with pytest.raises(DeclarationError, match="was loaded from an FMU"):
        plant_of(ca.DaeBuilder("m", str(tmp_path)))
