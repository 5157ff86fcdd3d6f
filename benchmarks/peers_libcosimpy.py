"""libcosimpy: libcosim's fixed-step algorithm from Python, without worker threads unless told.

The number of workers can only be given in an .ssd file. Its own step size is a whole number of
nanoseconds. It has no slaves in Python: a controller reads with an observer and writes with a
manipulator between two steps, so that it is no step late.
"""

import shutil
import tempfile
from pathlib import Path
from time import process_time
from typing import Any

from libcosimpy.CosimEnums import CosimVariableType  # pyright: ignore[reportMissingImports]
from libcosimpy.CosimExecution import CosimExecution  # pyright: ignore[reportMissingImports]
from libcosimpy.CosimLogging import (  # pyright: ignore[reportMissingImports]
    CosimLogLevel,
    log_output_level,
)
from libcosimpy.CosimManipulator import CosimManipulator  # pyright: ignore[reportMissingImports]
from libcosimpy.CosimObserver import CosimObserver  # pyright: ignore[reportMissingImports]
from peers_job import Job, done, job

SSD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription name="work" version="1.0"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">
  <ssd:System name="system">
    <ssd:Elements>{elements}</ssd:Elements>
    <ssd:Connections>{connections}</ssd:Connections>
  </ssd:System>
  <ssd:DefaultExperiment startTime="0">
    <ssd:Annotations>
      <ssc:Annotation type="com.opensimulationplatform">
        <osp:Algorithm>
          <osp:FixedStepAlgorithm baseStepSize="{step}" {workers}/>
        </osp:Algorithm>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""
CONNECTOR = '<ssd:Connector name="{}" kind="{}"><ssc:Real/></ssd:Connector>'
PORTS = {
    "train": {"u": "input", "speed": "output"},
    "left": {
        "other_position": "input",
        "other_speed": "input",
        "position": "output",
        "speed": "output",
    },
}
PORTS["right"] = PORTS["left"]


def execution(work: Job, names: list[str], folder: Path) -> Any:
    """Write the system structure and load it."""
    elements, connections = "", ""
    (folder / "resources").mkdir()
    for name in names:
        shutil.copy(work.fmus[name], folder / "resources" / f"{name}.fmu")
        connectors = "".join(CONNECTOR.format(*port) for port in PORTS[name].items())
        elements += (
            f'<ssd:Component name="{name}" source="resources/{name}.fmu" '
            f'type="application/x-fmu-sharedlibrary">'
            f"<ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>"
        )
    if len(names) == 2:
        for a, b in (names, names[::-1]):
            for port in ("position", "speed"):
                connections += (
                    f'<ssd:Connection startElement="{a}" startConnector="{port}" '
                    f'endElement="{b}" endConnector="other_{port}"/>'
                )
    workers = work.options.get("workers")
    text = SSD.format(
        elements=elements,
        connections=connections,
        step=work.step,
        workers="" if workers is None else f'numWorkerThreads="{workers}"',
    )
    (folder / "SystemStructure.ssd").write_text(text)
    return CosimExecution.from_ssp_file(ssp_path=str(folder))


def references(run: Any, slave: int) -> dict[str, int]:
    """Return a slave's real variables with their value references."""
    return {
        v.name.decode(): v.reference
        for v in run.slave_variables(slave_index=slave)
        if CosimVariableType(v.type) == CosimVariableType.REAL
    }


def masses(work: Job, folder: Path) -> None:
    run = execution(work, ["left", "right"], folder)
    observer = CosimObserver.create_last_value()
    run.add_observer(observer)
    slaves = [run.slave_index_from_instance_name(name) for name in ("left", "right")]
    began = process_time()
    good = run.step(work.steps)
    spent = process_time() - began
    if not good:
        raise SystemExit("libcosim's step failed")
    final = []
    for slave in slaves:
        known = references(run, slave)
        wanted = [known["position"], known["speed"]]
        final += observer.last_real_values(slave, wanted)
    done(spent, final)


def loop(work: Job, folder: Path) -> None:
    run = execution(work, ["train"], folder)
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    run.add_observer(observer)
    run.add_manipulator(manipulator)
    slave = run.slave_index_from_instance_name("train")
    known = references(run, slave)
    speeds, controls = [known["speed"]], [known["u"]]
    read, write, step = observer.last_real_values, manipulator.slave_real_values, run.step
    gain, reference, rows, failed = work.gain, work.reference, [], 0
    began = process_time()
    for _ in range(work.steps):
        speed = read(slave, speeds)[0]
        u = gain * (reference - speed)
        rows.append((u, speed))
        write(slave, controls, [u])
        failed += not step()
    spent = process_time() - began
    if failed:
        raise SystemExit("libcosim's step failed")
    done(spent, read(slave, speeds))


if __name__ == "__main__":
    log_output_level(CosimLogLevel.WARNING)
    given = job()
    with tempfile.TemporaryDirectory() as name:
        {"masses": masses, "loop": loop}[given.work](given, Path(name))
