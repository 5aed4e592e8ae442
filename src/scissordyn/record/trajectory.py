"""A computed motion: samples, events, largest values, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissordyn.integrate.integration import Samples, StepRecord
from scissordyn.kernel import Handle
from scissordyn.mechanics.monitored import companions, monitored_rows
from scissordyn.mechanics.outputs import Record, record
from scissordyn.plan.plan import Plan
from scissordyn.record.events import contacts


def _rows(*columns: str | tuple[str, ...]) -> np.dtype[np.void]:
    """Return named columns of rows; a column may have one name for each kind of row."""
    names = [(name, place) for place, named in enumerate(columns) for name in ((named,) if isinstance(named, str) else named)]
    return np.dtype(
        {
            "names": [name for name, _ in names],
            "formats": ["f8"] * len(names),
            "offsets": [8 * place for _, place in names],
            "itemsize": 8 * len(columns),
        }
    )


_LARGEST = (
    "largest",
    "largest_time",
    ("impulse", "integral"),
    ("damping_loss", "square", "excess_time"),
    "friction_loss",
    ("struck", "whole"),
    ("struck_time", "whole_time"),
)

PEAK = _rows(*_LARGEST)
"""Since the last rise of a guard, or over the run: the largest value and when [s]. Of a contact the impulse of its normal force
[N s] and its losses [J]; of another quantity its integrals over time: itself, its square, or how
long it is above a limit. Of a hard contact the largest impact, as m v^2 of the single impact with the same impulse [J], and
when [s]; of a compliant one with friction, once it has ended, the largest force with friction in it, and when."""

LOG = _rows("time", "guard", "mode", "rate", ("angle", "loss"), ("drive_work", "mass"), *_LARGEST)
"""An event: when [s], of which guard, its new mode, the rate of the guard. Of a contact that begins the direction of n [rad]
and the effective mass along it [kg]; of a component what the event dissipates [J], and the work of the drives in it [J];
of a contact that ends its `PEAK`."""

BAND = _rows("limit", "last_above", "first_within")
"""Of a quantity with a limit: when it was last above, and first at or below it [s]; NaN for never."""


def by_name(rows: np.ndarray, described: np.dtype[np.void]) -> np.ndarray:
    """Return rows with names for their columns, shape (n,)."""
    return rows.view(described)[:, 0]


def unknown(rows: np.ndarray) -> np.ndarray:
    """Return rows of the same shape filled with NaN."""
    return np.full(rows.shape, np.nan).astype(rows.dtype)


@dataclass(frozen=True)
class Trajectory:
    plan: Plan
    system: Handle  # Handle of the `System`
    samples: Samples  # Trimmed to what was reached
    log: np.ndarray  # (events,)
    peak: np.ndarray  # (guards + monitors,) Of contacts still going on at the end, then of what is monitored throughout
    end: float  # Time reached [s]
    band: np.ndarray  # (monitors,) Of what is monitored throughout
    status: str = "complete"  # Or "interrupted" or "failed"
    cause: str = ""  # Why it is not complete
    # Method and the reason for it, steps, rejected, rates, jacobians, events, seconds
    statistics: dict[str, Any] = field(default_factory=dict)
    immobile: tuple[str, ...] = ()  # Clearance joints that cannot move
    warnings: tuple[str, ...] = ()  # Warnings of the start
    # Instants at which the motion passed them, and half the steps across [s]
    change_points: tuple[tuple[float, float], ...] = ()
    recorded: StepRecord | None = None  # Ends of steps, and what is located inside them

    @property
    def steps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time, state and modes at the recorded ends of steps, before the events there."""
        assert self.recorded is not None
        ends = self.recorded.end == 1
        return self.recorded.time[ends], self.recorded.state[ends], self.recorded.mode[ends]

    def record(self) -> Record:
        """Evaluate all quantities at the samples."""
        return record(self.plan.maps, self.system, self.samples)

    def contacts(self) -> np.recarray:
        return contacts(self.log, self.peak, companions(self.system.content.model)[: len(self.plan.contacts)])

    def peaks(self, kind: int) -> np.ndarray:
        """Return largest value, its instant and the integrals of one kind of monitored quantity."""
        return np.asarray(self.peak[monitored_rows(self.system.content.model, kind)])

    def monitored(self, kind: int) -> np.ndarray:
        """Return the indices of drives, components, contacts or tracked points that have a quantity of one kind."""
        monitor = self.system.content.model.monitor
        return np.asarray(monitor[monitor[:, 0] == kind, 1])

    def bands(self, kind: int) -> np.ndarray:
        """Return limit, last instant above it and first instant at or below it of one kind of monitored quantity."""
        model = self.system.content.model
        return np.asarray(self.band[monitored_rows(model, kind) - model.guard_component.size])
