"""A unit as a file: source, description and, where there is a compiler, the library for this machine."""

from __future__ import annotations

import io
import platform
import re
import tempfile
import uuid
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

from scissordyn.compiler.c import compile_library, compiler_command
from scissordyn.errors import InputError
from scissordyn.exchange.fmu.description import build_description, model_description
from scissordyn.exchange.fmu.source import Source
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import make_driver
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import Options

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-fno-strict-aliasing", "-ffp-contract=off")
"""No contraction of products and sums: the numbers are to be those of the package."""

ARCHITECTURES = {"amd64": "x86_64", "arm64": "aarch64"}
SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}

SAMPLE = 'contact = "compliant"'


def fmu(mechanism: Mechanism, run: Options, *, name: str = "mechanism", sources_only: bool = False) -> bytes:
    """A functional mock-up unit (FMI 3.0) of a mechanism, for model exchange and for co-simulation."""
    if not sources_only:
        try:
            compiler_command()
        except InputError as error:
            sample = "scissordyn export case.toml unit.fmu --sources"
            raise InputError(
                f"an FMU needs a C compiler: {error.what}", f"{error.allowed}, or the sources alone", sample
            ) from None
    tables = plan(mechanism)
    if tables.hard_places:
        name = tables.contacts[tables.hard_places[0]].name
        raise InputError(f"joint '{name}' with hard contact, for which an FMU has no equations", "compliant contact", SAMPLE)
    driver, _, _ = make_driver(tables, run)
    identifier = re.sub(r"\W", "_", name) or "mechanism"
    identifier = identifier if identifier[0].isalpha() else f"m_{identifier}"
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, f"scissordyn {name} {mechanism!r} {run!r}")) + "}"
    source = Source(tables, driver, tolerance=float(run.rtol), token=token)
    description = model_description(
        name,
        identifier,
        token,
        source.variables,
        until=float(run.until),
        tolerance=float(run.rtol),
        exchange=source.looks_back == 0,
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr("resources/case.toml", write_configuration(mechanism))
        archive.writestr("sources/model.c", source.text)
        archive.writestr("sources/buildDescription.xml", build_description(identifier))
        if not sources_only:
            system, ending = SYSTEMS.get(platform.system(), ("linux", ".so"))
            machine = platform.machine().lower()
            folder = f"{ARCHITECTURES.get(machine, machine)}-{system}"
            archive.writestr(f"binaries/{folder}/{identifier}{ending}", compiled_library(source.text))
    return buffer.getvalue()


def compiled_library(source: str, flags: tuple[str, ...] = FLAGS) -> bytes:
    """The shared library of a C source."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, "model.so")
        compile_library(source, target, flags)
        return target.read_bytes()
