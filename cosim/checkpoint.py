"""The whole state of a simulation at a tick, to be continued in this process or another.

The file is a zip archive: `state.json` with everything but the FMUs, numbers written so that they
read back to the same bits, and one file of bytes for each FMU. Nothing in it is ever executed.
"""

import json
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from ..base.errors import CheckpointError, FileError
from .blocks.delay import Delay
from .blocks.fmu import Fmu
from .encoding import decoded, encoded

if TYPE_CHECKING:
    from .fmu.instance import FmuInstance
    from .plan import Plan
    from .scenario import Scenario
    from .schedule.schedule import Schedule

_FORMAT = 1


@dataclass(frozen=True)
class Checkpoint:
    """A simulation's state; made by Simulation.checkpoint, taken by Diagram.run(resume=…).

    It belongs to one diagram: same blocks, connections, base step, start, algorithm, scenario, and
    FMUs of the same GUID and values. Parameters of Python blocks are not part of it.
    """

    tick: int
    time: float  # s
    belongs: Mapping[str, Any]  # what the resuming diagram must agree in
    values: Mapping[str, Any]  # encoded, by the schedule's labels
    fmus: Mapping[str, bytes]
    outputs: Mapping[str, tuple[float, ...]]

    @classmethod
    def of(
        cls,
        tick: int,
        plan: "Plan",
        scenario: "Scenario",
        schedule: "Schedule",
        values: Sequence[Any],
        instances: Mapping[str, "FmuInstance"],
    ) -> Self:
        """Return the state of a schedule's registers and FMUs; see Simulation.checkpoint."""
        found = {}
        for label, value in zip(schedule.labels, values, strict=True):
            try:
                found[label] = encoded(value)
            except TypeError as error:
                raise CheckpointError(
                    f"checkpoint: {label} cannot be saved: {error}; a block's state is made of "
                    "numbers and tuples"
                ) from None
        return cls(
            tick,
            plan.clock.time(tick),
            identity(plan, scenario),
            found,
            {name: _saved(instance) for name, instance in instances.items()},
            {name: instance.outputs() for name, instance in instances.items()},
        )

    def require(self, plan: "Plan", scenario: "Scenario") -> None:
        """Raise CheckpointError, naming the first difference, if this is of another diagram."""
        wanted, have = dict(self.belongs), identity(plan, scenario)
        for what in have:
            if wanted.get(what) != have[what]:
                raise CheckpointError(
                    f"the checkpoint does not belong to '{plan.name}': {what} was "
                    f"{_difference(wanted.get(what), have[what])}"
                )

    def restore(self, schedule: "Schedule", instances: Mapping[str, "FmuInstance"]) -> list[Any]:
        """Bring the FMUs to the saved state and return the schedule's registers."""
        missing = [label for label in schedule.labels if label not in self.values]
        if missing:
            raise CheckpointError(
                f"the checkpoint has no '{missing[0]}'; was the scenario another one?"
            )
        for name, instance in instances.items():
            handle = instance.from_bytes(self.fmus[name])
            instance.restore(handle)
            instance.release(handle)
            slots = zip(instance.output_slots, self.outputs[name], strict=True)
            for (array, i, convert), value in slots:
                array[i] = convert(value) if convert else value
        return [decoded(self.values[label]) for label in schedule.labels]

    def save(self, path: str | Path) -> Path:
        """Write to a file, whose name ends in .checkpoint, and return its path."""
        path = Path(path)
        if path.suffix != ".checkpoint":
            raise FileError(f"cannot save to {path}: the name must end in .checkpoint")
        state = {
            "format": _FORMAT,
            "tick": self.tick,
            "time": self.time,
            "belongs": self.belongs,
            "values": self.values,
            "outputs": {name: list(values) for name, values in self.outputs.items()},
            "fmus": list(self.fmus),
        }
        part = path.with_name(path.name + ".part")
        try:
            with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("state.json", json.dumps(state))
                for name, data in self.fmus.items():
                    archive.writestr(f"fmus/{name}.bin", data)
            part.replace(path)
        except OSError as error:
            raise FileError(f"cannot write {path}: {error.strerror or error}") from error
        return path

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote; raise FileError if it is none."""
        path = Path(path)
        if not path.is_file():
            raise FileError(f"no file {path}")
        try:
            with zipfile.ZipFile(path) as archive:
                state = json.loads(archive.read("state.json"))
                if state["format"] != _FORMAT:
                    raise FileError(f"{path} has format {state['format']}; this reads {_FORMAT}")
                fmus = {name: archive.read(f"fmus/{name}.bin") for name in state["fmus"]}
            return cls(
                state["tick"],
                state["time"],
                state["belongs"],
                state["values"],
                fmus,
                {name: tuple(values) for name, values in state["outputs"].items()},
            )
        except OSError as error:
            raise FileError(f"cannot read {path}: {error.strerror or error}") from error
        except (zipfile.BadZipFile, zlib.error, KeyError, TypeError, ValueError) as error:
            raise FileError(f"{path} is no checkpoint, or is damaged: {error}") from error


def identity(plan: "Plan", scenario: "Scenario") -> dict[str, Any]:
    """Return what makes a plan this one: its structure, not its blocks' parameters."""
    found: dict[str, Any] = {
        "the name": plan.name,
        "the base step (s)": str(plan.clock.step),
        "the start (s)": str(plan.clock.start),
        "the algorithm": repr(plan.algorithm),
        "the scenario": repr(scenario.changes),
        "the list of blocks": sorted(node.name for node in plan.nodes),
    }
    for node in plan.nodes:
        block = node.block
        found[f"the kind of '{node.name}'"] = type(block).__name__
        drivers = [plan.signals[j] for j in node.inputs]
        found[f"what drives '{node.name}'"] = dict(zip(block.inputs, drivers, strict=True))
        found[f"the period of '{node.name}' (steps)"] = node.ticks
        if isinstance(block, Fmu):
            found[f"the GUID of '{node.name}'"] = block.guid
            found[f"the values given to '{node.name}'"] = repr(block.values)
        elif isinstance(block, Delay):
            found[f"the samples kept by '{node.name}'"] = str(Fraction(node.ring))
    return found


def _difference(was: Any, now: Any) -> str:
    return f"{was!r} and is {now!r} here"


def _saved(instance: "FmuInstance") -> bytes:
    if not instance.can_serialize:
        raise CheckpointError(
            f"checkpoint: block '{instance.name}': {instance.path.name} cannot save its state as "
            "bytes (canSerializeFMUstate)"
        )
    handle = instance.save()
    data = instance.to_bytes(handle)
    instance.release(handle)
    return data
