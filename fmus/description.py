"""modelDescription.xml of a plant's FMU."""

from xml.etree import ElementTree as ET

from ..base import units
from .code import GUID_MARK
from .layout import INNER_STEP, Layout, Scalar

LOG_CATEGORIES = ("logStatusWarning", "logStatusError", "logAll")


def model_description(layout: Layout, inner_step: float, tool: str) -> str:
    """Return the XML text, with GUID_MARK where the GUID belongs."""
    plant = layout.plant
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=plant.name,
        guid=GUID_MARK,
        description=plant.description,
        generationTool=tool,
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    kind = ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=plant.name,
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    ET.SubElement(ET.SubElement(kind, "SourceFiles"), "File", name="fmu.c")
    _units(root, layout)
    categories = ET.SubElement(root, "LogCategories")
    for name in LOG_CATEGORIES:
        ET.SubElement(categories, "Category", name=name)
    ET.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(plant.stop),
        stepSize=repr(plant.step),
    )
    index = _variables(root, layout, inner_step)
    _structure(root, layout, index)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


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
    names = {"s"} | {v.unit for v in layout.plant.variables()}
    names |= {derivative_unit(v.unit) for v in layout.plant.variables("state")}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(names):
        unit = ET.SubElement(definitions, "Unit", name=name)
        attributes = {key: repr(value) for key, value in units.parse(name).base_unit().items()}
        ET.SubElement(unit, "BaseUnit", attributes)


def _variables(root: ET.Element, layout: Layout, inner_step: float) -> dict[int, int]:
    """Write <ModelVariables>; return the 1-based index of each value reference."""
    element = ET.SubElement(root, "ModelVariables")
    index: dict[int, int] = {}
    blocks = (layout.inputs, layout.outputs, layout.states, layout.derivatives, layout.parameters)
    for number, scalar in enumerate((s for block in blocks for s in block), start=1):
        index[scalar.reference] = number
        _scalar(element, layout, scalar, index)
    solver = ET.SubElement(
        element,
        "ScalarVariable",
        name=INNER_STEP,
        valueReference=str(layout.first_solver),
        description="largest inner step of the Runge-Kutta solver",
        causality="parameter",
        variability="fixed",
        initial="exact",
    )
    ET.SubElement(solver, "Real", unit="s", start=repr(inner_step), min="1e-9")
    return index


def _scalar(element: ET.Element, layout: Layout, scalar: Scalar, index: dict[int, int]) -> None:
    v, i = scalar.variable, scalar.index
    derivative = scalar.derivative_of is not None
    is_output = v.kind == "output" or (v.name in layout.plant.output_states and not derivative)
    computed = derivative or v.kind == "output"
    causality = (
        "parameter" if v.kind == "parameter" else "input" if v.kind == "input"
        else "output" if is_output else "local"
    )  # fmt: skip
    attributes = {"name": scalar.name, "valueReference": str(scalar.reference)}
    if v.description and not derivative:
        attributes["description"] = v.description
    attributes["causality"] = causality
    attributes["variability"] = v.variability
    if v.kind != "input":
        attributes["initial"] = "calculated" if computed else "exact"
    real = {"unit": _unit_of(scalar)}
    if scalar.derivative_of is not None:
        real["derivative"] = str(index[scalar.derivative_of])
    else:
        bounds = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal}
        real |= {key: repr(numbers[i]) for key, numbers in bounds.items() if numbers is not None}
        if not computed and v.start is not None:
            real["start"] = repr(v.start[i])
    ET.SubElement(ET.SubElement(element, "ScalarVariable", attributes), "Real", real)


def _structure(root: ET.Element, layout: Layout, index: dict[int, int]) -> None:
    """Write <ModelStructure>: what depends on what, from the sparsity of the Jacobians."""
    known = {s.reference for s in (*layout.states, *layout.inputs)}
    rows = dict(
        zip(
            (s.reference for s in (*layout.derivatives, *layout.outputs)),
            (
                *layout.dependencies(layout.rhs()),
                *layout.dependencies(layout.outputs_function()),
            ),
            strict=True,
        )
    )
    output_states = [s for s in layout.states if s.variable.name in layout.plant.output_states]
    structure = ET.SubElement(root, "ModelStructure")

    def unknown(parent: ET.Element, reference: int, depends: list[int]) -> None:
        numbers = " ".join(str(n) for n in sorted(index[d] for d in depends))
        ET.SubElement(parent, "Unknown", index=str(index[reference]), dependencies=numbers)

    outputs = ET.SubElement(structure, "Outputs")
    for scalar in layout.outputs:
        row = [r for r in rows[scalar.reference] if r in known]
        unknown(outputs, scalar.reference, row)
    for scalar in output_states:
        unknown(outputs, scalar.reference, [scalar.reference])
    if layout.derivatives:
        derivatives = ET.SubElement(structure, "Derivatives")
        for scalar in layout.derivatives:
            row = [r for r in rows[scalar.reference] if r in known]
            unknown(derivatives, scalar.reference, row)
    if rows:
        initial = ET.SubElement(structure, "InitialUnknowns")
        for reference in sorted(rows, key=lambda r: index[r]):
            unknown(initial, reference, rows[reference])
