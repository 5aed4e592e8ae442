"""Diagrams on flexible bars in pictures: stress as colour, bending moment and axial force as a curve along the bar."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import beams_of
from scissordyn.plan.flexible import flexible_bars
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.style import BLUE, VERMILION, dress, small
from scissordyn.record.bars import part_names
from scissordyn.record.internal_forces import bars_of
from scissordyn.record.results import Run, values_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DIAGRAM_MAP = "viridis"
"""Colour map of stress and utilisation along bars; it is perceptually uniform, also with colour blindness."""


@dataclass(frozen=True)
class DiagramQuantity:
    unit: str
    first: str  # Variable of the run with the values at the start of each part
    last: str  # Variable of the run with the values at the end of each part
    tone: str = ""  # Colour of the ordinates; "" if the bars themselves are coloured
    needs: tuple[str, ...] = ()  # Fields that a bar must have for this quantity
    whole: str = ""  # Variable with one value per part, for elements without values at their ends


MOMENT, AXIAL = "bending moment", "axial force"

QUANTITIES: Mapping[str, DiagramQuantity] = {
    MOMENT: DiagramQuantity("N m", "beam_start_moment", "beam_end_moment", BLUE),
    AXIAL: DiagramQuantity("N", "beam_start_axial_force", "beam_end_axial_force", VERMILION, whole="beam_axial_force"),
    "stress": DiagramQuantity("Pa", "beam_stress", "beam_stress", needs=("youngs_modulus", "depth")),
    "utilisation": DiagramQuantity(
        "1", "beam_utilisation", "beam_utilisation", needs=("youngs_modulus", "depth", "yield_strength")
    ),
}
"""Quantities that can be drawn along bars; stress and utilisation are the largest of the extreme fibre in each part."""


@dataclass(frozen=True)
class Diagram:
    """Values of one quantity along bending bars, at the samples of a run."""

    quantity: str  # A key of `QUANTITIES`
    parts: tuple[str, ...]  # Names of the elements of bars, or of their parts, as in the run
    values: np.ndarray  # (samples, parts, 2) Values at the start and the end of each part; equal if a part has one value
    largest: float  # Magnitude at which the scale of colours or ordinates ends

    @property
    def coloured(self) -> bool:
        """True if the quantity is shown by the colours of the bars."""
        return not QUANTITIES[self.quantity].tone

    @property
    def scale(self) -> Scale:
        return engineering(QUANTITIES[self.quantity].unit, self.largest)

    @property
    def label(self) -> str:
        """Title of the colour bar or caption of the ordinates."""
        if self.coloured:
            return self.scale.label(self.quantity)
        side = " on the side in tension" if self.quantity == MOMENT else ""
        return f"{self.quantity}{side}, longest {self.scale.with_unit(self.largest, 3)}"

    def at(self, samples: Sequence[int] | np.ndarray) -> Diagram:
        """Return the diagram reduced to some samples, with the same scale of values."""
        return dataclasses.replace(self, values=self.values[samples])

    def envelope(self) -> Diagram:
        """Return a diagram of two samples: the largest and the smallest value at each place over all samples."""
        return dataclasses.replace(self, values=np.stack([self.values.max(axis=0), self.values.min(axis=0)]))

    def largest_value(self) -> tuple[float, str]:
        """Return the value of largest magnitude, and the name of its part."""
        at = np.unravel_index(int(np.argmax(np.abs(self.values))), self.values.shape)
        return float(self.values[at]), self.parts[at[1]]

    def ordinates(self, places: np.ndarray, length: float) -> np.ndarray:
        """Return the ends of the ordinates of all parts, shape (samples, parts, 2, 2) [m].

        A positive moment curves a bar towards its +y; the fibres at -y are then in tension, and the ordinates are drawn
        on that side.

        Shapes: `places` (samples, parts, points, 2).
        """
        start, middle, end = np.moveaxis(places[..., [0, places.shape[-2] // 2, -1], :], -2, 0)
        along = np.stack([4.0 * middle - 3.0 * start - end, 3.0 * end - 4.0 * middle + start], axis=-2)
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        across = np.stack([along[..., 1], -along[..., 0]], axis=-1)
        return np.asarray(places[..., [0, -1], :] + (length / self.largest) * self.values[..., None] * across)


def check_quantity(quantity: str, mechanism: Mechanism) -> None:
    """Raise `InputError` if the quantity is unknown, or if the mechanism's bars do not have it."""
    if quantity not in QUANTITIES:
        raise InputError(
            f"unknown quantity '{quantity}' on bars{did_you_mean(quantity, QUANTITIES)}", ", ".join(QUANTITIES), "stress"
        )
    if not bars_of(mechanism):
        raise InputError(f"{quantity}: no bar of the mechanism bends", "bending bars", "sd.with_bending(mechanism, ...)")
    for bar, need in _missing_fields(quantity, mechanism):
        raise InputError(
            f"{quantity}: bar '{bar}' has no {need}",
            "bars with a section and a material, or another quantity",
            MOMENT,
        )


def known_diagrams(run: Run, mechanism: Mechanism) -> tuple[Diagram, ...]:
    """Return all diagrams that a film of the run can draw."""
    if "beam_axial_force" not in run or not bars_of(mechanism):
        return ()
    return tuple(diagram_of(run, mechanism, name) for name in QUANTITIES if is_known(name, mechanism))


def is_known(quantity: str, mechanism: Mechanism) -> bool:
    return not _missing_fields(quantity, mechanism)


def _missing_fields(quantity: str, mechanism: Mechanism) -> list[tuple[str, str]]:
    """Return the bars that lack a required field, each with the name of that field."""
    return [
        (bar.name, need)
        for bar in bars_of(mechanism)
        for need in QUANTITIES[quantity].needs
        if not all(getattr(part, need) for part in bar.parts)
    ]


def diagram_of(run: Run, mechanism: Mechanism, quantity: str, samples: slice = slice(None)) -> Diagram:
    """Return the diagram of a quantity along the bars of a run, at its samples or some of them."""
    check_quantity(quantity, mechanism)
    shown, parts = QUANTITIES[quantity], _parts(mechanism)
    if "beam" not in run:
        raise InputError(f"{quantity}: the run has no bending bars", "a run of this mechanism")
    ends = []
    for name in (shown.first, shown.last):
        value = values_at(run, name if name in run else shown.whole, "time", "beam", beam=parts)[samples]
        if shown.whole:
            value = np.where(np.isnan(value), values_at(run, shown.whole, "time", "beam", beam=parts)[samples], value)
        ends.append(value)
    values = np.stack(ends, axis=-1)
    return Diagram(quantity, tuple(parts), values, float(np.max(np.abs(values))) or 1.0)


def _parts(mechanism: Mechanism) -> list[str]:
    """Return the names of the beam elements and of the parts of flexible bars."""
    parts = (name for bar in flexible_bars(mechanism) for name in part_names(bar))
    return [*(beam.name for beam in beams_of(mechanism)), *parts]


def part_indices(name: str, place_of: Mapping[str, int]) -> tuple[int, ...]:
    """Return the indices of a component's parts: of the element itself, or of the parts of a flexible bar."""
    if name in place_of:
        return (place_of[name],)
    indices: list[int] = []
    while (part := f"{name} {len(indices) + 1}") in place_of:
        indices.append(place_of[part])
    return tuple(indices)


def ordinate_edges(places: np.ndarray, outer: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the areas between bars and the ends of their ordinates, and the lines through these ends.

    Consecutive parts share one area and one line, so that no seam is visible; the line jumps where the values jump.

    Shapes: `places` (parts, points, 2) [m], `outer` (parts, 2, 2) [m]; returns `areas, lines` (points, 2) [m].
    """
    together = 1e-9  # ends of parts nearer than this fraction of the mechanism's longer side coincide
    size = float(np.max(np.ptp(places, axis=(0, 1)), initial=0.0))
    apart = np.linalg.norm(places[1:, 0] - places[:-1, -1], axis=-1) > together * size
    chains = np.split(np.arange(len(places)), np.flatnonzero(apart) + 1)
    lines = [outer[chain].reshape(-1, 2) for chain in chains]
    return [
        np.concatenate([places[chain].reshape(-1, 2), line[::-1]]) for chain, line in zip(chains, lines, strict=True)
    ], lines


def colour_bar(axes: list[Axes], diagram: Diagram) -> None:
    """Add a colour bar from zero to the largest value next to some panels."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure = axes[0].get_figure(root=True)
    assert figure is not None
    factor = diagram.scale.factor
    mapped = ScalarMappable(Normalize(0.0, factor * diagram.largest), DIAGRAM_MAP)
    bar = figure.colorbar(mapped, ax=axes, pad=0.02, aspect=18.0, shrink=0.9)
    bar.set_label(diagram.label, fontsize=small())
    bar.ax.tick_params(labelsize=small())
    dress(bar.ax)
