"""Export runs and mechanisms to other programs, in the format of the file's ending; DXF drawings and cut lists of bars."""

from __future__ import annotations

import io
import math
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.place import Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.exchange import forces as of_pins
from scissordyn.exchange.assembly import add_assembly, left_out
from scissordyn.exchange.mjcf_text import mjcf
from scissordyn.file.export import export as export_table
from scissordyn.file.output_file import check_target, write_file
from scissordyn.lookup import library
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.units import checked

FORCE_ENDINGS = (".csv", ".json", ".inp")  # File name endings of the formats for pin forces
MECHANISM_ENDINGS = (".dxf", ".csv", ".xml", ".fmu")  # File name endings of the formats for mechanisms


def check_ending(path: str | os.PathLike[str], allowed: tuple[str, ...], what: str, sample: str) -> str:
    """Return the lower-case ending of a file name; raise `InputError` if it is not allowed."""
    ending = Path(path).suffix.lower()
    if ending not in allowed:
        raise InputError(
            f"cannot write {what} to '{path}'{did_you_mean(ending, allowed)}",
            "a name that ends in " + ", ".join(allowed),
            sample,
        )
    return ending


@checked
def export(
    what: Any,
    path: str | os.PathLike[str],
    *,
    contacts: bool = False,
    forces: bool = False,
    envelope: bool = False,
    mechanism: Mechanism | None = None,
    run: Options | None = None,
    section: str = "",
    material: str = "steel",
    pin_radius: float | None = None,
    width: float | None = None,
    sources_only: bool = False,
) -> Path:
    """Write a run or a mechanism for another program, completely or not at all.

    Parameters
    ----------
    what : Dataset, Mechanism or Case
        A run is written as a table over time (.csv, .parquet) or as a structure `run` with every array (.mat). A mechanism is
        written as bars with their holes and their assembly (.dxf), as a cut list (.csv), as the ideal mechanism in MJCF
        (.xml), or as an FMI 3.0 unit (.fmu).
    path : path
    contacts : bool
        Write one row for each contact of a run instead of each instant.
    forces : bool
        Write the forces of the pins on each bar of a run, as .csv, .json, or .inp for CalculiX and FreeCAD's FEM.
    envelope : bool
        Write the extremes of the forces instead of their values over time; with `forces` and .csv only.
    mechanism : Mechanism, optional
        Mechanism of the run; by default it is read from the run, if it does not use user-defined code.
    run : Options, optional
        Options of the simulation in an FMU; by default those of the case, or default options with 50 ms.
    section, material : str
        Section and material of the beams in an .inp file, for example "20x30 mm" and "steel".
    pin_radius, width : float, optional
        Radius of the pins of ideal joints, and width of the bars' outlines, in a DXF and a cut list [m].
    sources_only : bool
        Write an FMU as C source without a compiled library.

    Raises
    ------
    InputError
        If the ending is unknown, the file cannot be written, the path is another kind of file, or data are missing.

    Warns
    -----
    UserWarning
        For parts of a mechanism that the format does not hold, and for largest forces that no sample of a run shows.
    """
    target = Path(path)
    notes: Sequence[str] = ()
    if isinstance(what, xr.Dataset):
        if not (forces or envelope):
            return export_table(what, target, contacts=contacts)
        ending = check_ending(target, FORCE_ENDINGS, "forces", "forces.csv")
        check_target(target, sample=f"forces{ending}")
        content = _forces(what, mechanism, ending, envelope=envelope, section=section, material=material)
        notes = of_pins.missed_peaks(what)
    else:
        described = getattr(what, "mechanism", what)
        if not isinstance(described, Mechanism):
            raise InputError(
                f"cannot export a {type(what).__name__}", "a run, a mechanism or a case", "export(run, 'table.csv')"
            )
        ending = check_ending(target, MECHANISM_ENDINGS, "a mechanism", "bars.dxf")
        check_target(target, sample=f"mechanism{ending}")
        options = run or getattr(what, "run", None) or Options(until=0.05)
        content, notes = _mechanism(
            described, ending, target.stem, options, pin_radius=pin_radius, width=width, sources_only=sources_only
        )
    written = write_file(target, content, sample=f"-o {target.name}")
    for note in notes:
        warnings.warn(note, stacklevel=3)
    return written


def _forces(run: xr.Dataset, mechanism: Mechanism | None, ending: str, *, envelope: bool, section: str, material: str) -> bytes:
    from scissordyn.casefile.configuration import read_configuration

    described = read_configuration(run).build_mechanism([]) if mechanism is None else mechanism
    forces = of_pins.pin_forces(run, described)
    if ending == ".csv":
        return of_pins.to_csv(of_pins.envelope(forces) if envelope else of_pins.force_table(forces))
    if ending == ".json":
        return of_pins.force_json(forces)
    if not section:
        raise InputError("no section is given for the beams", "width x depth of a rectangle", "--section '20x30 mm'")
    return of_pins.beam_file(forces, run, described, section=section, material=material)


def _mechanism(
    mechanism: Mechanism,
    ending: str,
    name: str,
    run: Options,
    *,
    pin_radius: float | None,
    width: float | None,
    sources_only: bool,
) -> tuple[bytes, Sequence[str]]:
    """Return the content of a file, and notes on what its format does not hold."""
    if ending == ".fmu":
        from scissordyn.exchange.fmu.pack import fmu

        return fmu(mechanism, run, name=name, sources_only=sources_only), ()
    if ending == ".xml":
        model = mjcf(mechanism)
        return model.text.encode(), model.notes
    if ending == ".csv":
        return cut_list(mechanism, pin_radius=pin_radius), ()
    return drawing(mechanism, pin_radius=pin_radius, width=width).encode(), left_out(mechanism)


class Hole(NamedTuple):
    """Hole of a bar at a joint, or pin that is fixed to the bar there."""

    joint: str
    place: Point
    radius: float
    journal: bool  # True for a pin


def holes_of(mechanism: Mechanism, body: Body, pin_radius: float | None) -> list[Hole]:
    """Return the holes of a bar, one for each joint on it.

    In a joint with clearance the bore's radius is the journal's radius plus the clearance. In an ideal joint pin and bore have
    the radius `pin_radius`.
    """
    holes = []
    for joint in mechanism.joints:
        for (name, point), journal in ((joint.journal, True), (joint.bearing, False)):
            if name != body.name:
                continue
            gap = joint.clearance
            if isinstance(gap, Clearance):
                radius = gap.journal_radius if journal else gap.journal_radius + gap.clearance
            elif pin_radius is None:
                raise InputError(
                    f"the ideal joint '{joint.name}' has no pin radius", "a radius for the pins of ideal joints", "--pin '5 mm'"
                )
            else:
                radius = pin_radius
            holes.append(Hole(joint.name, body.points[point], radius, journal))
    return holes


def drawing(mechanism: Mechanism, *, pin_radius: float | None = None, width: float | None = None) -> str:
    """Return a DXF drawing in millimetres with each bar separately, its name, outline and holes, in true size."""
    ezdxf = library("ezdxf", "exchange", "DXF")
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    for name, color in (("outline", 7), ("bore", 1), ("journal", 5), ("text", 8)):
        document.layers.add(name, color=color)
    space = document.modelspace()
    down = 0.0
    for body, holes in _bars(mechanism, pin_radius):
        radius = _edge(body, holes, width)
        corners = _outline(body, radius)
        low, high = min(y for _, y in corners), max(y for _, y in corners)
        down -= 1e3 * (high + 2.0 * radius)
        _draw_outline(space, corners, radius, down)
        for hole in holes:
            layer = "journal" if hole.journal else "bore"
            space.add_circle((1e3 * hole.place[0], down + 1e3 * hole.place[1]), 1e3 * hole.radius, dxfattribs={"layer": layer})
        left = 1e3 * (min(x for x, _ in corners) + 1.5 * radius)
        label = space.add_text(body.name, height=1e3 * 0.5 * radius, dxfattribs={"layer": "text"})
        label.set_placement((left, down + 1e3 * (high + 1.15 * radius)))
        down -= 1e3 * (radius - low)
    add_assembly(document, mechanism)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _bars(mechanism: Mechanism, pin_radius: float | None) -> list[tuple[Body, list[Hole]]]:
    if bent := [part.name for part in mechanism.components if isinstance(part, FlexibleBar)]:
        raise InputError(f"bar '{bent[0]}' bends: a drawing and a cut list have rigid bars only", "bars without modes")
    bodies = [(body, holes_of(mechanism, body, pin_radius)) for body in mechanism.bodies]
    bars = [(body, holes) for body, holes in bodies if holes and len(set(body.points.values())) > 1]
    if not bars:
        raise InputError("the mechanism has no bar with a joint", "bars", "scissordyn new scissor")
    return bars


def _edge(body: Body, holes: list[Hole], width: float | None) -> float:
    margin = 2.0  # default distance of the outline from the centre of a hole, in hole radii
    largest = max(hole.radius for hole in holes)
    if width is None:
        return margin * largest
    if not 0.5 * width > largest:
        raise InputError(f"bar '{body.name}' is {1e3 * width:g} mm wide but has a hole of {2e3 * largest:g} mm", "a wider bar")
    return 0.5 * width


def _outline(body: Body, radius: float) -> list[Point]:
    """Return the convex hull of a bar's points, counter-clockwise (Andrew's monotone chain)."""
    places = sorted(set(body.points.values()))

    def half(points: list[Point]) -> list[Point]:
        chain: list[Point] = []
        for point in points:
            while len(chain) > 1 and _left(chain[-2], chain[-1], point) <= 1e-12 * radius**2:
                chain.pop()
            chain.append(point)
        return chain[:-1]

    return half(places) + half(places[::-1])


def _left(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _draw_outline(space: object, corners: list[Point], radius: float, down: float) -> None:
    """Draw the outline of a bar at the distance `radius` from the lines between its corners, moved by `down` along y [mm]."""
    points = []
    count = len(corners)
    for k, corner in enumerate(corners):
        before, after = corners[k - 1], corners[(k + 1) % count]
        first, last = _normal(before, corner), _normal(corner, after)
        turn = math.atan2(first[0] * last[1] - first[1] * last[0], first[0] * last[0] + first[1] * last[1]) % (2.0 * math.pi)
        for normal, bulge in ((first, math.tan(0.25 * turn)), (last, 0.0)):
            x, y = corner[0] + radius * normal[0], corner[1] + radius * normal[1]
            points.append((1e3 * x, down + 1e3 * y, bulge))
    space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": "outline"})  # type: ignore[attr-defined]


def _normal(a: Point, b: Point) -> Point:
    """Return the outward normal of a side of a counter-clockwise outline."""
    length = math.dist(a, b)
    return (b[1] - a[1]) / length, (a[0] - b[0]) / length


def cut_list(mechanism: Mechanism, *, pin_radius: float | None = None) -> bytes:
    """Return a CSV table for the manufacture of bars: a row for each hole or pin; equal bars are one bar with a count."""
    groups: dict[tuple[object, ...], list[tuple[Body, list[Hole]]]] = {}
    for body, holes in _bars(mechanism, pin_radius):
        key = tuple(sorted((round(h.place[0], 9), round(h.place[1], 9), round(h.radius, 9), h.journal) for h in holes))
        groups.setdefault((key, _length(body), round(body.mass, 9)), []).append((body, holes))
    rows = ["bar,count,names,length [mm],mass [kg],x [mm],y [mm],diameter [mm],kind,joint"]
    for number, same in enumerate(groups.values(), start=1):
        body, holes = same[0]
        names = " | ".join(part.name for part, _ in same)
        for hole in sorted(holes, key=lambda hole: hole.place):
            cells = [number, len(same), f'"{names}"', f"{1e3 * _length(body):.6g}", f"{body.mass:.6g}"]
            cells += [f"{1e3 * x:.6g}" for x in hole.place]
            cells += [f"{2e3 * hole.radius:.6g}", "pin" if hole.journal else "bore", f'"{hole.joint}"']
            rows.append(",".join(map(str, cells)))
    return ("\n".join(rows) + "\n").encode()


def _length(body: Body) -> float:
    """Return the distance between a bar's outermost points [m]."""
    return round(max(math.dist(a, b) for a in body.points.values() for b in body.points.values()), 9)
