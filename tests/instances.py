"""FMU instances through FMPy with their variables by name, for the tests."""

from itertools import count
from pathlib import Path
from typing import Any

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from railcosim.cosim.fmu.log import _logs, callbacks

_numbers = count(10**9)


class FMU2Named(FMU2Slave):  # FMPy wants the name to begin so
    """A co-simulation FMU with its variables by name and its log lines."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.description: Any = read_model_description(str(path))
        self.vr = {v.name: v.valueReference for v in self.description.modelVariables}
        self.kind = {v.name: v.type for v in self.description.modelVariables}
        extract(str(path), str(folder))
        super().__init__(
            guid=self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="slave",
        )
        self.log: Any = []
        number = next(_numbers)
        _logs[number] = self.log
        self.instantiate(callbacks=callbacks(number))

    def get(self, name: str) -> float:
        get = self.getInteger if self.kind[name] == "Integer" else self.getReal
        return get([self.vr[name]])[0]

    def set(self, name: str, value: float) -> None:
        if self.kind[name] == "Integer":
            self.setInteger([self.vr[name]], [int(value)])
        else:
            self.setReal([self.vr[name]], [value])

    def initialize(self, start: float = 0.0) -> None:
        self.setupExperiment(startTime=start)
        self.enterInitializationMode()
        self.exitInitializationMode()

    def run(self, stop: float, step: float, start: float = 0.0) -> None:
        """Step from `start` to `stop`, at times counted from zero."""
        for k in range(round(start / step), round(stop / step)):
            self.doStep(k * step, step)

    def fails(self, call: Any, message: str) -> None:
        with pytest.raises(FMICallException) as caught:
            call()
        assert caught.value.status == 3
        assert message in self.log[-1]
