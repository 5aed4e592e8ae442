"""Pack an FMU: C source, ``modelDescription.xml`` and the compiled library for this machine."""

from __future__ import annotations

import io
import platform
import re
import tempfile
import uuid
import xml.etree.ElementTree as ET
import zipfile
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissordyn.casefile.configuration import write_configuration
from scissordyn.compiler.c import compile_library, compiler_command
from scissordyn.errors import InputError
from scissordyn.exchange.fmu.source import Source, Variable, Variables
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import make_driver

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism

COMPILER_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-fno-strict-aliasing", "-ffp-contract=off")
"""C compiler flags of FMU libraries; products and sums are not contracted, so that results equal those of the package."""

# FMI names of processors, by their names in Python; other names are equal
ARCHITECTURES = {"amd64": "x86_64", "arm64": "aarch64"}
SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}
"""FMI name of each operating system and file ending of its libraries, by its name in Python."""

EXAMPLE = 'contact = "compliant"'  # Correct line of a case file, which error texts show

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
"""Exponents of the SI base units in each unit of an FMU's variables, in the notation of FMI."""

TIME = Variable(0, "time", "s", "time")  # Time [s], the independent variable of every FMU

# FMI attributes of variables that the FMU computes
CALCULATED = {"causality": "local", "variability": "continuous", "initial": "calculated"}
ROLE_ATTRIBUTES = {
    "time": {"causality": "independent", "variability": "continuous"},
    "states": CALCULATED,
    "rates": CALCULATED,
    "guards": CALCULATED,
    "flags": {"causality": "parameter", "variability": "fixed", "initial": "exact"},
    "inputs": {"causality": "input", "variability": "continuous"},
    "outputs": CALCULATED | {"causality": "output"},
}
"""FMI attributes of the variables of each group in `Variables`, and of the time."""

# Value of the FMI attribute `generationTool`: name and version of this package
GENERATION_TOOL = f"scissordyn {version('scissordyn')}"


def fmu(mechanism: Mechanism, run: Options, *, name: str = "mechanism", sources_only: bool = False) -> bytes:
    """Return the content of an FMU (FMI 3.0) of a mechanism, for model exchange and co-simulation."""
    if not sources_only:
        try:
            compiler_command()
        except InputError as error:
            sample = "scissordyn export case.toml unit.fmu --sources"
            raise InputError(
                f"an FMU needs a C compiler: {error.what}", f"{error.expected}, or an FMU with sources only", sample
            ) from None
    tables = plan(mechanism)
    if tables.hard_places:
        name = tables.contacts[tables.hard_places[0]].name
        raise InputError(f"joint '{name}' has hard contact, which an FMU does not support", "compliant contact", EXAMPLE)
    driver, _, _ = make_driver(tables, run)
    identifier = re.sub(r"\W", "_", name) or "mechanism"
    identifier = identifier if identifier[0].isalpha() else f"m_{identifier}"
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, f"scissordyn {name} {mechanism!r} {run!r}")) + "}"
    source = Source(tables, driver, tolerance=float(run.rtol), token=token)
    description = _model_description(
        name,
        identifier,
        token,
        source.variables,
        until=float(run.until),
        tolerance=float(run.rtol),
        exchange=source.delayed_signals == 0,
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr("resources/case.toml", write_configuration(mechanism))
        archive.writestr("sources/model.c", source.text)
        archive.writestr("sources/buildDescription.xml", _build_description(identifier))
        if not sources_only:
            system, ending = SYSTEMS.get(platform.system(), ("linux", ".so"))
            machine = platform.machine().lower()
            folder = f"{ARCHITECTURES.get(machine, machine)}-{system}"
            with tempfile.TemporaryDirectory() as temporary:
                library = Path(temporary, "model.so")
                compile_library(source.text, library, COMPILER_FLAGS)
                archive.write(library, f"binaries/{folder}/{identifier}{ending}")
    return buffer.getvalue()


def _model_description(
    name: str, identifier: str, token: str, variables: Variables, *, until: float, tolerance: float, exchange: bool = True
) -> bytes:
    """Return the content of ``modelDescription.xml`` of an FMU; `exchange` is True if it supports model exchange."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=name,
        instantiationToken=token,
        generationTool=GENERATION_TOOL,
        variableNamingConvention="flat",
        description="planar mechanism with clearance joints",
    )
    capabilities: dict[str, Any] = {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    if exchange:
        ET.SubElement(root, "ModelExchange", modelIdentifier=identifier, needsCompletedIntegratorStep="true", **capabilities)
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true",
        mightReturnEarlyFromDoStep="true",
        **capabilities,
    )
    units = ET.SubElement(root, "UnitDefinitions")
    for unit, exponents in UNITS.items():
        ET.SubElement(ET.SubElement(units, "Unit", name=unit), "BaseUnit", **exponents)
    categories = ET.SubElement(root, "LogCategories")
    for category in ("logStatusError", "logStatusWarning"):
        ET.SubElement(categories, "Category", name=category)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(until), tolerance=repr(tolerance))
    listed = ET.SubElement(root, "ModelVariables")
    for role, rows in {"time": (TIME,), **vars(variables)}.items():
        for k, row in enumerate(rows):
            kind = "Boolean" if role == "flags" else "Float64"
            element = ET.SubElement(listed, kind, name=row.name, valueReference=str(row.reference))
            if row.description:
                element.set("description", row.description)
            element.attrib.update(ROLE_ATTRIBUTES[role])
            if role == "rates":
                element.set("derivative", str(variables.states[k].reference))
            if row.start is not None:
                element.set("start", repr(row.start).lower())
            if row.unit:
                element.set("unit", row.unit)
    structure = ET.SubElement(root, "ModelStructure")
    for tag, rows in (
        ("Output", variables.outputs),
        ("ContinuousStateDerivative", variables.rates),
        ("InitialUnknown", (*variables.states, *variables.rates, *variables.outputs)),
        ("EventIndicator", variables.guards),
    ):
        for row in rows:
            ET.SubElement(structure, tag, valueReference=str(row.reference))
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _build_description(identifier: str) -> bytes:
    """Return the content of ``buildDescription.xml``, which names the source file of the library."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(build, "SourceFileSet", language="C99")
    ET.SubElement(files, "SourceFile", name="model.c")
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))
