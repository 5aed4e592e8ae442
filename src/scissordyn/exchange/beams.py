"""The worst load of each bar as beams for CalculiX, the solver of FreeCAD's FEM, which reads these files too."""

from __future__ import annotations

import cmath
import math
import re
from itertools import pairwise

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.section import read_material

PIECES = 12  # Elements between two points of a bar
STRAIGHT = 1e-9  # Points this fraction of a bar's length beside its line are on it
UNIFORM = 1e-6  # A bar whose mass centre and inertia are this near those of a uniform one has its mass along its length

RECTANGLE = re.compile(r"\s*([\d.]+)\s*x\s*([\d.]+)\s*(mm|cm|m)\s*")
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}


def beam_file(forces: xr.Dataset, run: xr.Dataset, mechanism: Mechanism, *, section: str, material: str = "steel") -> bytes:
    """An input file of CalculiX: each straight bar as beams in its own frame, with its load when the force on it is largest.

    The forces of the pins, the weight and the inertia of the bar are in equilibrium; three supports in the plane take nothing
    but what is missing to that, so that their reactions tell how exact it is.
    """
    matched = RECTANGLE.fullmatch(section)
    if matched is None or not float(matched[1]) > 0.0 < float(matched[2]):
        raise InputError(
            f"section '{section}' of beams", "a rectangle: width across the plane x depth in it", "--section '20x30 mm'"
        )
    width, depth = (float(matched[k]) * METRES[matched[3]] for k in (1, 2))
    chosen = read_material(material)
    lines, left_out, node, element = [], [], 0, 0
    loads: list[str] = []
    supports: list[str] = []
    for number, body in enumerate(mechanism.bodies):
        at = _worst(forces, run, mechanism, body)
        if isinstance(at, str):
            left_out.append(f"** '{body.name}': left out, {at}")
            continue
        places = _nodes(body)
        label = re.sub(r"\W", "_", body.name).upper()
        height = number * 2.0 * mechanism.size
        lines.append(f"** {body.name}: load at t = {float(run['time'].values[at]):.9g} s")
        lines.append(f"*NODE, NSET=N_{label}")
        lines += [f"{node + k + 1}, {x:.12g}, {height:.12g}, 0" for k, x in enumerate(places)]
        lines.append(f"*ELEMENT, TYPE=B31, ELSET=E_{label}")
        lines += [f"{element + k + 1}, {node + k + 1}, {node + k + 2}" for k in range(len(places) - 1)]
        lines += [f"*BEAM SECTION, ELSET=E_{label}, MATERIAL=BAR, SECTION=RECT", f"{depth:.12g}, {width:.12g}", "0, 1, 0"]
        loads += _loads(forces.isel(time=at), run.isel(time=at).sel(body=body.name), mechanism, body, places, node)
        last = node + len(places)
        supports += [f"N_{label}, 3, 3", f"{node + 1}, 1, 2", f"{last}, 2, 2", f"{node + 1}, 4, 4"]
        node, element = last, element + len(places) - 1
    if not node:
        raise InputError("no bar that can be written as beams", "a straight bar with joints on its line")
    text = [
        "** Written by scissordyn: bars as beams, SI units, each along x of its own frame.",
        *left_out,
        *lines,
        "*MATERIAL, NAME=BAR",
        f"*ELASTIC\n{chosen.youngs_modulus:.9g}, 0.3",
        f"*DENSITY\n{chosen.density:.9g}",
        "*BOUNDARY",
        *supports,
        "*STEP\n*STATIC\n*CLOAD",
        *loads,
        "*NODE FILE, OUTPUT=2D\nU, RF",
        "*EL FILE, SECTION FORCES\nS",
        *(f"*NODE PRINT, NSET={line.rpartition('NSET=')[2]}, TOTALS=ONLY\nRF" for line in lines if line.startswith("*NODE")),
        "*END STEP\n",
    ]
    return "\n".join(text).encode()


def _worst(forces: xr.Dataset, run: xr.Dataset, mechanism: Mechanism, body: Body) -> int | str:
    """The sample of the largest force on a pin of the bar; or why it is no beam."""
    ends = forces["end_body"].values == body.name
    points = forces["end_point"].values[ends].astype(str).tolist()
    if not body.rotates or not points or len(_line(body)) < 2:
        return "it is no bar with a joint and a length"
    beside = [abs(body.points[point][1]) if point else math.inf for point in points]
    if max(*beside, abs(body.centre[1])) > STRAIGHT * body.extent:
        return "its joints and its mass centre are not on its x axis"
    along = forces["force_along"].values[:, ends]
    if np.isnan(along).any():
        return "a reaction is not determined"
    at = int(np.argmax(np.max(np.hypot(along[..., 0], along[..., 1]), axis=1)))
    other = float(np.hypot(*forces["other_force"].values[at, mechanism.bodies.index(body)]))
    if other > 1e-6 * max(float(np.max(abs(along[at]))), 1.0):
        return f"components pull at it with {other:.4g} N at t = {run['time'].values[at]:.6g} s"
    return at


def _line(body: Body) -> list[float]:
    """Places of the points and of the mass centre along the bar's x axis."""
    return sorted({round(x, 12) for x, y in (*body.points.values(), body.centre) if abs(y) <= STRAIGHT * body.extent})


def _nodes(body: Body) -> list[float]:
    """These, and some between them."""
    fixed = _line(body)
    places = [fixed[0]]
    for a, b in pairwise(fixed):
        places += [a + (b - a) * k / PIECES for k in range(1, PIECES + 1)]
    return places


def _loads(
    forces: xr.Dataset, motion: xr.Dataset, mechanism: Mechanism, body: Body, places: list[float], before: int
) -> list[str]:
    """Forces and torques at the nodes: of the pins, the weight, and the inertia with its sign turned."""
    lines: list[str] = []

    def put(x: float, force: complex, torque: float = 0.0) -> None:
        node = before + 1 + min(range(len(places)), key=lambda k: abs(places[k] - x))
        loaded = ((1, force.real), (2, force.imag), (6, torque))
        lines.extend(f"{node}, {degree}, {value:.12g}" for degree, value in loaded if value != 0.0)

    ends = np.flatnonzero(forces["end_body"].values == body.name)
    pins = [body.points[str(forces["end_point"].values[k])][0] for k in ends]
    for k, pin in zip(ends, pins, strict=True):
        lines.append(f"** joint '{forces['end_joint'].values[k]}'")
        put(pin, complex(*forces["force_along"].values[k]))
    torque = float(forces["other_torque"].values[mechanism.bodies.index(body)])
    lines.append("** drives and friction: a torque at the first joint" if torque else "** no further torque")
    put(pins[0], 0j, torque)
    into = cmath.rect(1.0, -float(motion["angle"]))  # the frame of the bar
    gravity = into * cmath.rect(mechanism.gravity, mechanism.gravity_direction)
    acceleration = into * complex(*motion["acceleration"].values)
    rate, angular = float(motion["angular_velocity"]), float(motion["angular_acceleration"])
    length, middle = places[-1] - places[0], 0.5 * (places[0] + places[-1])
    inertia = body.mass * length**2 / 12.0
    uniform = abs(body.centre[0] - middle) < UNIFORM * length and abs((body.inertia or 0.0) - inertia) < UNIFORM * inertia
    if not uniform:
        lines.append("** weight and inertia, at the mass centre: the bar is not uniform")
        put(body.centre[0], body.mass * (gravity - acceleration), -(body.inertia or 0.0) * angular)
        return lines
    lines.append("** weight and inertia, along the bar")
    for a, b in pairwise(places):
        for x, weight in _consistent(a, b):
            local = acceleration - (rate**2 - 1j * angular) * (x - body.centre[0])
            part = body.mass * weight / length
            for place, share in ((a, (b - x) / (b - a)), (b, (x - a) / (b - a))):
                put(place, share * part * (gravity - local))
    return lines


def _consistent(a: float, b: float) -> list[tuple[float, float]]:
    """Two Gauss points: exact for the product of linear shapes and a linear load."""
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    return [(middle - half / math.sqrt(3.0), half), (middle + half / math.sqrt(3.0), half)]
