"""Run in a process of its own: restore a serialized state, continue, print the values' bits."""

import json
import sys
import tempfile
from pathlib import Path

from tests.instances import FMU2Named


def main() -> None:
    """Read jobs from standard input, write the values after each as hexadecimal floats."""
    job = json.load(sys.stdin)
    slave = FMU2Named(Path(job["fmu"]), Path(tempfile.mkdtemp()))
    results = []
    for case in job["cases"]:
        state = slave.deSerializeFMUstate(bytes.fromhex(case["state"]))
        slave.setFMUstate(state)
        slave.freeFMUstate(state)
        results.append(continued(slave, case["time"], case["inputs"], job["names"]))
    json.dump(results, sys.stdout)


def continued(slave: FMU2Named, time: float, inputs: list, names: list[str]) -> list[str]:
    """Apply (step, {input: value}) from `time` on; return all values as text without loss."""
    found = []
    for step, values in inputs:
        for name, value in values.items():
            slave.set(name, value)
        slave.doStep(time, step)
        time += step
        found += [float(slave.get(name)).hex() for name in names]
    return found


if __name__ == "__main__":
    main()
