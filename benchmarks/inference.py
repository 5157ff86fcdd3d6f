"""Fuzzy inference of a 7×7 base: floats, compiled C and pyfuzzylite, all shapes and defuzzifiers.

All in one run on one machine, so trust the ratios. Processor time, the least of several turns, over
points spread at random. Before any time counts, C and floats must agree to 1e-12. pyfuzzylite
integrates with 100 points, its default, and is no exact inference. Run:
python benchmarks/inference.py
"""

import ctypes
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import casadi as ca
import fuzzylite as fl
import numpy as np

from railcosim.base.compilers import native_compiler
from railcosim.controllers import Gaussians, Mamdani, Triangles
from railcosim.controllers.fuzzy import outline_centroid
from railcosim.controllers.rules import SEVEN, SPEED_RULES
from railcosim.models.expressions import exact_expressions

POINTS, TURNS, PEER_POINTS = 2000, 7, 20
SHAPES: dict[str, tuple[type, type]] = {
    "triangles": (Triangles, Triangles),
    "Gaussians": (Gaussians, Gaussians),
    "triangles → Gaussians": (Triangles, Gaussians),
}
DEFUZZIFIERS = ("centroid", "bisector", "mean_of_maxima", "sampled")
PEERS = {"centroid": fl.Centroid, "bisector": fl.Bisector, "mean_of_maxima": fl.MeanOfMaximum}
LOOP = """
__attribute__((visibility("default")))
void loop(const double *row, const double *column, double *result, long n, long turns) {
  static double w[%d];
  for (long t = 0; t < turns; t++)
    for (long k = 0; k < n; k++) {
      const double *arguments[2] = {row + k, column + k};
      double *results[1] = {result + k};
      inference(arguments, results, 0, w, 0);
    }
}
"""


def base(inputs: Any, output: Any, defuzzify: Any) -> Mamdani:
    """Return the soft-switching paper's table 1 with these shapes."""
    return Mamdani(
        inputs(-3.0, 3.0, SEVEN),
        inputs(-0.6, 0.6, SEVEN),
        output(-10.0, 10.0, SEVEN),
        SPEED_RULES.rules,
        defuzzify,
    )


def points() -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(1)
    return generator.uniform(-3.3, 3.3, POINTS), generator.uniform(-0.66, 0.66, POINTS)


def least(run: Callable[[], Any], count: int, turns: int = TURNS) -> float:
    """Return µs of processor time for each of `count` inferences."""
    found = []
    for _ in range(turns):
        began = process_time()
        run()
        found.append((process_time() - began) / count * 1e6)
    return min(found)


def on_floats(rules: Callable[[float, float], float]) -> float:
    pairs = list(zip(*(values.tolist() for values in points()), strict=True))

    def run() -> None:
        for row, column in pairs:
            rules(row, column)

    return least(run, POINTS)


def in_c(rules: Mamdani, folder: Path) -> float:
    """Return µs of the inference traced, compiled and called in a loop of C."""
    with exact_expressions():
        row, column = ca.SX.sym("row"), ca.SX.sym("column")
        function = ca.Function("inference", [row, column], [rules(row, column)])
        generator = ca.CodeGenerator("inference.c", {"casadi_int": "int", "with_header": False})
        generator.add(function)
        text = generator.dump()
    number = len(list(folder.glob("*.c")))
    source, library = folder / f"inference{number}.c", folder / f"inference{number}.so"
    source.write_text(text + LOOP % max(function.sz_w(), 1))
    native_compiler().shared_library(source, library)
    loop = ctypes.CDLL(str(library)).loop
    pointer = np.ctypeslib.ndpointer(float)
    loop.argtypes = [pointer, pointer, pointer, ctypes.c_long, ctypes.c_long]
    rows, columns = points()
    result = np.zeros(POINTS)
    time = least(lambda: loop(rows, columns, result, POINTS, 10), 10 * POINTS)
    expected = [rules(a, b) for a, b in zip(rows.tolist(), columns.tolist(), strict=True)]
    worst = np.abs(result - expected).max()
    if worst > 1e-12:
        raise SystemExit(f"C and floats differ by {worst}")
    return time


def in_pyfuzzylite(rules: Mamdani) -> float | None:
    """Return µs of pyfuzzylite's engine, or None where it has no such defuzzifier."""
    if rules.defuzzify not in PEERS:
        return None
    engine = peer(rules)
    first, second = engine.input_variables
    generator = random.Random(2)

    def run() -> None:
        for _ in range(PEER_POINTS):
            first.value = generator.uniform(-3.0, 3.0)
            second.value = generator.uniform(-0.6, 0.6)
            engine.process()

    return least(run, PEER_POINTS, turns=2)


def terms(sets: Any) -> list[Any]:
    if isinstance(sets, Gaussians):
        sigma = sets.width / (2.0 * np.sqrt(2.0 * np.log(2.0)))
        return [fl.Gaussian(n, sets.low + k * sets.width, sigma) for k, n in enumerate(sets.labels)]
    peaks = [sets.low + k * sets.width for k in range(len(sets.labels))]
    return [
        fl.Triangle(n, p - sets.width, p, p + sets.width)
        for n, p in zip(sets.labels, peaks, strict=True)
    ]


def peer(rules: Mamdani) -> Any:
    """Return the same base for pyfuzzylite."""
    inputs = [
        fl.InputVariable(name=n, minimum=s.low, maximum=s.high, lock_range=True, terms=terms(s))
        for n, s in (("row", rules.rows), ("column", rules.columns))
    ]
    output = fl.OutputVariable(
        name="out",
        minimum=rules.output.low,
        maximum=rules.output.high,
        aggregation=fl.Maximum(),
        defuzzifier=PEERS[rules.defuzzify](100),
        terms=terms(rules.output),
    )
    block = fl.RuleBlock(
        conjunction=fl.Minimum(), implication=fl.Minimum(), activation=fl.General()
    )
    engine = fl.Engine(input_variables=inputs, output_variables=[output], rule_blocks=[block])
    for a, consequents in zip(rules.rows.labels, rules.rules, strict=True):
        for b, k in zip(rules.columns.labels, consequents, strict=True):
            text = f"if row is {a} and column is {b} then out is {rules.output.labels[k]}"
            block.rules.append(fl.Rule.create(text, engine))
    return engine


def main() -> None:
    head = f"{'inputs → output':<23}{'defuzzifier':<16}"
    print(f"{head}{'floats':>9}{'C':>9}{'pyfuzzylite':>13}{'floats/C':>10}{'peer/floats':>13}")
    with tempfile.TemporaryDirectory() as folder:
        for name, (inputs, output) in SHAPES.items():
            for defuzzify in DEFUZZIFIERS:
                rules = base(inputs, output, defuzzify)
                floats, c, other = (
                    on_floats(rules),
                    in_c(rules, Path(folder)),
                    in_pyfuzzylite(rules),
                )
                line = f"{name:<23}{defuzzify:<16}{floats:>9.2f}{c:>9.3f}"
                line += f"{'–' if other is None else format(other, '.0f'):>13}{floats / c:>10.0f}"
                print(line + f"{'–' if other is None else format(other / floats, '.0f'):>13}")
    rules = base(Triangles, Triangles, "centroid")
    general = on_floats(
        lambda row, column: outline_centroid(rules.output, rules.heights(row, column))
    )
    print(f"\nµs each. Triangles' centroid from the general outline: {general:.2f} on floats")
    print(f"{general / on_floats(rules):.1f} times that of the closed form for pairs")


if __name__ == "__main__":
    main()
