"""Pages that are made from declarations: the catalogue of laws and controllers, and the API."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
import sys
from pathlib import Path

import scissordyn as sd
from scissordyn.annotation import shown
from scissordyn.casefile.table import table_of
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.units import quantities

sys.path.insert(0, str(Path(__file__).parent))
from _tables import key_rows

__all__ = ["GROUPS", "MODULES", "catalogue_page", "fields", "write"]

GROUPS: dict[str, tuple[str, ...]] = {
    "Structures": (
        "zoo",
        "scissor",
        "mast",
        "polar_scissor",
        "hoberman_ring",
        "slider_crank",
        "four_bar",
        "n_four_bar",
        "common_pin",
        "angulated_bar",
        "with_panels",
        "with_payload",
        "with_bending",
        "with_joint_friction",
        "with_backlash",
    ),
    "Mechanisms": (
        "Mechanism",
        "Body",
        "bar",
        "point_mass",
        "Revolute",
        "Guide",
        "Weld",
        "Track",
        "Drive",
        "Coupling",
        "Teeth",
        "Belt",
        "Screw",
        "FurtherInput",
        "CoordinateDrive",
        "RelativeAngle",
        "Slide",
        "Distance",
    ),
    "Clearance joints": ("Clearance", "GuideClearance", "Material", "STEEL", "Lubrication", "Oil"),
    "Bars that bend": (
        "FlexibleBar",
        "Beam",
        "Section",
        "StructuralMaterial",
        "Roller",
        "internal_forces",
        "modes",
        "buckling",
    ),
    "Laws": (
        "law",
        "Liu",
        "Hertz",
        "Flores",
        "LankaraniNikravesh",
        "Ambrosio",
        "LuGre",
        "NoFriction",
        "element",
    ),
    "Components": (
        "Spring",
        "TorsionSpring",
        "TapeSpring",
        "ConstantForceSpring",
        "Cable",
        "Bushing",
        "Rod",
        "Latch",
        "AngleStop",
        "TravelStop",
        "Force",
        "Drag",
        "Torque",
        "PinFriction",
        "GuideFriction",
        "PinLuGre",
        "GuideLuGre",
        "NonlinearSpring",
        "GasSpring",
        "StrokeLoad",
        "AngleLoad",
        "Motor",
        "TabulatedMotor",
        "LinearMotor",
        "Cam",
        "EdgeContact",
        "Actuator",
        "Clutch",
        "component",
        "Output",
        "State",
    ),
    "Motions": ("ConstantSpeed", "Harmonic", "Polynomial", "Cycloidal", "Trapezoidal", "Tabulated", "tabulated"),
    "Controllers": (
        "controller",
        "PID",
        "FeedForward",
        "Pyragas",
        "ExtendedDelayedFeedback",
        "NoControl",
        "feed_forward",
    ),
    "Simulation": (
        "simulate",
        "Options",
        "Checkpoint",
        "simulate_many",
        "replay",
        "cycle",
        "ideal_kinematics",
        "statics",
        "inverse_dynamics",
        "constrain_contact",
        "convergence",
        "save",
        "load",
    ),
    "Case files": ("read_case", "write_case", "case_text", "Case"),
    "Identification": ("fit", "Measured", "prediction"),
    "Pictures and films": ("preview", "plot", "style", "animate", "view"),
    "Studies": (
        "study",
        "open_study",
        "Interval",
        "Levels",
        "Names",
        "Empirical",
        "Fit",
        "Threads",
        "Processes",
        "Cluster",
    ),
    "Periodic motion": ("bifurcation", "ensemble", "separation_exponent", "variational_exponent"),
    "Wear": ("Wear", "wear"),
    "Analysis": (
        "classify",
        "consensus",
        "contact_statistics",
        "figures_of_merit",
        "torque_over_speed",
        "least_value",
        "MotorCurve",
        "section",
        "spectrum",
        "stroboscopic",
        "zero_one_test",
    ),
    "Other programs": (
        "read_drawing",
        "read_pmks",
        "read_dxf",
        "read_mjcf",
        "read_linkage2",
        "read_slvs",
        "read_points",
        "export",
        "pin_forces",
    ),
    "Units and errors": ("degrees", "rpm", "Quantity", "Pairs", "InputError", "ScissordynError"),
}
"""The public names; what no group has is listed under the last heading."""

FIRST = {
    "scissor": "array = sd.scissor(units=2, bar_length=2.0, angle=sd.degrees(30))",
    "Clearance": "joint = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.05))",
    "Mechanism.with_clearance": 'loose = array.with_clearance("A", joint)',
    "Mechanism.driven": "driven = loose.driven(speed=sd.rpm(150))",
    "preview": "sd.preview(driven)",
    "simulate": "run = sd.simulate(driven, until=0.05)",
    "plot.force": 'sd.plot.force(run, joint="A")',
    "Mechanism.replace": 'smaller = driven.replace("A.clearance", 0.2e-3)',
    "study": 'found = sd.study(driven, until=0.05, factors={"A.clearance": (1e-4, 5e-4)}, measures=["peak_force"], points=8)',
    "save": 'sd.save(run, "run.nc")',
}
"""The ten functions that a new user needs first, in the order of use, with a line that calls each."""

MODULES: dict[str, dict[str, tuple[str, ...]]] = {
    "Results of studies": {
        "studies.result": ("StudyResult",),
        "studies.answer.report": ("StudyPictures",),
    },
    "Samples and maps": {
        "analysis.recurrence": ("recurrence",),
        "analysis.scatter": ("velocity_acceleration",),
        "analysis.verdict": ("classify_samples",),
        "analysis.lyapunov": ("exponent_from_growth",),
    },
    "Kernels": {
        "kernel": ("kernel", "equals"),
    },
    "Pictures": {
        "record.accessor": ("RunAccessor",),
        "plot": (
            *("response", "track", "force", "torque", "orbit", "film", "energy"),
            *("structure", "bending", "comparison", "statics"),
        ),
        "plot.wear": ("profile", "history"),
        "plot.regularity": (
            "stroboscopic_map",
            "power_spectrum",
            "zero_one",
            "recurrence_plot",
            "bifurcation",
            "distribution",
            "velocity_acceleration",
        ),
    },
}
"""What is imported from modules, by heading and module."""

ORPHAN = ("---", "orphan: true", "---", "")
"""Front matter of pages that the side bar leaves out."""

MEMBERS = ("Mechanism", "RunAccessor", "StudyPictures", "StudyResult")
"""Classes whose methods are listed."""

ALL_MEMBERS = ("   :members:", "   :inherited-members:")
"""Options of `autoclass` that list the methods of a class and of those that it extends."""


def groups() -> dict[str, tuple[str, ...]]:
    """All public names by heading."""
    known = {name for names in GROUPS.values() for name in names}
    rest = tuple(name for name in sd.__all__ if name not in known)
    there = {heading: tuple(name for name in names if name in sd.__all__) for heading, names in GROUPS.items()}
    return {**there, **({"Other": rest} if rest else {})}


def fields(cls: type) -> list[str]:
    """The fields of a dataclass with their units, for a class whose docstring does not list them."""
    if not dataclasses.is_dataclass(cls) or "Parameters\n" in (cls.__doc__ or ""):
        return []
    lines = ["", ".. rubric:: Fields", ""]
    known = quantities(cls)
    for field in dataclasses.fields(cls):
        quantity = known.get(field.name)
        default = "" if field.default is dataclasses.MISSING else f"; default {shown(field.default)}"
        words = getattr(quantity, "help", "") or ""
        unit = f" [{quantity.unit}]" if quantity is not None and quantity.unit != "1" else ""
        lines.append(f"* **{field.name}**: {words}{unit}{default}")
    return [*lines, ""] if dataclasses.fields(cls) else []


def literal_formulas(lines: list[str]) -> list[str]:
    """A docstring whose indented paragraphs are literal, line by line, unless they belong to a directive."""
    out: list[str] = []
    kept = False  # whether an indented paragraph belongs to what stands above it
    for k, line in enumerate(lines):
        begins = bool(line.strip()) and (k == 0 or not lines[k - 1].strip())
        if begins and not line.startswith(" "):
            kept = line.startswith(("..", "* ", "- ")) or re.match(r"\d+\. ", line) is not None
            # the sections of numpydoc are indented below their names
            kept = kept or (k + 1 < len(lines) and lines[k + 1].startswith("---"))
        elif begins and not kept:
            out += ["::", ""]
            kept = True
        out.append(line)
        if line.strip() and not line.startswith(" ") and k + 1 < len(lines) and lines[k + 1].startswith("---"):
            return [*out, *lines[k + 1 :]]
    return out


def _dedented(text: str) -> str:
    return inspect.cleandoc(text)


def _as_myst(text: str) -> str:
    """A docstring with `.. math::` blocks as MyST."""
    out: list[str] = []
    block: list[str] | None = None
    for line in [*_dedented(text).splitlines(), ""]:
        if block is not None:
            if line.strip() and line.startswith("    "):
                block.append(line.strip())
                continue
            if not line.strip() and not block:
                continue
            if not line.strip():
                # a blank line inside a directive separates two equations
                block.append("")
                continue
            out += _math(block)
            block = None
        if line.lstrip().startswith(".. math::"):
            block = [line.split("::", 1)[1].strip()] if line.split("::", 1)[1].strip() else []
            continue
        out.append(re.sub(r"(?<!`)``([^`]+)``(?!`)", r"`\1`", line))
    if block is not None:
        out += _math(block)
    return "\n".join(out)


def _math(block: list[str]) -> list[str]:
    parts = [part.strip() for part in "\n".join(block).strip().split("\n\n") if part.strip()]
    return [line for part in parts for line in ("", "$$", part, "$$", "")]


def catalogue_page() -> str:
    """Every law and controller: its equation as its declaration has it, its source, its internal states and parameters."""
    parts = ["# Catalogue of laws and controllers", ""]
    parts += ["Made from the declarations; `scissordyn laws NAME` and `scissordyn controllers NAME` print the same.", ""]
    titles = {"stiffness": "Elastic part", "damping": "Damping", "friction": "Friction", "controller": "Controllers"}
    for kind, classes in {**BY_KIND, "controller": CONTROLLERS}.items():
        parts += [f"## {titles[kind]}", ""]
        for name, cls in sorted(classes.items()):
            parts += [f"### {name}", "", _as_myst(cls.__doc__ or ""), "", f"*Source:* {cls.source}.", ""]
            if states := ", ".join(f"`{state.name}` [{state.unit}]" for state in cls.declaration.states):
                parts += [f"*Internal states:* {states}.", ""]
            header, rule, *rows = key_rows(table_of(cls))
            if rows:
                parts += [header.replace("key", "parameter"), rule, *rows, ""]
    return "\n".join(parts) + "\n"


def api_page(heading: str, names: tuple[str, ...]) -> str:
    """The public names under one heading."""
    lines = [*ORPHAN, f"# {heading}", "", "```{eval-rst}", ".. currentmodule:: scissordyn", ""]
    for name in names:
        value = getattr(sd, name)
        # `study` is a room that is called
        routine = inspect.isroutine(value) or (inspect.ismodule(value) and callable(value))
        kind = "autoclass" if inspect.isclass(value) else "autofunction" if routine else "autodata"
        lines += [f".. {kind}:: {name}"]
        if kind == "autoclass":
            lines += ALL_MEMBERS if name in MEMBERS else []
        lines.append("")
    return "\n".join([*lines, "```", ""])


def modules_page(heading: str, modules: dict[str, tuple[str, ...]]) -> str:
    """The names that are imported from modules, under one heading."""
    lines = [*ORPHAN, f"# {heading}", ""]
    for module, names in modules.items():
        found = importlib.import_module(f"scissordyn.{module}")
        lines += [f"## scissordyn.{module}", "", "```{eval-rst}", f".. currentmodule:: scissordyn.{module}", ""]
        for name in names:
            kind = "autoclass" if inspect.isclass(getattr(found, name)) else "autofunction"
            lines += [f".. {kind}:: {name}", *(ALL_MEMBERS if name in MEMBERS else []), ""]
        lines += ["```", ""]
    return "\n".join(lines)


INTRODUCTION = """\
This page lists the public names with a sentence each. They are imported from `scissordyn` (`import scissordyn as sd`), those of
the last groups from its modules. Values are in SI units and radians; `sd.degrees(30)` and `sd.rpm(150)` convert."""


def _value(name: str) -> object:
    """Return what a dotted name of the package means."""
    value: object = sd
    for part in name.split("."):
        value = getattr(value, part)
    return value


def _link(name: str) -> str:
    """Return a name as a link to its description."""
    return f"{{py:obj}}`{name} <scissordyn.{name}>`"


def _first_sentence(value: object) -> str:
    """Return the first sentence of a docstring, for the cell of a table."""
    first = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split())
    sentence = re.split(r"(?<=[.])\s+(?=[A-Z])", first)[0]
    return re.sub(r"``([^`]+)``", r"`\1`", sentence).replace("|", "\\|")


def write(docs: Path) -> None:
    """Write the pages, leaving those that have not changed, and delete those of headings that are gone."""
    pages = {docs / "theory" / "catalogue.md": catalogue_page()}
    lines = ["# API", "", INTRODUCTION, "", "## First", "", "| name | does | example |", "| --- | --- | --- |"]
    lines += [f"| {_link(name)} | {_first_sentence(_value(name))} | `{line}` |" for name, line in FIRST.items()]
    for heading, members in groups().items():
        stem = heading.lower().replace(" ", "_")
        lines += ["", f"## [{heading}]({stem}.md)", "", "| name | |", "| --- | --- |"]
        lines += [f"| {_link(name)} | {_first_sentence(getattr(sd, name))} |" for name in members]
        pages[docs / "api" / f"{stem}.md"] = api_page(heading, members)
    lines += ["", "## In modules", ""]
    for heading, modules in MODULES.items():
        stem = heading.lower().replace(" ", "_")
        lines.append(f"* [{heading}]({stem}.md): {', '.join(f'`scissordyn.{name}`' for name in modules)}")
        pages[docs / "api" / f"{stem}.md"] = modules_page(heading, modules)
    pages[docs / "api" / "index.md"] = "\n".join([*lines, ""])
    for path, text in pages.items():
        path.parent.mkdir(exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for old in set((docs / "api").glob("*.md")) - set(pages):
        old.unlink()
