"""``modelDescription.xml`` of a unit, and which source makes its library."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib.metadata import version
from typing import Any

from scissordyn.exchange.fmu.variable import Variable, Variables

UNITS: dict[str, dict[str, Any]] = {
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "m/s2": {"m": "1", "s": "-2"},
    "rad": {"rad": "1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "rad/s2": {"rad": "1", "s": "-2"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "s": {"s": "1"},
}
"""Exponents of the base units."""

TOOL = f"scissordyn {version('scissordyn')}"


def model_description(
    name: str, identifier: str, token: str, found: Variables, *, until: float, tolerance: float, exchange: bool = True
) -> bytes:
    """The description of a unit."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=name,
        instantiationToken=token,
        generationTool=TOOL,
        variableNamingConvention="flat",
        description="a mechanism with joints as they are",
    )
    able: dict[str, Any] = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    if exchange:
        ET.SubElement(root, "ModelExchange", modelIdentifier=identifier, needsCompletedIntegratorStep="true", **able)
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true",
        mightReturnEarlyFromDoStep="true",
        **able,
    )
    units = ET.SubElement(root, "UnitDefinitions")
    for unit, exponents in UNITS.items():
        ET.SubElement(ET.SubElement(units, "Unit", name=unit), "BaseUnit", **exponents)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(until), tolerance=repr(tolerance))
    _add_variables(ET.SubElement(root, "ModelVariables"), found)
    structure = ET.SubElement(root, "ModelStructure")
    for tag, rows in (
        ("Output", found.outputs),
        ("ContinuousStateDerivative", found.rates),
        ("InitialUnknown", (*found.states, *found.rates, *found.outputs)),
        ("EventIndicator", found.guards),
    ):
        for row in rows:
            ET.SubElement(structure, tag, valueReference=str(row.reference))
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _add_variables(parent: ET.Element, found: Variables) -> None:
    time = Variable("time", 0, "s", "time")
    _float(parent, time, causality="independent", variability="continuous")
    for entry in found.states:
        _float(parent, entry, causality="local", variability="continuous", initial="calculated")
    for entry, state in zip(found.rates, found.states, strict=True):
        rate = {"derivative": str(state.reference)}
        _float(parent, entry, causality="local", variability="continuous", initial="calculated", **rate)
    for entry in found.guards:
        _float(parent, entry, causality="local", variability="continuous", initial="calculated")
    for entry in found.flags:
        element = _element(parent, "Boolean", entry)
        element.attrib.update(causality="parameter", variability="fixed", initial="exact", start="false")
    for entry in found.inputs:
        _float(parent, entry, causality="input", variability="continuous", start=repr(entry.start))
    for entry in found.outputs:
        _float(parent, entry, causality="output", variability="continuous", initial="calculated")


def _element(parent: ET.Element, tag: str, each: Variable) -> ET.Element:
    element = ET.SubElement(parent, tag, name=each.name, valueReference=str(each.reference))
    if each.description:
        element.set("description", each.description)
    return element


def _float(parent: ET.Element, each: Variable, **attributes: str) -> None:
    element = _element(parent, "Float64", each)
    element.attrib.update(attributes)
    if each.unit:
        element.set("unit", each.unit)


def build_description(identifier: str) -> bytes:
    """Which source makes the library, for whoever compiles it."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(build, "SourceFileSet", language="C99")
    ET.SubElement(files, "SourceFile", name="model.c")
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))
