"""Checks that run the FMU: GUID, several instances, reset, communication step."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim import Fmu
from ...cosim.fmu_file import binary_of, extracted
from ...cosim.fmu_instance import FmuInstance
from .excitation import COARSE, Excitation
from .report import Report

STEP_TOLERANCE = 1e-6  # of the signal's size, between fine and coarse communication steps


def signal_size(values: np.ndarray) -> float:
    """Return the largest magnitude, at least 1e-6: a signal at rest may stir by rounding."""
    return max(float(np.max(np.abs(values))), 1e-6)


class Stepper:
    """An FMU instance driven by an excitation, one communication point after another."""

    def __init__(self, block: Fmu, excitation: Excitation, name: str, every: int = 1) -> None:
        self.excitation, self.every = excitation, every
        self.instance = block.instance(name)
        self.rows: list[tuple[float, ...]] = []
        self.inputs = list(block.inputs)
        self.place = 0

    def begin(self) -> None:
        """Initialize; the first row is the outputs at the first point."""
        instance, times = self.instance, self.excitation.times
        instance.enter_initialization(float(times[0]), float(times[-1]))
        instance.inputs(self.excitation.row(0, self.inputs))
        instance.put()
        instance.exit_initialization()
        instance.fetch()
        self.place, self.rows = 0, [instance.outputs()]

    def step(self) -> bool:
        """Advance by `every` points; return False at the end."""
        times = self.excitation.times
        if self.place + self.every >= len(times):
            return False
        now, then = float(times[self.place]), float(times[self.place + self.every])
        self.instance.inputs(self.excitation.row(self.place, self.inputs))
        self.instance.advance(now, then - now)
        self.place += self.every
        self.rows.append(self.instance.outputs())
        return True

    def finish(self) -> np.ndarray:
        """Run to the end and return all rows."""
        while self.step():
            pass
        return np.array(self.rows)


def trajectory(block: Fmu, excitation: Excitation, every: int = 1) -> np.ndarray:
    """Return the outputs at the excitation's points (at every `every`-th) of a fresh instance."""
    stepper = Stepper(block, excitation, "check", every)
    try:
        stepper.begin()
        return stepper.finish()
    finally:
        stepper.instance.close()


def check_behaviour(
    block: Fmu, description: Any, excitation: Excitation, report: Report
) -> np.ndarray | None:
    """Add the findings that need runs; one that the FMU breaks off fails with its message.

    Return the outputs at the excitation's points; None if the FMU does not run.
    """
    if not _guid(block, description, report):
        return None
    try:
        base = trajectory(block, excitation)
    except FmuError as error:
        report.add("runs", [str(error)], "")
        return None
    finite = np.isfinite(base).all()
    report.add("runs", [] if finite else ["an output is not finite"], excitation.text)
    names = list(block.outputs)
    rules: list[tuple[str, Callable[[], list[str]], str]] = [
        ("two instances", lambda: _two(block, excitation, base, names), "run as one alone does"),
        ("reset", lambda: _reset(block, excitation, base, names), "gives the same run again"),
        (
            "communication step",
            lambda: _coarse(block, excitation, base, names),
            f"1× and {COARSE}× agree to {STEP_TOLERANCE:g} of the signal's size",
        ),
    ]
    if len(excitation.times) <= COARSE:
        rules.pop()
        report.skip("communication step", f"needs {COARSE} steps; give a longer --stop")
    only_once = description.coSimulation.canBeInstantiatedOnlyOncePerProcess
    for rule, run, good in rules:
        if rule == "two instances" and only_once:
            report.skip(rule, "the FMU declares that it can be instantiated only once")
            continue
        try:
            report.add(rule, run(), good)
        except FmuError as error:
            report.add(rule, [str(error)], good)
    return base if finite else None


def _guid(block: Fmu, description: Any, report: Report) -> bool:
    """The binary must take the description's GUID; whether it minds another one tells the rest.

    Of binaries for other machines only the text can be searched: where one holds the GUID, so
    must all.
    """
    try:
        block.instance("check").close()
    except FmuError as error:
        report.add("GUID", [f"the binary refuses the description's GUID: {error}"], "")
        return False
    folder = extracted(block.path) / "binaries"
    libraries = [p for p in folder.rglob("*") if p.suffix in (".so", ".dll", ".dylib")]
    guid = str(description.guid).encode()
    holds = {p.relative_to(folder).as_posix(): guid in p.read_bytes() for p in libraries}
    own = binary_of(block.path, description).relative_to(folder).as_posix()
    if holds[own]:
        others = [f"{name} does not hold the GUID" for name, has in holds.items() if not has]
        report.add("GUID", others, "the description's is in every binary")
    elif _accepts_any(block):
        report.skip("GUID", "the binary takes any GUID, and the description's is not found in it")
    else:
        report.add("GUID", [], "the binary takes the description's and refuses another")
    return True


def _accepts_any(block: Fmu) -> bool:
    try:
        FmuInstance("check", block.path, [], [], guid="{not-the-guid-of-this-fmu}").close()
    except FmuError:
        return False
    return True


def _same(a: np.ndarray, b: np.ndarray, names: list[str]) -> list[str]:
    return [
        f"{name} differs by up to {np.max(np.abs(a[:, i] - b[:, i])):.3g}"
        for i, name in enumerate(names)
        if not np.array_equal(a[:, i], b[:, i])
    ]


def _two(block: Fmu, excitation: Excitation, base: np.ndarray, names: list[str]) -> list[str]:
    """Run two instances in turns, the second one step behind."""
    first, second = (Stepper(block, excitation, f"check{i}") for i in (1, 2))
    try:
        first.begin()
        second.begin()
        first.step()
        while first.step():
            second.step()
        second.finish()
        problems = [f"first: {p}" for p in _same(np.array(first.rows), base, names)]
        return problems + [f"second: {p}" for p in _same(np.array(second.rows), base, names)]
    finally:
        first.instance.close()
        second.instance.close()


def _reset(block: Fmu, excitation: Excitation, base: np.ndarray, names: list[str]) -> list[str]:
    stepper = Stepper(block, excitation, "check")
    try:
        stepper.begin()
        for _ in range(len(excitation.times) // 3):
            stepper.step()
        stepper.instance.reset()
        for variable, value in block.values.items():
            stepper.instance.set(variable, value)
        stepper.begin()
        return _same(stepper.finish(), base, names)
    finally:
        stepper.instance.close()


def _coarse(block: Fmu, excitation: Excitation, base: np.ndarray, names: list[str]) -> list[str]:
    """Compare 1× with 10× steps under the same inputs: held over the coarse step in both."""
    held = {n: np.repeat(v[::COARSE], COARSE)[: len(v)] for n, v in excitation.inputs.items()}
    same = all(np.array_equal(held[n], v) for n, v in excitation.inputs.items())
    under = Excitation(excitation.times, held, excitation.text)
    fine = (base if same else trajectory(block, under))[::COARSE]
    coarse = trajectory(block, under, COARSE)
    problems = []
    for i, name in enumerate(names):
        size = signal_size(fine[:, i])
        error = float(np.max(np.abs(fine[: len(coarse), i] - coarse[:, i])))
        if not error <= STEP_TOLERANCE * size:
            problems.append(f"{name} differs by up to {error:.3g}")
    return problems
