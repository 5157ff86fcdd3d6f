"""modelDescription.xml of a plant's FMU."""

import re
from collections.abc import Iterable
from xml.etree import ElementTree as ET
from xml.sax.saxutils import escape

from ..base import units
from ..models.plant import Plant
from .code import GUID_MARK
from .functions import Functions
from .layout import SOLVER, Layout, Scalar

LOG_CATEGORIES = {
    "logEvents": "every event that fires, with its time",
    "logStatusWarning": "values outside their bounds",
    "logStatusDiscard": "requests that were not carried out",
    "logStatusError": "errors",
    "logStatusFatal": "errors after which nothing works",
    "logAll": "all of these",
}
_SETTINGS = {
    "inner_step": ("largest inner step of the solver", "s", "1e-09"),
    "relative_tolerance": ("tolerated error of a step, relative to the state", "1", "1e-15"),
    "absolute_tolerance": ("tolerated error of a step, in nominal values", "1", "1e-15"),
}
_ALSO_ESCAPED = {'"': "&quot;", "\r": "&#13;", "\n": "&#10;", "\t": "&#09;"}
_SPECIAL = re.compile(r'[&<>"\r\n\t]')


def model_description(functions: Functions, tool: str) -> str:
    """Return the XML text, with GUID_MARK where the GUID belongs."""
    layout, plant = functions.layout, functions.plant
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=plant.name,
        guid=GUID_MARK,
        description=plant.description,
        generationTool=tool,
        variableNamingConvention="structured",
        numberOfEventIndicators=str(sum(e.size for e in plant.events if e.kind == "state")),
    )
    _interfaces(root, plant)
    _units(root, layout)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    ET.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(plant.stop),
        stepSize=repr(plant.step),
    )
    index = _variables(root, layout)
    _structure(root, functions, index)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    _write(root, "", lines)
    return "\n".join(lines) + "\n"


def _write(element: ET.Element, indent: str, lines: list[str]) -> None:
    """Add the lines of an element with attributes and elements in it, but no text.

    They are those of ET.indent and ET.tostring, which take long for many thousand variables.
    """
    values = element.attrib
    if _SPECIAL.search("".join(values.values())):
        values = {key: escape(value, _ALSO_ESCAPED) for key, value in values.items()}
    start = "".join([f"{indent}<{element.tag}", *[f' {k}="{v}"' for k, v in values.items()]])
    if not len(element):
        lines.append(f"{start} />")
        return
    lines.append(f"{start}>")
    for inner in element:
        _write(inner, f"{indent}  ", lines)
    lines.append(f"{indent}</{element.tag}>")


def _interfaces(root: ET.Element, plant: Plant) -> None:
    """Write <ModelExchange>, where the plant has it, and <CoSimulation>, with what both can do."""
    both = {
        "modelIdentifier": plant.name,
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    steps = "false" if plant.events or plant.updates else "true"
    if not plant.frictions:
        only = {"completedIntegratorStepNotNeeded": steps}
        _sources(ET.SubElement(root, "ModelExchange", both | only))
    co_simulation = ET.SubElement(
        root,
        "CoSimulation",
        both,
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true",
        # Memories that jump after each step leave outputs without a derivative to speak of.
        maxOutputDerivativeOrder="0" if plant.updates else "1",
    )
    _sources(co_simulation)


def _sources(interface: ET.Element) -> None:
    ET.SubElement(ET.SubElement(interface, "SourceFiles"), "File", name="fmu.c")


def derivative_unit(unit: str) -> str:
    """Return the unit of a time derivative: "m" -> "m/s", "m/s" -> "m/s2"."""
    numerator, slash, denominator = unit.partition("/")
    if not slash:
        return "K/s" if unit == "degC" else f"{unit}/s"
    factors = denominator.strip("()").split(".")
    for i, factor in enumerate(factors):
        if factor == "s" or (factor.startswith("s") and factor[1:].isdigit()):
            factors[i] = f"s{int(factor[1:] or 1) + 1}"
            break
    else:
        factors.append("s")
    body = ".".join(factors)
    return f"{numerator}/({body})" if len(factors) > 1 else f"{numerator}/{body}"


def _unit_of(scalar: Scalar) -> str:
    unit = scalar.variable.unit
    return derivative_unit(unit) if scalar.derivative_of is not None else unit


def _units(root: ET.Element, layout: Layout) -> None:
    names = {"1", "s"} | {v.unit for v in layout.plant.variables()}
    names |= {derivative_unit(v.unit) for v in layout.plant.variables("state")}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(names):
        unit = ET.SubElement(definitions, "Unit", name=name)
        attributes = {key: repr(value) for key, value in units.parse(name).base_unit().items()}
        ET.SubElement(unit, "BaseUnit", attributes)


def _variables(root: ET.Element, layout: Layout) -> dict[int, int]:
    """Write <ModelVariables>; return the 1-based index of each value reference."""
    element = ET.SubElement(root, "ModelVariables")
    index: dict[int, int] = {}
    resets = {name for event in layout.plant.events for name in event.changes}
    blocks = (
        layout.inputs, layout.outputs, layout.states, layout.derivatives, layout.discrete,
        layout.parameters, layout.dependents,
    )  # fmt: skip
    for number, scalar in enumerate((s for block in blocks for s in block), start=1):
        index[scalar.reference] = number
        _scalar(element, scalar, index, resets)
    for name, (reference, value) in layout.settings.items():
        description, unit, low = _SETTINGS[name]
        setting = ET.SubElement(
            element,
            "ScalarVariable",
            name=f"{SOLVER}{name}",
            valueReference=str(reference),
            description=description,
            causality="parameter",
            variability="fixed",
            initial="exact",
        )
        ET.SubElement(setting, "Real", unit=unit, start=repr(value), min=low)
    return index


def _causality(scalar: Scalar) -> str:
    v = scalar.variable
    if scalar.derivative_of is not None:
        return "local"
    if v.kind == "output" or v.exposed:
        return "output"
    names = {"parameter": "parameter", "dependent": "calculatedParameter", "input": "input"}
    return names.get(v.kind, "local")


def _scalar(element: ET.Element, scalar: Scalar, index: dict[int, int], resets: set[str]) -> None:
    v, i = scalar.variable, scalar.index
    attributes = {"name": scalar.name, "valueReference": str(scalar.reference)}
    if v.description and scalar.derivative_of is None:
        attributes["description"] = v.description
    attributes["causality"] = _causality(scalar)
    attributes["variability"] = v.variability
    if v.kind != "input":
        attributes["initial"] = "calculated" if scalar.is_computed else "exact"
    parent = ET.SubElement(element, "ScalarVariable", attributes)
    if v.kind == "mode":
        numbers = {"min": v.minimum, "max": v.maximum, "start": v.start}
        values = {k: str(int(n[i])) for k, n in numbers.items() if n is not None}
        ET.SubElement(parent, "Integer", values)
        return
    real = {"unit": _unit_of(scalar)}
    if scalar.derivative_of is not None:
        real["derivative"] = str(index[scalar.derivative_of])
    else:
        bounds = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal}
        real |= {key: repr(numbers[i]) for key, numbers in bounds.items() if numbers is not None}
        if not scalar.is_computed and v.start is not None:
            real["start"] = repr(v.start[i])
        if v.kind == "state" and v.name in resets:
            real["reinit"] = "true"
    ET.SubElement(parent, "Real", real)


def _structure(root: ET.Element, functions: Functions, index: dict[int, int]) -> None:
    """Write <ModelStructure>: what depends on what, from the sparsity of the Jacobians."""
    layout = functions.layout
    known = {s.reference for s in (*layout.states, *layout.inputs)}
    blocks = (
        (layout.derivatives, functions.rhs),
        (layout.outputs, functions.outputs),
        (layout.dependents, functions.dependents),
    )
    rows = {
        scalar.reference: row
        for scalars, function in blocks
        if scalars
        for scalar, row in zip(scalars, functions.dependencies(function), strict=True)
    }
    structure = ET.SubElement(root, "ModelStructure")

    def unknown(parent: ET.Element, reference: int, depends: Iterable[int]) -> None:
        numbers = " ".join(str(n) for n in sorted(index[d] for d in depends))
        ET.SubElement(parent, "Unknown", index=str(index[reference]), dependencies=numbers)

    outputs = ET.SubElement(structure, "Outputs")
    for scalar in layout.outputs:
        unknown(outputs, scalar.reference, known.intersection(rows[scalar.reference]))
    for scalar in layout.exposed:
        unknown(outputs, scalar.reference, known & {scalar.reference})
    if layout.derivatives:
        derivatives = ET.SubElement(structure, "Derivatives")
        for scalar in layout.derivatives:
            unknown(derivatives, scalar.reference, known.intersection(rows[scalar.reference]))
    if rows:
        initial = ET.SubElement(structure, "InitialUnknowns")
        for reference in sorted(rows, key=lambda r: index[r]):
            unknown(initial, reference, rows[reference])
