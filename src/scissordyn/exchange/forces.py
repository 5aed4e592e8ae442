"""Compute the pin forces on each bar for strength calculations, and write beam models of bars under their largest load.

The beam model is for CalculiX, the solver of FreeCAD's FEM workbench.
"""

from __future__ import annotations

import cmath
import json
import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.joint import Guide
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.section import read_material
from scissordyn.numeral import finite_or_none
from scissordyn.record.joint_force import clearance_joints, joint_force, largest_force, oiled_joints
from scissordyn.tolerance import ASSEMBLY_TOL
from scissordyn.units import checked

if TYPE_CHECKING:
    import pandas as pd

END_NAMES = ("body", "joint", "point")  # Columns of force tables that identify the body and the joint on which a force acts


SECTION_TEXT = re.compile(r"\s*([\d.]+)\s*x\s*([\d.]+)\s*(mm|cm|m)\s*")  # Pattern of a rectangular section, such as "20x30 mm"
UNIT_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}  # Length of each unit of a section's sides [m]


class End(NamedTuple):
    """Body and one of its joints, guides or welds, which exerts a force on the body."""

    body: str
    joint: str
    point: str  # Point of the body; "" for the body that carries a guide: the force acts where the follower is
    sign: float  # 1.0 if the run reports the force on this body, -1.0 if it reports the force on the other body
    guide: Guide | None = None
    of_weld: bool = False


@checked
def pin_forces(run: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Compute the forces that joints, guides and welds exert on each bar.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
        Mechanism of the run.

    Returns
    -------
    Dataset
        Dimension `end` is a body at one of its joints, guides or welds, with coordinates `end_body`, `end_joint`, `end_point`.

        * `force (time, end, axis)`: force on the body in the fixed frame [N].
        * `force_along (time, end, axis)`: the same force in the frame of the body [N].
        * `moment (time, end)`: moment on the body about that point, from welds, guides, and friction and oil in joints with
          clearance [N m].
        * `other_force (time, body, axis)`, `other_torque (time, body)`: all further loads on the body except gravity, about its
          mass centre, from the balance of momentum [N, N m]. Examples are drives, springs, teeth and friction in ideal
          joints. NaN for bodies with an undetermined reaction.
        * `located_peak (end)`: largest force, including maxima between samples [N]. It is located within steps at joints
          with clearance, and at the ends of steps elsewhere; NaN at hard contacts, and at ideal and oiled joints in a part
          of a run without their largest force.
    """
    ends = _ends(mechanism)
    if not ends:
        raise InputError("the mechanism has no joints", "bars with joints", "scissordyn new four-bar")
    force, moment = (np.stack(parts, axis=1) for parts in zip(*(_at_end(run, mechanism, end) for end in ends), strict=True))
    bodies = [str(name) for name in run["body"].values]
    angle = np.nan_to_num(run["angle"].transpose("time", "body").values)
    along = np.stack([_turned(force[:, k], -angle[:, bodies.index(end.body)]) for k, end in enumerate(ends)], axis=1)
    other, torque = _other_loads(run, mechanism, ends, force, moment)
    peaks = np.array([located_peak(run, end.joint) for end in ends])
    variables = (
        ("force", ("time", "end", "axis"), force, "N", "force on the body"),
        ("force_along", ("time", "end", "axis"), along, "N", "force in the frame of the body"),
        ("moment", ("time", "end"), moment, "N m", "moment on the body about the point"),
        ("other_force", ("time", "body", "axis"), other, "N", "further forces on the body"),
        ("other_torque", ("time", "body"), torque, "N m", "further torque about the mass centre"),
        ("located_peak", ("end",), peaks, "N", "largest force within the steps"),
    )
    columns = zip(END_NAMES, zip(*(end[:3] for end in ends), strict=True), strict=True)
    return xr.Dataset(
        {name: (dims, values, {"units": unit, "long_name": text}) for name, dims, values, unit, text in variables},
        coords={
            **{name: run[name] for name in ("time", "axis", "body")},
            **{f"end_{name}": ("end", np.array(column, dtype=object)) for name, column in columns},
        },
    )


def located_peak(run: xr.Dataset, joint: str) -> float:
    """Return the largest force of a joint, guide or weld from the first to the last sample, with maxima between samples [N].

    Part of a run that does not contain the largest force of the run has none; only contacts have located maxima of their own.
    """
    dim, time = "joint" if joint in run["joint"].values else "weld", run["time"].values
    if f"{dim}_peak_force" not in run:
        return math.nan
    peak, when = (float(run[f"{dim}_peak_force{part}"].sel({dim: joint})) for part in ("", "_time"))
    if not math.isfinite(peak) or time[0] <= when <= time[-1]:
        return peak
    dry = joint in clearance_joints(run) and joint not in oiled_joints(run)
    return largest_force(run, joint, time[0], time[-1]) if dry else math.nan


def missed_peaks(run: xr.Dataset) -> list[str]:
    """Return a sentence for each joint, guide and weld whose largest force is over 1 % above the largest at the samples."""
    missed = 0.01  # fraction of the largest force
    lines = []
    for joint in sorted(name for dim in ("joint", "weld") if dim in run.dims for name in run[dim].values.tolist()):
        peak = located_peak(run, joint)
        sampled = float(np.max(joint_force(run, joint)))
        if sampled < (1.0 - missed) * peak:
            lines.append(
                f"joint '{joint}': the samples reach {sampled:.4g} N of the force, whose largest is {peak:.4g} N "
                'between them; samples = "auto" in [run] records it'
            )
    return lines


def _ends(mechanism: Mechanism) -> list[End]:
    """Return all ends: bodies at joints first, then at guides and at welds."""
    ends = [End(*place, sign) for joint in mechanism.joints for place, sign in _sides(joint.name, joint.journal, joint.bearing)]
    for guide in mechanism.guides:
        ends += [End(*place, sign, guide) for place, sign in _sides(guide.name, guide.follower, (guide.body, ""))]
    for weld in mechanism.welds:
        ends += [End(*place, sign, of_weld=True) for place, sign in _sides(weld.name, weld.start, weld.end)]
    return [end for end in ends if end.body != GROUND]


def _sides(name: str, first: BodyPoint, second: BodyPoint) -> tuple[tuple[tuple[str, str, str], float], ...]:
    return ((first[0], name, first[1]), 1.0), ((second[0], name, second[1]), -1.0)


def _at_end(run: xr.Dataset, mechanism: Mechanism, end: End) -> tuple[np.ndarray, np.ndarray]:
    """Return the force (nt, 2) and moment (nt,) on the body of an end, about its point.

    On the carrier of a guide, the point is the position of the follower.
    """
    if end.of_weld:
        at = run.sel(weld=end.joint)
        return end.sign * at["weld_force"].transpose("time", "axis").values, end.sign * at["weld_moment"].values
    at = run[["reaction", "reaction_moment"]].sel(joint=end.joint)
    force, moment = end.sign * at["reaction"].transpose("time", "axis").values, end.sign * at["reaction_moment"].values
    if end.guide is None and end.sign < 0.0 and mechanism.joint(end.joint).clearance is not None:
        # the force acts at the journal's centre
        eccentricity = run["eccentricity"].sel(joint=end.joint).transpose("time", "axis").values
        moment = moment + eccentricity[:, 0] * force[:, 1] - eccentricity[:, 1] * force[:, 0]
    return force, moment


def _turned(vector: np.ndarray, angle: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * vector[:, 0] - sin * vector[:, 1], sin * vector[:, 0] + cos * vector[:, 1]], axis=1)


def _other_loads(
    run: xr.Dataset, mechanism: Mechanism, ends: list[End], force: np.ndarray, moment: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the force and torque on each body that no joint, guide or weld exerts: the residual of its balance of momentum."""
    count = run.sizes["time"]
    other, torque = np.zeros((count, len(mechanism.bodies), 2)), np.zeros((count, len(mechanism.bodies)))
    down = mechanism.gravity * np.array([math.cos(mechanism.gravity_direction), math.sin(mechanism.gravity_direction)])
    for b, body in enumerate(mechanism.bodies):
        motion = run.sel(body=body.name)
        other[:, b] = body.mass * (motion["acceleration"].transpose("time", "axis").values - down)
        if body.rotates:
            torque[:, b] = (body.inertia or 0.0) * motion["angular_acceleration"].values
        for k, end in enumerate(ends):
            if end.body != body.name:
                continue
            other[:, b] -= force[:, k]
            if not body.rotates:
                continue
            if end.point:
                arm = _arm_of(run, body, end.point)
            else:  # carrier of a guide: the force acts at the follower
                assert end.guide is not None
                follower, follower_point = end.guide.follower
                between = run["position"].sel(body=follower) - motion["position"]
                arm = between.transpose("time", "axis").values + _arm_of(run, mechanism.body(follower), follower_point)
            torque[:, b] -= arm[:, 0] * force[:, k, 1] - arm[:, 1] * force[:, k, 0] + moment[:, k]
    return other, torque


def _arm_of(run: xr.Dataset, body: Body, point: str) -> np.ndarray:
    """Return the vector from a body's mass centre to one of its points, shape (samples, 2) [m]."""
    angle = np.nan_to_num(run["angle"].sel(body=body.name).values)
    return _turned(np.tile(np.subtract(body.points[point], body.centre), (angle.size, 1)), angle)


def force_table(forces: xr.Dataset) -> pd.DataFrame:
    """Return a table of pin forces with a row for each instant and end."""
    import pandas as pd

    count, ends = forces.sizes["time"], forces.sizes["end"]
    columns: dict[str, Any] = {"time [s]": np.repeat(forces["time"].values, ends)}
    for name in END_NAMES:
        columns[name] = np.tile(forces[f"end_{name}"].values, count)
    for name, label in (("force", "{} [N]"), ("force_along", "along {} of the body [N]")):
        for axis, letter in enumerate("xy"):
            columns[label.format(letter)] = forces[name].values[:, :, axis].ravel()
    columns["moment [N m]"] = forces["moment"].values.ravel()
    return pd.DataFrame(columns)


def envelope(forces: xr.Dataset) -> pd.DataFrame:
    """Return a table with a row for each end: largest force, its instant and components, and extremes of the components."""
    import pandas as pd

    rows = []
    time, along = forces["time"].values, forces["force_along"].values
    for k in range(forces.sizes["end"]):
        size = np.hypot(along[:, k, 0], along[:, k, 1])
        row: dict[str, Any] = {name: str(forces[f"end_{name}"].values[k]) for name in END_NAMES}
        if np.isnan(size).all():  # undetermined reaction
            row |= dict.fromkeys(ENVELOPE_COLUMNS, math.nan)
        else:
            at = int(np.nanargmax(size))
            numbers = [size[at], time[at], *along[at, k]]
            numbers += [extreme(along[:, k, axis]) for axis in (0, 1) for extreme in (np.nanmin, np.nanmax)]
            row |= dict(zip(ENVELOPE_COLUMNS, map(float, numbers), strict=True))
        moment = np.abs(forces["moment"].values[:, k])
        row[MOMENT_COLUMN] = math.nan if np.isnan(moment).all() else float(np.nanmax(moment))
        row[LOCATED_COLUMN] = float(forces["located_peak"].values[k])
        rows.append(row)
    return pd.DataFrame(rows)


ENVELOPE_COLUMNS = (
    "largest force [N]", "at time [s]", "x of the body then [N]", "y of the body then [N]",
    "least x [N]", "largest x [N]", "least y [N]", "largest y [N]",
)  # fmt: skip
"""Column headings of a table of largest forces (an envelope), after the columns `END_NAMES`."""

MOMENT_COLUMN = "largest moment [N m]"  # Heading of the column of largest moments in an envelope, the last but one

# Heading of the column of largest forces within the steps in an envelope, the last one
LOCATED_COLUMN = "largest force within the steps [N]"


def to_csv(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False, lineterminator="\n").encode()


def force_json(forces: xr.Dataset) -> bytes:
    """Return pin forces over time and their envelope as JSON; undetermined values are null."""
    ends = []
    for k, row in enumerate(envelope(forces).to_dict("records")):
        names = {name: row.pop(name) for name in END_NAMES}
        courses = {name: _plain(forces[name].values[:, k].tolist()) for name in ("force", "force_along", "moment")}
        ends.append({**names, "envelope": {key: _plain(value) for key, value in row.items()}, **courses})
    whole = {"scissordyn": "pin forces", "units": "SI", "time": forces["time"].values.tolist(), "ends": ends}
    return (json.dumps(whole, allow_nan=False) + "\n").encode()


def _plain(value: Any) -> Any:
    """Return a number, or nested lists of numbers, with each value that is not finite replaced by None."""
    if isinstance(value, list):
        return [_plain(part) for part in value]
    return finite_or_none(value)


def beam_file(forces: xr.Dataset, run: xr.Dataset, mechanism: Mechanism, *, section: str, material: str = "steel") -> bytes:
    """Return a CalculiX input file: each straight bar as beam elements in its body frame, at the instant of its largest force.

    The pin forces, the weight and the inertia forces of each bar are in equilibrium. Three supports in the plane take only the
    residual, so that their reactions are the error.
    """
    matched = SECTION_TEXT.fullmatch(section)
    if matched is None or not float(matched[1]) > 0.0 < float(matched[2]):
        raise InputError(
            f"section '{section}' of the beams is not a rectangle",
            "a rectangle: width across the plane x depth in it",
            "--section '20x30 mm'",
        )
    width, depth = (float(matched[k]) * UNIT_METRES[matched[3]] for k in (1, 2))
    chosen = read_material(material)
    lines, left_out, node, element = [], [], 0, 0
    loads: list[str] = []
    supports: list[str] = []
    for number, body in enumerate(mechanism.bodies):
        at = _worst_sample(forces, run, mechanism, body)
        if isinstance(at, str):
            left_out.append(f"** '{body.name}': left out, {at}")
            continue
        places = _beam_nodes(body)
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
        raise InputError("no bar of the mechanism can be written as beams", "a straight bar with joints on its line")
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


def _worst_sample(forces: xr.Dataset, run: xr.Dataset, mechanism: Mechanism, body: Body) -> int | str:
    """Return the index of the sample with the largest pin force on a bar, or the reason why no beam can be written for it."""
    ends = forces["end_body"].values == body.name
    points = forces["end_point"].values[ends].astype(str).tolist()
    if not body.rotates or not points or len(_points_on_line(body)) < 2:
        return "it has no joint or no length"
    beside = [abs(body.points[point][1]) if point else math.inf for point in points]
    if max(*beside, abs(body.centre[1])) > ASSEMBLY_TOL * body.extent:
        return "its joints and its mass centre are not on its x axis"
    along = forces["force_along"].values[:, ends]
    if np.isnan(along).any() or np.isnan(forces["moment"].values[:, ends]).any():
        return "a reaction is not determined"
    at = int(np.argmax(np.max(np.hypot(along[..., 0], along[..., 1]), axis=1)))
    other = float(np.hypot(*forces["other_force"].values[at, mechanism.bodies.index(body)]))
    if other > 1e-6 * max(float(np.max(abs(along[at]))), 1.0):
        return f"components act on it with {other:.4g} N at t = {run['time'].values[at]:.6g} s"
    return at


def _points_on_line(body: Body) -> list[float]:
    """Return the coordinates of the points and the mass centre along the bar's x axis."""
    return sorted({round(x, 12) for x, y in (*body.points.values(), body.centre) if abs(y) <= ASSEMBLY_TOL * body.extent})


def _beam_nodes(body: Body) -> list[float]:
    """Return the coordinates of the beam nodes along the bar's x axis."""
    pieces = 12  # number of elements between two points of a bar
    fixed = _points_on_line(body)
    places = [fixed[0]]
    for a, b in pairwise(fixed):
        places += [a + (b - a) * k / pieces for k in range(1, pieces + 1)]
    return places


def _loads(
    forces: xr.Dataset, motion: xr.Dataset, mechanism: Mechanism, body: Body, places: list[float], before: int
) -> list[str]:
    """Return the lines of the CalculiX file with the nodal loads of a bar: pin forces, weight and inertia forces.

    `places` are the nodes along the bar [m], `before` the number of nodes of previous bars.
    """
    uniform_tol = 1e-6  # largest relative difference from the mass centre and inertia of a uniform bar
    lines: list[str] = []

    def put(x: float, force: complex, torque: float = 0.0) -> None:
        node = before + 1 + min(range(len(places)), key=lambda k: abs(places[k] - x))
        loaded = ((1, force.real), (2, force.imag), (6, torque))
        lines.extend(f"{node}, {degree}, {value:.12g}" for degree, value in loaded if value != 0.0)

    ends = np.flatnonzero(forces["end_body"].values == body.name)
    pins = [body.points[str(forces["end_point"].values[k])][0] for k in ends]
    for k, pin in zip(ends, pins, strict=True):
        lines.append(f"** joint '{forces['end_joint'].values[k]}'")
        put(pin, complex(*forces["force_along"].values[k]), float(forces["moment"].values[k]))
    torque = float(forces["other_torque"].values[mechanism.bodies.index(body)])
    lines.append("** drives and friction: a torque at the first joint" if torque else "** no further torque")
    put(pins[0], 0j, torque)
    into = cmath.rect(1.0, -float(motion["angle"]))  # rotation from the fixed frame into that of the bar
    gravity = into * cmath.rect(mechanism.gravity, mechanism.gravity_direction)
    acceleration = into * complex(*motion["acceleration"].values)
    rate, angular = float(motion["angular_velocity"]), float(motion["angular_acceleration"])
    length, middle = places[-1] - places[0], 0.5 * (places[0] + places[-1])
    inertia = body.mass * length**2 / 12.0
    uniform = (
        abs(body.centre[0] - middle) < uniform_tol * length and abs((body.inertia or 0.0) - inertia) < uniform_tol * inertia
    )
    if not uniform:
        lines.append("** weight and inertia, at the mass centre: the bar is not uniform")
        put(body.centre[0], body.mass * (gravity - acceleration), -(body.inertia or 0.0) * angular)
        return lines
    lines.append("** weight and inertia, along the bar")
    for a, b in pairwise(places):
        for x, weight in _gauss_points(a, b):
            local = acceleration - (rate**2 - 1j * angular) * (x - body.centre[0])
            part = body.mass * weight / length
            for place, share in ((a, (b - x) / (b - a)), (b, (x - a) / (b - a))):
                put(place, share * part * (gravity - local))
    return lines


def _gauss_points(a: float, b: float) -> list[tuple[float, float]]:
    """Return two Gauss points of the interval from a to b with weights, exact for the product of two linear functions."""
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    return [(middle - half / math.sqrt(3.0), half), (middle + half / math.sqrt(3.0), half)]
