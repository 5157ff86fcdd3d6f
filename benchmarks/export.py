"""The chain of chain.py as an FMU: speed against C by hand and CasADi's integrators; its export.

All in one run on one machine, so trust the ratios. Inner steps and communication steps count
processor time, the least of several turns; exports count real time with zig's cache warm. Before
any time counts, the FMU's states must be those of the loop by hand to 1e-9. Run:
python benchmarks/export.py
"""

import ctypes
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time, sleep
from typing import Any

import casadi as ca
import numpy as np
from chain import chain  # the file beside this one
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from railcosim.base.compilers import native_compiler
from railcosim.base.errors import BuildError
from railcosim.fmus import build, export
from railcosim.fmus.functions import Functions
from railcosim.fmus.layout import Layout
from railcosim.models.solver import DormandPrince

INNER, H, TURNS = 0.002, 0.1, 15
TRACTION = 400e3
SIZES = {10: (50_000, 1.25), 102: (5_000, 1.10), 1000: (500, 1.10)}  # steps, allowed ratio
PARAMETERS = (
    "coupler.stiffness", "coupler.stiffening", "coupler.damping", "resistance.constant",
    "resistance.linear", "resistance.quadratic", "resistance.threshold", "grade", "vehicle[].mass",
)  # fmt: skip
ALL = ("linux64", "win64", "darwin64")
Run = Callable[[int], tuple[float, np.ndarray]]  # steps -> seconds, final states


def start(n: int) -> np.ndarray:
    """Return speeds and positions of a train that rolls and swings a little."""
    i = np.arange(n)
    return np.concatenate([12.0 + 0.05 * np.sin(0.7 * i), 0.01 * np.cos(1.3 * i) - 0.002 * i])


def by_hand(n: int, compiler: str, folder: Path) -> tuple[Run, Run, ctypes.CDLL]:
    """Return the two loops of chain.c, and its library."""
    source, library = folder / f"hand{n}.c", folder / f"hand{n}-{compiler}.so"
    code = Path(__file__).with_name("chain.c").read_text()
    source.write_text(f"#define N {n}\n{code}")
    native_compiler(compiler).shared_library(source, library)
    functions = ctypes.CDLL(str(library))
    starts = {v.name: v.start or () for v in chain(n).variables("parameter")}
    p = np.array([number for name in PARAMETERS for number in starts[name]])
    pointer = np.ctypeslib.ndpointer(float)
    arguments = [pointer, ctypes.c_double, pointer, ctypes.c_double, ctypes.c_long]

    def timed(function: Any) -> Run:
        function.argtypes = arguments

        def run(steps: int) -> tuple[float, np.ndarray]:
            x = start(n)
            began = process_time()
            function(x, TRACTION, p, INNER, steps)
            return process_time() - began, x

        return run

    return timed(functions.run_one_loop), timed(functions.run_two_loops), functions


@dataclass
class Fmu:
    """An instance of the chain's FMU at its start, with the references of what is set and read."""

    slave: FMU2Slave
    n: int
    traction: int
    outputs: list[int]

    def __post_init__(self) -> None:
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.setReal([*range(2 * self.n)], [*start(self.n)])
        self.slave.setReal([self.traction], [TRACTION])
        self.slave.exitInitializationMode()
        self.begin = self.slave.getFMUState()

    def inner(self, steps: int) -> tuple[float, np.ndarray]:
        """Make inner steps within one communication step."""
        self.slave.setFMUState(self.begin)
        began = process_time()
        self.slave.doStep(0.0, steps * INNER)
        spent = process_time() - began
        return spent, np.array(self.slave.getReal([*range(2 * self.n)]))

    def outer(self, steps: int) -> tuple[float, np.ndarray]:
        """Make them within communication steps H from Python, as railcosim's master does.

        One input is set and all outputs read, by FMPy's functions without its lists and checks.
        """
        component = ctypes.c_void_p(self.slave.component)  # pyright: ignore[reportArgumentType]
        dll = self.slave.dll
        set_real, do_step, get_real = dll.fmi2SetReal, dll.fmi2DoStep, dll.fmi2GetReal
        traction, value = (ctypes.c_uint32 * 1)(self.traction), (ctypes.c_double * 1)(TRACTION)
        size = len(self.outputs)
        outputs, values = (ctypes.c_uint32 * size)(*self.outputs), (ctypes.c_double * size)()

        def step(count: int) -> int:
            failed = 0
            for k in range(count):
                failed |= set_real(component, traction, 1, value)
                failed |= do_step(component, k * H, H, 1)
                failed |= get_real(component, outputs, size, values)
            return failed

        return self._timed(step, steps)

    def from_c(self, driver: ctypes.CDLL) -> Run:
        """Return the same run from C, as other tools step an FMU."""
        dll, size = self.slave.dll, len(self.outputs)
        functions = [
            ctypes.cast(getattr(dll, name), ctypes.c_void_p)
            for name in ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal")
        ]
        component = ctypes.c_void_p(self.slave.component)  # pyright: ignore[reportArgumentType]
        outputs, values = (ctypes.c_uint32 * size)(*self.outputs), (ctypes.c_double * size)()
        head = (component, *functions, ctypes.c_uint32(self.traction), ctypes.c_double(TRACTION))
        tail = (outputs, ctypes.c_size_t(size), values, ctypes.c_double(H))

        def step(count: int) -> int:
            return driver.run_fmu(*head, *tail, ctypes.c_long(count))

        return lambda steps: self._timed(step, steps)

    def _timed(self, step: Callable[[int], int], steps: int) -> tuple[float, np.ndarray]:
        self.slave.setFMUState(self.begin)
        began = process_time()
        failed = step(round(steps * INNER / H))
        spent = process_time() - began
        if failed:
            raise SystemExit("a call of the FMU failed")
        return spent, np.array(self.slave.getReal([*range(2 * self.n)]))


def through_fmu(n: int, path: Path, folder: Path) -> Fmu:
    """Load an FMU of the chain."""
    description = read_model_description(str(path))
    assert description.coSimulation is not None
    references = {v.name: v.valueReference for v in description.modelVariables}
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    unzipped = folder / path.parent.name
    if not unzipped.exists():  # a library that is in use must not be overwritten
        extract(str(path), str(unzipped))
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=str(unzipped),
        instanceName="chain",
    )
    return Fmu(slave, n, references["traction"], outputs)


def least(runs: dict[str, Run], steps: int) -> dict[str, float]:
    """Return each run's least seconds per step, in turns; stop if their results differ."""
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(TURNS):
        results = []
        for name, run in runs.items():
            spent, states = run(steps)
            best[name] = min(best[name], spent / steps)
            results.append(states)
        for states in results[1:]:
            np.testing.assert_allclose(states, results[0], rtol=1e-9, atol=1e-12)
    return best


def inner_loop(compiler: str, folder: Path) -> None:
    """Print inner steps against the loops by hand."""
    for n, (steps, allowed) in SIZES.items():
        one, two, driver = by_hand(n, compiler, folder)
        fmu = through_fmu(n, build(chain(n), compiler=compiler), folder)
        runs = {"one": one, "two": two, "inner": fmu.inner, "python": fmu.outer}
        best = least({**runs, "c": fmu.from_c(driver)}, steps)
        hand = min(best["one"], best["two"])
        name = f"{compiler:6} {n:5} vehicles"
        row(f"{name}, inner step", best["inner"], hand, allowed)
        row(f"{name}, every {H} s from C", best["c"], hand, 1.25)
        row(f"{name}, every {H} s from Python", best["python"], hand, 1.25)


def row(name: str, mine: float, theirs: float, allowed: float) -> None:
    ratio = mine / theirs
    verdict = "" if ratio <= allowed else "  MISSED"
    print(
        f"{name:48} {mine * 1e6:9.3f} µs {theirs * 1e6:9.3f} µs {ratio:7.2f} ≤ {allowed}{verdict}"
    )


def casadi_integrator(n: int, plugin: str, span: float, options: dict[str, Any]) -> Run:
    """Return a run of CasADi's own integrator on the chain's equations."""
    functions = Functions(Layout(chain(n)))
    x, p = ca.MX.sym("x", 2 * n), ca.MX.sym("p", len(functions.layout.parameters))
    derivative = functions.equations(0.0, x, TRACTION, p, ca.MX(0, 1))[0]
    method = ca.integrator("chain", plugin, {"x": x, "p": p, "ode": derivative}, 0.0, span, options)
    values = [s.variable.start[s.index] for s in functions.layout.parameters if s.variable.start]

    def run(_: int) -> tuple[float, np.ndarray]:
        began = process_time()
        states = method(x0=start(n), p=values)["xf"]
        return process_time() - began, np.array(states).ravel()

    return run


def integrators(n: int, folder: Path) -> None:
    """Print the FMU against CasADi's integrators in this process, for a span of 10 s."""
    span = 10.0
    steps = round(span / INNER)
    pairs = {
        "rk, 2 ms": (None, "rk", {"number_of_finite_elements": steps}),
        "cvodes, 1e-8": (
            DormandPrince(relative_tolerance=1e-8, absolute_tolerance=1e-8),
            "cvodes",
            {"reltol": 1e-8, "abstol": 1e-8},
        ),
    }
    exact = through_fmu(
        n,
        build(chain(n), solver=DormandPrince(relative_tolerance=1e-13, absolute_tolerance=1e-13)),
        folder,
    ).inner(steps)[1]
    for name, (solver, plugin, options) in pairs.items():
        fmu = through_fmu(n, build(chain(n), solver=solver), folder)
        other = casadi_integrator(n, plugin, span, options)
        (mine, own), (theirs, its) = (
            min((run(steps) for _ in range(3)), key=lambda result: result[0])
            for run in (fmu.inner, other)
        )
        errors = [float(np.max(np.abs(states - exact))) for states in (own, its)]
        print(
            f"casadi {name:13} {n} vehicles, {span:g} s: {theirs * 1e3:8.1f} ms (error "
            f"{errors[1]:.0e}), FMU {mine * 1e3:7.1f} ms ({errors[0]:.0e}): "
            f"{theirs / mine:.0f} times faster"
        )


def exports(folder: Path) -> None:
    """Print time and size of exports."""
    wanted = ((102, ALL, 3.0, 150e3), (1000, ("linux64",), 5.0, float("inf")))
    for n, platforms, seconds, size in wanted:
        path, spent = folder / f"export{n}.fmu", float("inf")
        for _ in range(4):  # the first one warms the cache
            plant = chain(n)
            began = perf_counter()
            export(plant, path, platforms=platforms)
            spent = min(spent, perf_counter() - began)
            sleep(0.2)
        length = path.stat().st_size
        missed = "  MISSED" if spent > seconds or length > size else ""
        print(
            f"export of {n} vehicles for {', '.join(platforms)}: {spent:.2f} s ≤ {seconds}, "
            f"{length / 1e3:.1f} kB ≤ {size / 1e3:g}{missed}"
        )


def main() -> None:
    """Print everything."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{'':48} {'FMU':>12} {'by hand':>12} {'ratio':>7}")
        for compiler in ("system", "zig"):
            try:
                described = native_compiler(compiler).identity
            except BuildError:
                continue
            print(f"{compiler}: {described}")
            inner_loop(compiler, folder)
        integrators(102, folder)
        exports(folder)


if __name__ == "__main__":
    main()
