"""An instance of an FMU for either interface, with the calls that a check needs."""

import os
from collections.abc import Callable, Sequence
from ctypes import c_double
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.calls import TYPES, Functions
from ...cosim.fmu.file import binary_of, extracted
from ...cosim.fmu.instance import FmuInstance

CO_SIMULATION, MODEL_EXCHANGE = "co-simulation", "model exchange"
FATAL = 4


class Instance(FmuInstance):
    """An FmuInstance that is for co-simulation or for model exchange; failures are FmuError."""

    def __init__(
        self,
        path: Path,
        interface: str,
        name: str,
        inputs: Sequence[str],
        outputs: Sequence[str],
        *,
        guid: str | None = None,
    ) -> None:
        self.interface = interface
        self._groups: dict[tuple[str, ...], list[tuple[str, list[int], list[int]]]] = {}
        super().__init__(name, path, inputs, outputs, guid=guid)

    def _load(self, guid: str) -> None:
        from fmpy.fmi2 import FMU2Model, FMU2Slave

        d = self.description
        found = d.coSimulation if self.interface == CO_SIMULATION else d.modelExchange
        library = binary_of(self.path, d, found.modelIdentifier)
        here = Path.cwd()
        try:
            self.fmu: Any = self._open(
                FMU2Slave if self.interface == CO_SIMULATION else FMU2Model,
                guid=guid,
                modelIdentifier=found.modelIdentifier,
                unzipDirectory=str(extracted(self.path)),
                libraryPath=str(library),
                instanceName=self.name,
            )
        except Exception as error:
            words = " ".join(str(error).split())
            raise FmuError(f"{self.path.name} cannot be loaded: {words}") from error
        finally:
            os.chdir(here)  # FMPy changes it and, on failure, does not change it back

    def _open(self, kind: Callable[..., Any], **arguments: Any) -> Any:
        """Load the library."""
        return kind(**arguments)

    def _capabilities(self) -> None:
        super()._capabilities()
        self.retries = False  # a check wants to see what the FMU discards

    def _prepare(self) -> None:
        if self.interface == CO_SIMULATION:
            super()._prepare()
            return
        functions = Functions(self.fmu.dll, self.fmu.component, holds_gil=False)
        self.puts = [group.call(functions, "Set") for group in self._in]
        self.gets = [group.call(functions, "Get") for group in self._out]

    def _error(self, what: str) -> FmuError:
        return FmuError(f"{what}: {self.words()}")

    def words(self) -> str:
        """Return what the FMU logged since this was last asked for, the latest lines."""
        lines = list(self._log)[-2:]
        self._log.clear()
        return "; ".join(lines) or "the FMU logged nothing"

    def call(self, function: str, *args: Any) -> Any:
        """Call one of FMPy's methods and return what it returns."""
        from fmpy.fmi1 import FMICallException

        try:
            return getattr(type(self.fmu), function)(self.fmu, *args)
        except FMICallException as error:
            self.fail(error.function, error.status)
        except OSError as error:  # Windows turns a wild pointer into this
            raise FmuError(f"{function} broke off: {error}") from error

    # Values by name

    def read(self, names: Sequence[str]) -> np.ndarray:
        """Return the values of number variables."""
        found = np.empty(len(names))
        for suffix, references, places in self._grouped(names):
            found[places] = self.call(f"get{suffix}", references)
        return found

    def write(self, names: Sequence[str], values: Sequence[float] | np.ndarray) -> None:
        """Set number variables."""
        for suffix, references, places in self._grouped(names):
            convert = float if suffix == "Real" else round
            self.call(f"set{suffix}", references, [convert(float(values[i])) for i in places])

    def _grouped(self, names: Sequence[str]) -> list[tuple[str, list[int], list[int]]]:
        key = tuple(names)
        if key not in self._groups:
            kinds: dict[str, list[int]] = {}
            for i, name in enumerate(key):
                kinds.setdefault(TYPES[self._by_name[name].type][0], []).append(i)
            self._groups[key] = [
                (k, self.references([key[i] for i in p]), p) for k, p in kinds.items()
            ]
        return self._groups[key]

    def references(self, names: Sequence[str]) -> list[int]:
        """Return value references."""
        return [self._by_name[n].valueReference for n in names]

    # Co-simulation

    def set_slopes(self, names: Sequence[str], slopes: Sequence[float] | np.ndarray) -> None:
        """Set the first derivatives of inputs."""
        references, values = self.references(names), [float(s) for s in slopes]
        self.call("setRealInputDerivatives", references, [1] * len(values), values)

    def get_slopes(self, names: Sequence[str]) -> np.ndarray:
        """Return the first derivatives of outputs."""
        references = self.references(names)
        return np.array(self.call("getRealOutputDerivatives", references, [1] * len(references)))

    # Model exchange

    def _vector(self, function: str, n: int) -> np.ndarray:
        values = (c_double * n)()
        self.call(function, values, n)
        return np.array(values)

    def get_states(self) -> np.ndarray:
        """Return the continuous states."""
        return self._vector("getContinuousStates", self.description.numberOfContinuousStates)

    def set_states(self, x: np.ndarray) -> None:
        """Set the continuous states."""
        self.call("setContinuousStates", (c_double * len(x))(*x), len(x))

    def get_derivatives(self) -> np.ndarray:
        """Return the derivatives of the continuous states."""
        return self._vector("getDerivatives", self.description.numberOfContinuousStates)

    def get_nominals(self) -> np.ndarray:
        """Return the nominal values of the continuous states."""
        return self._vector(
            "getNominalsOfContinuousStates", self.description.numberOfContinuousStates
        )

    def get_indicators(self) -> np.ndarray:
        """Return the event indicators."""
        return self._vector("getEventIndicators", self.description.numberOfEventIndicators)

    def handle_events(self) -> None:
        """From continuous-time mode through event mode and back."""
        self.call("enterEventMode")
        self.settle()

    def settle(self) -> None:
        """Update the discrete states until they rest, and enter continuous-time mode."""
        for _ in range(1000):
            if not self.call("newDiscreteStates")[0]:
                break
        else:
            raise FmuError("fmi2NewDiscreteStates asks for another round 1000 times in a row")
        self.call("enterContinuousTimeMode")
