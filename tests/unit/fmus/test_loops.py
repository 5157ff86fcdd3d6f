"""Plants in loops: the FMU's values against CasADi's own evaluation, bit for bit."""

import math
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from railcosim.fmus import build
from railcosim.fmus.functions import Functions
from railcosim.fmus.layout import Layout
from railcosim.models import Plant
from railcosim.models.expressions import exact_expressions
from tests.instances import FMU2Named

N = 7


def vectors(name: str, outputs: Callable[..., list[ca.MX]], n: int = N) -> Plant:
    """Return a plant with outputs of two vector states, a scalar one, parameters and an input."""
    with Plant(name) as plant:
        x = plant.state("x", unit="1", size=n, start=[0.3 * i - 0.7 for i in range(n)])
        y = plant.state("y[].z", unit="1", size=n, start=[math.sin(i + 1) for i in range(n)])
        s = plant.state("s", unit="1", start=0.37)
        p = plant.parameter("p", [1.0 + 0.1 * i for i in range(n - 1)], unit="1", size=n - 1)
        q = plant.parameter("q", -1.25, unit="1")
        u = plant.input("u", unit="1", start=0.5)
        for i, value in enumerate(outputs(x, y, s, p, q, u)):
            plant.output(f"out{i}", ca.vec(value), unit="1")
        plant.der(x, y * s)
        plant.der(y, u - x)
        plant.der(s, q)
    return plant


def check(plant: Plant, folder: Path, *, left: int = 0) -> None:
    """Check outputs and their directional derivatives; `left` functions are left to CasADi."""
    functions = Functions(Layout(plant))
    assert len(functions.evaluation.called) == left
    layout = functions.layout
    slave = FMU2Named(build(plant), folder)
    slave.initialize()
    given = [s for v in functions.arguments for s in layout.scalars_of(v.name)]
    values = slave.getReal([s.reference for s in given])
    got = slave.getReal([s.reference for s in layout.outputs])
    point = [0.0, *split(values, functions)]
    expected = np.array(functions.outputs(*point)).ravel()
    np.testing.assert_array_equal(got, expected)
    known = [s for s in given if s.variable.kind in ("state", "input", "parameter")]
    seeds = [math.cos(3.0 * k) for k in range(len(known))]
    tangent = slave.getDirectionalDerivative(
        [s.reference for s in layout.outputs], [s.reference for s in known], seeds
    )
    with exact_expressions():
        forward = functions.outputs.forward(1)
    expected = forward(*point, ca.DM(len(got), 1), 0.0, *split(seeds, functions))
    np.testing.assert_array_equal(tangent, np.array(expected).ravel())
    slave.freeInstance()


def split(values: Any, functions: Functions) -> list[Any]:
    ends = np.cumsum([v.length for v in functions.arguments])
    return list(np.split(np.array(values), ends[:-1]))


def operations(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
    half, positive = 0.5 * ca.sin(x), ca.fabs(y) + 0.1
    one = [
        ca.exp, ca.sin, ca.cos, ca.tan, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.floor,
        ca.ceil, ca.fabs, ca.sign, ca.erf, ca.expm1, ca.logic_not, lambda a: -a, lambda a: a * a,
        lambda a: 2.0 * a, lambda a: 1.0 / a,
    ]  # fmt: skip
    bounded = [ca.asin, ca.acos, ca.atanh, ca.log1p]
    two = [
        ca.fmin, ca.fmax, ca.fmod, ca.remainder, ca.atan2, ca.hypot, ca.copysign, ca.logic_and,
        ca.logic_or, lambda a, b: a < b, lambda a, b: a <= b, lambda a, b: a == b,
        lambda a, b: a != b, lambda a, b: a / b, lambda a, b: ca.if_else(a > b, a, -1.0 - b),
    ]  # fmt: skip
    return [
        *(f(x) for f in one),
        *(f(half) for f in bounded),
        *(f(x, y) for f in two),
        *(f(s, y) for f in two),
        ca.log(positive), ca.sqrt(positive), ca.acosh(1.0 + positive), positive**y, positive**2.5,
        x**3, x - -1.0, ca.fmax(x, -ca.inf), ca.MX(2.5),
    ]  # fmt: skip


def moves(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
    table = ca.reshape(ca.vertcat(x, y[:5]), 4, 3)
    changed = ca.MX(x)
    changed[2:4] = s * p[1:3]
    triangle = ca.MX(ca.DM([[1.0, 0.0], [2.0, 3.0]]).sparsity(), 1.5)
    return [
        x[::-1] * y, x[::2] + y[1:5], table[1, :].T, table.T, ca.horzcat(table, table[:, 1] * s),
        ca.vertcat(table, table[2, :]), ca.repmat(s * s, 3, 2), ca.repmat(x[:2] + y[:2], 2, 3),
        changed, ca.vertcat(u, p[1:] * s, 0.0, x[3], q), *ca.vertsplit(x * q, [0, 2, 7]),
        *ca.horzsplit(table * 2.0), ca.densify(triangle * s), x + ca.DM(range(N)),
        ca.vertcat(x, y)[[3, 3, 9, 0, 13, 12]] * 2.0, ca.diff(x), ca.MX.zeros(3),
    ]  # fmt: skip


def maps(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
    a, b = ca.SX.sym("a"), ca.SX.sym("b", 2)
    scalar = ca.Function("scalar", [a, b], [a * b[0] - b[1], 3.0])
    pair = ca.Function("pair", [b, a], [ca.vertcat(b[0] * a, b[1] - b[0]), a * a])
    m, n = ca.MX.sym("m", N), ca.MX.sym("n")
    nested = ca.Function("nested", [m, n], [scalar.map(N)(m, ca.vertcat(n, 2.0))[0].T * n])
    columns = ca.reshape(ca.vertcat(x, y), 2, N)
    shared = scalar.map(N, [False, True], [False, False])
    summed = pair.map(N, [False, False], [True, False])
    return [
        *scalar.map(N)(x.T, columns), *pair.map(N)(columns, y.T), *shared(y.T, ca.vertcat(s, q)),
        *summed(columns, x.T), nested(y, u), nested(x, s), *scalar(s, y[2:4]),
        scalar.map("three", "serial", 3, [1], [])(x[:3].T, y[:2])[0],
    ]  # fmt: skip


def sums(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
    table = ca.reshape(ca.vertcat(x, y[:5]), 4, 3)
    total = ca.sum1(x * y)
    return [
        ca.dot(x, y), ca.mmax(x * s), ca.mmin(y), ca.norm_1(x), ca.norm_2(x), ca.norm_inf(x - y),
        ca.norm_fro(table), ca.sumsqr(y), total, x / total, ca.mtimes(table, x[:3]),
        ca.mtimes(table.T, table), ca.sum2(table), ca.sum1(p) * q,
    ]  # fmt: skip


@pytest.mark.parametrize("outputs", [operations, moves, maps, sums])
def test_as_casadi_evaluates(outputs: Callable[..., list[ca.MX]], tmp_path: Path) -> None:
    check(vectors(outputs.__name__, outputs), tmp_path)


@pytest.mark.parametrize("seed", range(16))
def test_random_neighbours(seed: int, tmp_path: Path) -> None:
    """Vectors of n and n − 1 elements that read each other's neighbours, as in a chain."""
    draw, n = random.Random(seed), 2 + seed % 5

    def outputs(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
        scalars, longer, shorter = [s, q, u, ca.MX(0.0)], [x, y], [p]
        a, b = ca.SX.sym("a"), ca.SX.sym("b")
        f = ca.Function("f", [a, b], [a * b - a, b * b])
        moves = [
            lambda: shorter.append(draw.choice(longer)[: n - 1]),
            lambda: shorter.append(draw.choice(longer)[1:]),
            lambda: longer.append(ca.vertcat(draw.choice(scalars), draw.choice(shorter))),
            lambda: longer.append(ca.vertcat(draw.choice(shorter), draw.choice(scalars))),
            lambda: longer.append(draw.choice(longer) * draw.choice(longer)),
            lambda: longer.append(draw.choice(longer) - draw.choice(scalars)),
            lambda: shorter.append(draw.choice(shorter) - draw.choice(shorter)),
            lambda: shorter.append(draw.choice(shorter) * draw.choice(scalars)),
            lambda: shorter.append(
                f.map(n - 1)(draw.choice(shorter).T, draw.choice(scalars))[draw.randrange(2)].T
            ),
            lambda: longer.append(draw.choice(longer)[::-1]),
            lambda: scalars.append(ca.dot(draw.choice(longer), draw.choice(longer))),
            lambda: scalars.append(draw.choice(longer)[draw.randrange(n)]),
        ]
        weights = [3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1]
        for move in draw.choices(moves, weights, k=30):
            move()
        return draw.sample([*scalars, *longer, *shorter], 8)

    check(vectors(f"random{seed}", outputs, n), tmp_path)


def test_a_chain_is_two_loops() -> None:
    """Couplers, then vehicles: no turn waits for the one before."""

    def outputs(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
        force = p * (x[:-1] - x[1:])
        return [ca.vertcat(u, force) - ca.vertcat(force, 0.0)]

    text = Functions(Layout(vectors("two_loops", outputs))).evaluation.text
    start = text.index("void plant_outputs(")
    body = text[start : text.index("\n}\n", start)]
    assert body.count("for (") == 2
    assert body.index("w[i] = ") < body.index("- w[i]")


def test_what_loops_cannot_express_is_casadis(tmp_path: Path) -> None:
    def outputs(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
        curve = ca.interpolant("curve", "linear", [[-1.0, 0.0, 1.0]], [2.0, 0.5, 1.0])
        return [curve(s), x * curve(q), ca.solve(ca.reshape(y[:4], 2, 2), x[:2])]

    check(vectors("left", outputs), tmp_path, left=2)


def test_a_sum_over_calls_that_share_all_inputs(tmp_path: Path) -> None:
    """How often, no size tells."""
    a = ca.SX.sym("a")
    f = ca.Function("f", [a], [a * a])

    def outputs(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
        return [f.map(3, [True], [True])(s)]

    check(vectors("shared", outputs), tmp_path, left=2)


def test_a_nan_inside_a_function(tmp_path: Path) -> None:
    a = ca.SX.sym("a")
    f = ca.Function("f", [a], [ca.if_else(a > 0.0, a, math.nan)])

    def outputs(x: Any, y: Any, s: Any, p: Any, q: Any, u: Any) -> list[ca.MX]:
        return [f(s)]

    check(vectors("undefined_below", outputs), tmp_path)
