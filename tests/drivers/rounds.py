"""Run in a process of its own: rounds of many instances through FMPy, and memory after each."""

import gc
import sys
from pathlib import Path
from typing import Any

from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave


def resident() -> int:
    """Return this process's resident memory in kB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4


def made(description: Any, folder: str, number: int) -> FMU2Slave:
    """Return an initialized instance."""
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=folder,
        instanceName=f"slave {number}",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave


def one_round(description: Any, folder: str, count: int) -> None:
    """Make this many instances, step them in turns, and free them."""
    slaves = [made(description, folder, number) for number in range(count)]
    for k in range(3):
        for slave in slaves:
            slave.doStep(0.1 * k, 0.1)
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()


def main(folder: str, rounds: int, count: int) -> None:
    """Use the FMU that is unpacked in `folder`."""
    description = read_model_description(folder)
    for _ in range(rounds):
        one_round(description, folder, count)
        gc.collect()
        print(resident())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
