"""Deflection, internal forces and stress along flexible bars, at chosen places and at their largest values."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scissordyn.casefile.configuration import read_configuration
from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.errors import InputError
from scissordyn.interpolation import gauss_rule
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import matching
from scissordyn.plan.bending import HERMITE_MASS, beams_of
from scissordyn.plan.flexible import flexible_bars
from scissordyn.record.bars import SPAN_PARTS, extreme_fibre, part_boundaries, part_names
from scissordyn.record.deferred import Deferred, DeferredArray
from scissordyn.record.results import Variables, described, labels
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr

GAUSS_NODES, GAUSS_WEIGHTS = gauss_rule(4)


# Unit and meaning of the quantities that are reported along a flexible bar, by name
QUANTITIES = {
    "deflection": ("m", "distance from the line through the ends of the bar, towards +y of the bar"),
    "axial_force": ("N", "axial force, tension positive"),
    "shear_force": ("N", "shear force"),
    "bending_moment": ("N m", "bending moment, positive where it curves the bar towards +y"),
    "stress": ("Pa", "stress in the extreme fibre, 0 if the material is unknown"),
    "utilisation": ("1", "stress in the extreme fibre over the yield strength, 0 if the strength is unknown"),
    "buckling_ratio": (
        "1",
        "compression over the compression at which the mechanism with locked drives buckles in proportional loading",
    ),
}


class Bar(NamedTuple):
    """Flexible bar: its beam elements from one end to the other, or one bar with modes."""

    name: str
    beams: tuple[Beam, ...]
    whole: FlexibleBar | None = None

    @property
    def parts(self) -> tuple[Beam | FlexibleBar, ...]:
        return (self.whole,) if self.whole else self.beams

    @property
    def boundaries(self) -> np.ndarray:
        """Distances from the first end to the ends of the elements, or to the ends of the reported parts [m]."""
        return part_boundaries(self.whole) if self.whole else np.cumsum([0.0, *(beam.length for beam in self.beams)])

    @property
    def length(self) -> float:
        """Unstrained length [m]."""
        return self.whole.length if self.whole else sum(beam.length for beam in self.beams)


def bars_of(mechanism: Mechanism) -> tuple[Bar, ...]:
    """Return the flexible bars, each with its elements in order; a beam that belongs to no bar counts as a bar."""
    groups = itertools.groupby(beams_of(mechanism), key=lambda beam: beam.name.rsplit("/beam ", 1)[0])
    wholes = (Bar(bar.name.removesuffix("/beam"), (), bar) for bar in flexible_bars(mechanism))
    return (*(Bar(name, tuple(beams)) for name, beams in groups), *wholes)


@checked
def internal_forces(
    run: xr.Dataset,
    mechanism: Mechanism | None = None,
    *,
    bars: str | Iterable[str] = "all",
    places: int | ArrayLike = 11,
) -> xr.Dataset:
    """Compute deflection, internal forces and stress along flexible bars.

    In a beam element they follow from equilibrium with the forces at its end, its weight and its inertia. Along a bar with
    modes they are interpolated between start, middle and end of the parts that a run reports.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism, optional
        Mechanism of the run; by default it is read from the run.
    bars : str or iterable of str
        Names or patterns of bars.
    places : int or array_like
        Places along each bar as fractions of its length, 0 to 1; or the number of equally spaced places.

    Returns
    -------
    Dataset
        Over (time, bar, place): `deflection` [m] from the line through the ends of the bar, `axial_force`, `shear_force` [N],
        `bending_moment` [N m], `stress` [Pa], `utilisation`, `buckling_ratio`; `position` [m] of the axis over axis too;
        `distance` [m] of each place from the first end.

    Raises
    ------
    InputError
        If no bar bends, or a place is not on a bar.
    """
    mechanism = mechanism or read_configuration(run).build_mechanism()
    present = bars_of(mechanism)
    if not present or "beam_axial_force" not in run:
        raise InputError("internal forces: no bar of the mechanism bends", "bars that bend", "sd.with_bending(mechanism, ...)")
    at = np.linspace(0.0, 1.0, places) if isinstance(places, int) else np.atleast_1d(np.asarray(places, float))
    if at.ndim != 1 or at.size == 0 or not np.all((at >= 0.0) & (at <= 1.0)):
        raise InputError(
            f"places = {places!r} along a bar",
            "fractions of its length from 0 to 1, or a number of places",
            "places=[0.25, 0.5]",
        )
    names = [bar.name for bar in present]
    chosen = [bar for bar in present if bars == "all" or bar.name in matching("bar", bars, names)]
    read = _RunReader(run, mechanism)
    quantities = [_along(bar, read, at) for bar in chosen]
    for bar, along in zip(chosen, quantities, strict=True):
        along["buckling_ratio"] = _compression(along) / float(run["bar_buckling_load"][names.index(bar.name)])
    over = ("time", "bar", "place")

    def stacked(name: str) -> np.ndarray:
        return np.stack([of_bar[name] for of_bar in quantities], axis=1)

    variables = {name: described(over, stacked(name), unit, text) for name, (unit, text) in QUANTITIES.items()}
    variables["position"] = described((*over, "axis"), stacked("position"), "m", "place of the bar's axis")
    distance = np.array([[bar.length * part for part in at] for bar in chosen])
    coordinates = {
        "time": run["time"],
        "bar": [bar.name for bar in chosen],
        "place": ("place", at, {"long_name": "distance from the bar's first end over its length"}),
        "axis": ["x", "y"],
        "distance": (("bar", "place"), distance, {"units": "m", "long_name": "from the first end, unstrained"}),
    }
    import xarray as xr  # imported here because the import takes longer than most runs

    plain = {name: (part.dims, part.values, part.attrs) for name, part in variables.items()}
    return xr.Dataset(plain, coordinates, {"title": "scissordyn internal forces"})


def _compression(quantities: dict[str, np.ndarray]) -> np.ndarray:
    return np.asarray(np.maximum(-quantities["axial_force"], 0.0))


class Largest(NamedTuple):
    """Largest value of each quantity along each bar, and the buckling load of each bar."""

    values: dict[str, np.ndarray]  # value, instant [s] and distance from the first end [m] of each quantity, (3, bars)
    loads: np.ndarray  # (bars,) buckling loads [N]


def largest_along(mechanism: Mechanism, variables: Variables, time: np.ndarray, ratios: np.ndarray) -> Largest:
    """Return the largest magnitude of each quantity along each bar, with instant and distance from the bar's first end.

    The search covers the samples, the quarter points of each element, and both sides of cross-sections. The buckling load is
    the largest compression of each bar divided by its largest buckling ratio.
    """
    bars = bars_of(mechanism)
    read = _RunReader(variables, mechanism)
    largest = {name: np.zeros((3, len(bars))) for name in QUANTITIES}
    loads = np.full(len(bars), np.inf)
    for b, bar in enumerate(bars):
        ends = bar.boundaries
        # forces jump at a loaded cross-section, so the end of a part and the start of the next one are both kept
        places, within = (
            (ends[:-1, None] + np.diff(ends)[:, None] * np.append(np.arange(SPAN_PARTS) / SPAN_PARTS, end)).ravel()
            for end in (1.0, 1.0 - ROUND_OFF_TOL)
        )
        at = within / ends[-1]
        quantities = _along(bar, read, at)
        compression = _compression(quantities)
        if ratios[b] > 0.0 and compression.any():
            loads[b] = float(compression.max()) / ratios[b]
        quantities["buckling_ratio"] = compression / loads[b]
        for name, rows in largest.items():
            size = np.abs(quantities[name])
            row, column = np.unravel_index(int(np.argmax(size)), size.shape)
            rows[:, b] = quantities[name][row, column], time[row], places[column]
    return Largest(largest, loads)


def largest_variables(bars: tuple[Bar, ...], largest: Deferred[Largest]) -> Variables:
    """Return the variables of `largest_along`, which is computed when one of them is first read."""
    about = "compression at which the mechanism with locked drives buckles, if all axial forces grow in proportion"
    loads = DeferredArray((len(bars),), lambda: largest().loads)

    def of(name: str, row: int) -> np.ndarray:
        return np.asarray(largest().values[name][row])

    answers = {"bar_buckling_load": described("bar", loads, "N", about)}
    answers["bar"] = labels("bar", [bar.name for bar in bars], "bar that bends")
    for name, (unit, text) in QUANTITIES.items():
        size, when, where = (DeferredArray((len(bars),), partial(of, name, row)) for row in range(3))
        answers[f"bar_largest_{name}"] = described("bar", size, unit, f"largest {text}")
        answers[f"bar_largest_{name}_time"] = described("bar", when, "s", f"when it is largest: {text}")
        answers[f"bar_largest_{name}_place"] = described("bar", where, "m", f"its distance from the first end: {text}")
    return answers


class _RunReader:
    """Reader of a run: motion of cross-section bodies and outputs of beams, by name, over time."""

    def __init__(self, source: Any, mechanism: Mechanism) -> None:
        self.source = source
        angle = mechanism.gravity_direction
        self.gravity = mechanism.gravity * np.array([math.cos(angle), math.sin(angle)])
        self.bodies, self.beams = (
            {name: k for k, name in enumerate(source[dim].values.astype(str).tolist())} for dim in ("body", "beam")
        )

    def body(self, variable: str, name: str) -> np.ndarray:
        return np.asarray(self.source[variable].values[:, self.bodies[name]])

    def beam(self, output: str, name: str) -> np.ndarray:
        return np.asarray(self.source[f"beam_{output}"].values[:, self.beams[name]])

    def parts(self, output: str, names: Iterable[str]) -> np.ndarray:
        return np.stack([self.beam(output, name) for name in names], axis=1)


def _along(bar: Bar, read: _RunReader, at: np.ndarray) -> dict[str, np.ndarray]:
    """Return all `QUANTITIES` at fractions of a bar's length, by name, each of shape (samples, places)."""
    return _along_whole(bar.whole, read, at * bar.length) if bar.whole else _along_elements(bar, read, at)


def _section_forces(
    part: Beam | FlexibleBar, position: np.ndarray, normal: np.ndarray, shear: np.ndarray, bending: np.ndarray
) -> dict[str, np.ndarray]:
    """Return internal forces, stress in the extreme fibre, and ratio of the stress to the yield strength, by name."""
    forces = {"position": position, "axial_force": normal, "shear_force": shear, "bending_moment": bending}
    return forces | extreme_fibre(part, normal, bending)


def _chord(first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the unit vector along the line through the ends of a bar, shape (samples, 2)."""
    line = last - first
    return np.asarray(line / np.hypot(*line.T)[:, None])


def _along_elements(bar: Bar, read: _RunReader, at: np.ndarray) -> dict[str, np.ndarray]:
    ends = bar.boundaries
    which = np.clip(np.searchsorted(ends, at * ends[-1], side="right") - 1, 0, len(bar.beams) - 1)
    parts = []
    for k, beam in enumerate(bar.beams):
        inside = (at[which == k] * ends[-1] - ends[k]) / beam.length
        if inside.size:
            parts.append(_element(beam, read, np.clip(inside, 0.0, 1.0)))
    quantities = {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}
    order = np.argsort(np.argsort(which, kind="stable"), kind="stable")
    quantities = {name: values[:, order] for name, values in quantities.items()}
    first, last = read.body("position", bar.beams[0].start[0]), read.body("position", bar.beams[-1].end[0])
    line = _chord(first, last)
    offset = quantities["position"] - first[:, None]
    quantities["deflection"] = line[:, None, 0] * offset[..., 1] - line[:, None, 1] * offset[..., 0]
    return quantities


def _along_whole(bar: FlexibleBar, read: _RunReader, distance: np.ndarray) -> dict[str, np.ndarray]:
    """Return all `QUANTITIES` at distances from the first end of a bar with modes, by name, each of shape (samples, places)."""
    places, marks = np.array(bar.places) - bar.places[0], part_boundaries(bar)
    names = part_names(bar)
    start, end, node_deflection = (read.parts(output, names) for output in ("start_moment", "end_moment", "deflection"))
    node_deflection = np.hstack([np.zeros_like(node_deflection[:, :1]), node_deflection])
    part = np.clip(np.searchsorted(marks, distance, side="right") - 1, 0, marks.size - 2)
    length, within = np.diff(marks)[part], [names[k] for k in part]
    xi = (distance - marks[part]) / length
    # interpolate through start, middle and end of each part; the slope of the moment is the shear force
    three = np.array([(1.0 - xi) * (1.0 - 2.0 * xi), 4.0 * xi * (1.0 - xi), xi * (2.0 * xi - 1.0)])
    normal, shear = (
        sum(weight * read.parts(f"{at}{kind}", within) for weight, at in zip(three, ("start_", "", "end_"), strict=True))
        for kind in ("axial_force", "shear_force")
    )
    slopes = (-length * read.parts(f"{at}_shear_force", within) for at in ("start", "end"))
    bending = sum(
        weight * value
        for weight, value in zip(_hermite(xi)[[0, 2, 1, 3]], (start[:, part], end[:, part], *slopes), strict=True)
    )
    deflection = np.zeros((len(start), distance.size))
    span = np.clip(np.searchsorted(places, distance, side="right") - 1, 0, places.size - 2)
    for k in range(places.size - 1):
        inside, nodes = span == k, slice(SPAN_PARTS * k, SPAN_PARTS * (k + 1) + 1)
        deflection[:, inside] = node_deflection[:, nodes] @ _interpolation_matrix(marks[nodes], distance[inside])
    points = np.stack([read.body("position", name) for name in bar.sections], axis=1)
    line = _chord(points[:, 0], points[:, -1])
    projected = np.einsum("tka,ta->tk", points - points[:, :1], line)
    along = projected @ np.stack([np.interp(distance, places, unit) for unit in np.eye(places.size)])
    normal_line = np.stack([-line[:, 1], line[:, 0]], axis=1)
    position = points[:, :1] + along[..., None] * line[:, None] + deflection[..., None] * normal_line[:, None]
    return _section_forces(bar, position, normal, shear, bending) | {"deflection": deflection}


def _interpolation_matrix(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the matrix that interpolates values at nodes to the places `at` by a polynomial, shape (nodes, places)."""
    middle, half = 0.5 * (nodes[0] + nodes[-1]), 0.5 * (nodes[-1] - nodes[0])
    table = np.vander((at - middle) / half, nodes.size, increasing=True)
    return np.asarray(np.linalg.solve(np.vander((nodes - middle) / half, increasing=True).T, table.T))


def _element(beam: Beam, read: _RunReader, xi: np.ndarray) -> dict[str, np.ndarray]:
    """Return the position of the axis and the internal forces of an element at xi, by equilibrium of the part after xi."""
    shape = _Shape(beam, read)
    x, y = shape.axis(xi)
    here = shape.rotation(xi)
    (fx, fy), moment = shape.at_end()
    # loads on the part after xi: forces at its end, weight and inertia
    rest = 1.0 - xi
    between = xi[:, None] + rest[:, None] * GAUSS_NODES
    weight = GAUSS_WEIGHTS * rest[:, None] * beam.length
    px, py = (weight * part for part in shape.load(between))
    gone_x, gone_y = (beyond - here[..., None] for beyond, here in zip(shape.axis(between), (x, y), strict=True))
    along, across = fx[:, None] + px.sum(axis=2), fy[:, None] + py.sum(axis=2)
    bending = moment[:, None] + (shape.chord[:, None] - x) * fy[:, None] + y * fx[:, None]
    bending = bending + np.sum(gone_x * py - gone_y * px, axis=2)
    normal = along * np.cos(here) + across * np.sin(here)
    cos, sin = np.cos(shape.direction)[:, None], np.sin(shape.direction)[:, None]
    position = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1) + shape.start[:, None]
    return _section_forces(beam, position, normal, across * np.cos(here) - along * np.sin(here), bending)


class _Shape:
    """Beam element over time in the frame of its chord: rotation psi of the axis, loads, forces at its end."""

    def __init__(self, beam: Beam, read: _RunReader) -> None:
        ends = beam.start[0], beam.end[0]
        self.start, end = (read.body("position", name) for name in ends)
        self.chord = np.hypot(*(end - self.start).T)
        self.direction = np.arctan2(*(end - self.start).T[::-1])
        self.p1, self.p2 = (
            np.remainder(read.body("angle", name) - self.direction + math.pi, 2.0 * math.pi) - math.pi for name in ends
        )
        self.a = np.zeros_like(self.p1)
        for _ in range(3):  # Newton's method for the condition that the axis ends on the chord, int sin psi = 0
            psi = self.rotation(GAUSS_NODES)
            self.a = self.a - (np.sin(psi) @ GAUSS_WEIGHTS) / (
                (np.cos(psi) * 6.0 * GAUSS_NODES * (1.0 - GAUSS_NODES)) @ GAUSS_WEIGHTS
            )
        self.cosines = np.cos(self.rotation(GAUSS_NODES)) @ GAUSS_WEIGHTS
        self.elastic = tuple(read.beam(name, beam.name) for name in ("axial_force", "start_moment", "end_moment"))
        self.beam = beam
        # accelerations of the nodes' positions and directions minus gravity, in the frame of the chord: shape (4, samples, 2)
        moved = []
        along, across = np.cos(self.direction), np.sin(self.direction)
        for name, angle in zip(ends, (self.p1, self.p2), strict=True):
            speed, rate = read.body("angular_velocity", name), read.body("angular_acceleration", name)
            x, y = (read.body("acceleration", name) - read.gravity).T
            moved.append(np.stack([along * x + across * y, along * y - across * x], axis=-1))
            cos, sin = np.cos(angle), np.sin(angle)
            moved.append(np.stack([-sin * rate - cos * speed**2, cos * rate - sin * speed**2], axis=-1) * beam.length)
        self.moved = np.array(moved)

    def rotation(self, xi: np.ndarray) -> np.ndarray:
        """Return the rotation psi at xi [rad], shape (samples, ...)."""
        first, second, third = (part.reshape(-1, *[1] * xi.ndim) for part in (self.p1, self.p2, self.a))
        psi = first * (1.0 + xi * (3.0 * xi - 4.0)) + second * xi * (3.0 * xi - 2.0) + third * 6.0 * xi * (1.0 - xi)
        return np.asarray(psi)

    def axis(self, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates of the axis at xi, along and across the chord from its start [m]."""
        psi = self.rotation(xi[..., None] * GAUSS_NODES)
        weight = GAUSS_WEIGHTS * xi[..., None] * (self.chord / self.cosines).reshape(-1, *[1] * (xi.ndim + 1))
        return np.sum(weight * np.cos(psi), axis=-1), np.sum(weight * np.sin(psi), axis=-1)

    def load(self, xi: np.ndarray) -> np.ndarray:
        """Return weight minus inertia force per length at xi [N/m], shape (2, samples, ...)."""
        load: np.ndarray = -self.beam.mass_per_length * np.einsum("hta,h...->at...", self.moved, _hermite(xi))
        return load

    def at_end(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the force along and across the chord [N] and the moment [N m] on the end of the element."""
        axial, first, last = self.elastic
        consistent = self.beam.mass_per_length * self.beam.length / 420.0 * HERMITE_MASS
        place, direction = (np.einsum("h,hta->at", consistent[k], self.moved) for k in (2, 3))
        cos, sin = np.cos(self.p2), np.sin(self.p2)
        moment = last + self.beam.length * (cos * direction[1] - sin * direction[0])
        return np.array([axial / self.cosines, (first - last) / self.chord]) + place, moment


def _hermite(xi: np.ndarray) -> np.ndarray:
    """Return the cubic Hermite shape functions of the positions and directions of both ends at xi."""
    square, cube = xi * xi, xi * xi * xi
    return np.array([1.0 - 3.0 * square + 2.0 * cube, xi - 2.0 * square + cube, 3.0 * square - 2.0 * cube, cube - square])
