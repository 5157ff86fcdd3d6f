"""What an FMU says of itself, as text."""

import textwrap
import zipfile
from collections.abc import Sequence
from pathlib import Path

from ..cosim.fmu.file import read_description, unit_of

_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "maxOutputDerivativeOrder",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
    "canBeInstantiatedOnlyOncePerProcess",
    "needsExecutionTool",
)


def describe(path: Path) -> str:
    """Return the FMU's kind, platforms, capabilities, variables; raise FmuError if unreadable."""
    d = read_description(path)
    kinds = {
        kind: interface
        for kind, interface in (
            ("co-simulation", d.coSimulation),
            ("model exchange", d.modelExchange),
        )
        if interface is not None
    }
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    platforms = sorted({n.split("/")[1] for n in names if n.startswith("binaries/") and n[9:]})
    lines = [
        f"{d.modelName}: {d.description or 'no description'}",
        f"  FMI {d.fmiVersion}, {' and '.join(kinds) or 'no interface'}",
        f"  GUID {d.guid}, made by {d.generationTool or 'unknown'}",
        f"  platforms: {', '.join(platforms) or 'none'}"
        + ("; with sources" if any(n.startswith("sources/") for n in names) else ""),
    ]
    for kind, interface in kinds.items():
        declared = [name for name in _CAPABILITIES if getattr(interface, name, False)]
        text = f"  {kind}: {', '.join(declared) or 'no capability declared'}"
        lines += textwrap.wrap(text, 100, subsequent_indent="    ", break_on_hyphens=False)
    if d.modelExchange is not None:
        states, indicators = d.numberOfContinuousStates, d.numberOfEventIndicators or 0
        lines.append(f"  {states} continuous states, {indicators} event indicators")
    if d.defaultExperiment is not None:
        e = d.defaultExperiment
        lines.append(f"  default experiment: stop {e.stopTime} s, step {e.stepSize} s")
    heads = ("variable", "causality", "variability", "unit", "start", "min", "max", "description")
    rows: list[tuple[str, ...]] = [heads]
    for v in d.modelVariables:
        cells = (
            v.name,
            v.causality,
            v.variability,
            unit_of(v),
            v.start,
            v.min,
            v.max,
            v.description,
        )
        rows.append(tuple("" if cell is None else str(cell) for cell in cells))
    return "\n".join([*lines, "", *table(rows)])


def table(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> list[str]:
    """Return rows of cells as lines of aligned columns, those in `right` to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  "
        + "  ".join(
            cell.rjust(w) if i in right else cell.ljust(w)
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
