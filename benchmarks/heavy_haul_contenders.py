"""The contenders of heavy_haul.py: the loop of heavy_haul.c, and the FMU stepped from C and Python.

All make the same run: the train pulls, brakes with electric and air brakes, stands, and starts
violently. A run returns seconds of processor time and the outputs at all communication points.
"""

import ctypes
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray

from railcosim import Diagram, Fmu, Profile
from railcosim.base.compilers import native_compiler
from railcosim.fmus import build
from railcosim.models import heavy_haul_train
from railcosim.models.consist import coal_train
from railcosim.models.plant import Plant

INNER, H = 0.001, 0.1  # s
SPEED, GRADIENT = 4.0, 6.0  # m/s, per mille
FORCE = ((0.0, 0.0), (4.0, 900e3), (12.0, 900e3), (14.0, -350e3), (30.0, -350e3), (32.0, 0.0),
         (36.0, 0.0), (39.0, 1140e3))  # fmt: skip
REDUCTION = ((0.0, 0.0), (12.0, 0.0), (12.1, 80.0), (30.0, 80.0), (30.1, 0.0))  # kPa
LENGTH = 60.0  # s, of that run
VEHICLE = ("mass", "resistance_constant", "resistance_linear", "resistance_quadratic",
           "resistance_starting", "length", "behind", "brake_area", "shoes",
           "full_pressure")  # fmt: skip
COUPLER = ("slack", "stiffness", "unloading_ratio", "damping")
SCALAR = ("brake_pipe.application_speed", "brake_pipe.release_speed",
          "brake_cylinder.application_time", "brake_cylinder.release_time")  # fmt: skip
# What a row of the loop by hand begins with; None is not an output of the FMU.
ROW = ("vehicle[].position", "speed", "group[1].applied", "group[1].upper", "group[1].lower",
       "standing", "coupler_maximum", "coupler_maximum_at", "coupler_minimum",
       "coupler_minimum_at", "energy.gears", "energy.gears_stored", "energy.kinetic",
       "energy.potential", "energy.residual", "vehicle[].speed", None, "vehicle[].pipe_reduction",
       "vehicle[].cylinder_pressure", None, None, "coupler[].force", "coupler[].highest",
       "coupler[].lowest", None, "energy.traction", "energy.electric_brake", "energy.resistance",
       "energy.air_brake", "energy.damping")  # fmt: skip
HIDDEN = ("v", "c", "c", "c")  # displacements, gear forces, stretches, works: as long as which
Rows = NDArray[np.float64]
Run = Callable[[], tuple[float, Rows]]  # -> seconds, outputs at communication points


def plant(size: int) -> Plant:
    """Return a train of two locomotives and wagons, so many vehicles in all."""
    return heavy_haul_train(coal_train(wagons=size - 2))


def demands(length: float, step: float) -> tuple[Rows, Rows]:
    """Return force (N) and reduction (kPa) at the communication points of a run.

    A shorter run has all of them, in haste: so each size pays for brakes as well.
    """
    t = step * np.arange(round(length / step)) * max(LENGTH / length, 1.0)
    force, reduction = (np.array(points).T for points in (FORCE, REDUCTION))
    return np.interp(t, *force), np.interp(t, *reduction)


class ByHand:
    """The loop of heavy_haul.c for a number of vehicles."""

    def __init__(self, size: int, compiler: str, folder: Path) -> None:
        source, library = folder / f"hand{size}.c", folder / f"hand{size}-{compiler}.so"
        code = Path(__file__).with_name("heavy_haul.c").read_text()
        source.write_text(f"#define N {size}\n#define LOCOMOTIVES 2\n{code}")
        native_compiler(compiler).shared_library(source, library)
        self.functions = ctypes.CDLL(str(library))
        self.size = size
        starts = {v.name: v.start or () for v in plant(size).variables("parameter")}
        names = [f"vehicle[].{n}" for n in VEHICLE] + [f"coupler[].{n}" for n in COUPLER]
        values = [number for name in names for number in starts[name]]
        values += [0.0, GRADIENT, *(number for name in SCALAR for number in starts[name])]
        self.parameters = np.array(values)
        lengths = {"v": size, "c": size - 1}
        hidden = iter(HIDDEN)
        self.places: dict[str, slice] = {}
        first = 0
        for name in ROW:
            length = 1
            if name is None:
                length = lengths[next(hidden)]
            elif "[]" in name:
                length = lengths[name[0]]
            if name is not None:
                self.places[name] = slice(first, first + length)
            first += length
        self.width = first + 2  # the damping's power, and the energy at the start

    def run(self, length: float, step: float) -> Run:
        force, reduction = demands(length, step)
        rows = np.zeros((len(force), self.width))
        pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in (force, reduction, rows)]
        given = self.parameters.ctypes.data_as(ctypes.c_void_p)
        head = (given, ctypes.c_double(SPEED), *pointers[:2], ctypes.c_double(INNER))
        counts = (ctypes.c_long(round(step / INNER)), ctypes.c_long(len(force)))

        def timed() -> tuple[float, Rows]:
            began = process_time()
            self.functions.run_by_hand(*head, *counts, pointers[2], ctypes.c_long(self.width))
            return process_time() - began, rows

        return timed


class Instance:
    """An instance of the FMU at its start; it reads all outputs."""

    def __init__(self, path: Path, folder: Path) -> None:
        description = read_model_description(str(path), validate=False)
        assert description.coSimulation is not None
        unzipped = folder / path.parent.name
        if not unzipped.exists():  # a library that is in use must not be overwritten
            extract(str(path), str(unzipped))
        variables = description.modelVariables
        self.references = {v.name: v.valueReference for v in variables}
        self.outputs = [v.name for v in variables if v.causality == "output"]
        self.slave = FMU2Slave(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(unzipped),
            instanceName="train",
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        start = {"initial_speed": SPEED, "gradient[1]": GRADIENT}
        self.slave.setReal([self.references[name] for name in start], [*start.values()])
        self.slave.exitInitializationMode()
        self.begin = self.slave.getFMUState()
        inputs = [self.references[name] for name in ("group[1].force", "group[1].reduction")]
        self.inputs = (ctypes.c_uint32 * 2)(*inputs)
        width = len(self.outputs)
        self.read = (ctypes.c_uint32 * width)(*(self.references[n] for n in self.outputs))
        self.component = ctypes.c_void_p(self.slave.component)  # pyright: ignore[reportArgumentType]

    def columns(self, name: str) -> list[int]:
        """Return where a row has an output, all elements of a vector."""
        head, _, tail = name.partition("[]")
        return [
            i for i, n in enumerate(self.outputs)
            if n == name or (tail and n.startswith(f"{head}[") and n.endswith(f"]{tail}"))
        ]  # fmt: skip

    def from_c(self, driver: ctypes.CDLL, length: float, step: float) -> Run:
        """Return a run stepped from C, as other tools step an FMU."""
        names = ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal")
        calls = [ctypes.cast(getattr(self.slave.dll, n), ctypes.c_void_p) for n in names]
        force, reduction = demands(length, step)
        rows = np.zeros((len(force), len(self.outputs)))
        a, b, c = (x.ctypes.data_as(ctypes.c_void_p) for x in (force, reduction, rows))
        head = (self.component, *calls, self.inputs, a, b, ctypes.c_double(step))
        tail = (ctypes.c_long(len(force)), self.read, ctypes.c_size_t(rows.shape[1]), c)

        def timed() -> tuple[float, Rows]:
            self.slave.setFMUState(self.begin)
            began = process_time()
            failed = driver.run_fmu(*head, *tail)
            spent = process_time() - began
            if failed:
                raise SystemExit("a call of the FMU failed")
            return spent, rows

        return timed

    def from_python(self, length: float, step: float) -> Run:
        """Return a run stepped by FMPy's functions, without its lists and checks."""
        dll = self.slave.dll
        force, reduction = (x.tolist() for x in demands(length, step))
        rows = np.zeros((len(force), len(self.outputs)))
        value, size = (ctypes.c_double * 2)(), rows.shape[1]

        def timed() -> tuple[float, Rows]:
            self.slave.setFMUState(self.begin)
            began, at, failed = process_time(), rows.ctypes.data, 0
            for k in range(len(force)):
                value[0], value[1] = force[k], reduction[k]
                failed |= dll.fmi2SetReal(self.component, self.inputs, 2, value)
                failed |= dll.fmi2DoStep(self.component, k * step, step, 1)
                row = (ctypes.c_double * size).from_address(at + 8 * k * size)
                failed |= dll.fmi2GetReal(self.component, self.read, size, row)
            spent = process_time() - began
            if failed:
                raise SystemExit("a call of the FMU failed")
            return spent, rows

        return timed


def diagram(step: float) -> Diagram:
    """Return the same run of 102 vehicles as a diagram."""
    made = Diagram("haul", step=step)
    made.add("force", Profile(FORCE, unit="N"))
    made.add("reduction", Profile(REDUCTION, unit="kPa"))
    start = {"initial_speed": SPEED, "gradient[1]": GRADIENT}
    made.add("train", Fmu.with_values(build(plant(102)), start))
    for name in ("force", "reduction"):
        made.connect(f"{name}.y", f"train.group[1].{name}")
    return made
