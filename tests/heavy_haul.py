"""Heavy-haul trains for the tests: their laws without an FMU, and FMUs with whole vectors."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.models import Plant
from tests.instances import FMU2Named

Array = NDArray[np.float64]
Demands = Mapping[str, Callable[[float], float]]
NONE: Mapping[str, Any] = MappingProxyType({})


class Laws:
    """A plant's expressions as a function of the `given` variables; all others are at their start.

    Known names of expressions are outputs, of states "der(…)" without dry friction and
    "friction(…)", and of memories "update(…)".
    """

    def __init__(self, plant: Plant, *names: str, given: Sequence[str] = ()) -> None:
        found = dict(plant.outputs)
        found |= {f"der({name})": e for name, e in plant.drives.items()}
        found |= {f"friction({name})": e for name, e in plant.frictions.items()}
        found |= {f"update({name})": e for name, e in plant.updates.items()}
        every = {
            v.name: v for v in plant.variables("input", "parameter", "state", "mode", "memory")
        }
        self.names = names
        self.given = {name: every[name] for name in given}
        known = [v.symbol if v.name in given else ca.DM(v.start or 0.0) for v in every.values()]
        dependents = plant.variables("dependent")
        symbols = [v.symbol for v in every.values()]
        parameters = ca.Function("dependents", symbols, list(plant.dependents.values()))
        whole = ca.Function(
            "whole", [*symbols, *(v.symbol for v in dependents)], [found[n] for n in names]
        )
        results = whole.call([*known, *parameters.call(known)])
        self._function = ca.Function("laws", [every[n].symbol for n in given], results)

    def __call__(self, *values: ArrayLike) -> list[Array]:
        """Return the expressions' values; a single number stands for a whole vector."""
        columns = [
            np.broadcast_to(np.asarray(value, float), variable.length)
            for value, variable in zip(values, self.given.values(), strict=True)
        ]
        return [r.full().ravel() for r in self._function.call([ca.DM(c) for c in columns])]


class FMU2Train(FMU2Named):  # FMPy wants the name to begin so
    """A train's FMU: "vehicle[].speed" is the array over all vehicles."""

    def __init__(self, path: Path, folder: Path, values: Mapping[str, ArrayLike] = NONE) -> None:
        super().__init__(path, folder)
        self._columns: dict[str, list[int]] = {}
        self.time = 0.0
        for name, value in values.items():
            self.put(name, value)
        self.initialize()

    def references(self, name: str) -> list[int]:
        """Return the value references of a vector's elements, or of a scalar."""
        if name not in self._columns:
            pattern = name if "[]" in name else f"{name}[]"
            found = [self.vr[name]] if name in self.vr else []
            while (element := pattern.replace("[]", f"[{len(found) + 1}]")) in self.vr:
                found.append(self.vr[element])
            assert found, name
            self._columns[name] = found
        return self._columns[name]

    def put(self, name: str, value: ArrayLike) -> None:
        """Set a scalar, or a vector, for which one number stands for all elements."""
        references = self.references(name)
        values = np.broadcast_to(np.asarray(value, float), len(references))
        self.setReal(references, values.tolist())

    def take(self, name: str) -> Array:
        """Return the values of a vector, or the one of a scalar, as an array."""
        return np.array(self.getReal(self.references(name)))

    def go(
        self,
        stop: float,
        step: float,
        demands: Demands = NONE,
        watched: tuple[str, ...] = (),
    ) -> list[Array]:
        """Go on to `stop` with the demands held over each step; return the watched, row by row."""
        first, last = round(self.time / step), round(stop / step)
        rows: list[list[Array]] = [[self.take(name) for name in watched]]
        for k in range(first, last):
            for name, demand in demands.items():
                self.put(name, demand(k * step))
            self.doStep(k * step, step)
            rows.append([self.take(name) for name in watched])
        self.time = last * step
        return [np.array(column) for column in zip(*rows, strict=True)]

    def all_values(self) -> list[float]:
        """Return all real variables, in the order of the description."""
        return self.getReal([v.valueReference for v in self.description.modelVariables
                             if v.type == "Real"])  # fmt: skip


def ramp(rate: float, most: float) -> Callable[[float], float]:
    """Return a demand that rises from zero at `rate` per second up to `most`."""
    return lambda t: min(rate * t, most)
