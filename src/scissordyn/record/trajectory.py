"""Computed motion of a run: samples, events, largest values, and status at its end."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.integrate.integration import Samples, StepRecord
from scissordyn.kernel import Handle
from scissordyn.mechanics.outputs import record, record_in_halves
from scissordyn.mechanics.sample import Record
from scissordyn.plan.plan import Plan
from scissordyn.processor import processors
from scissordyn.record.events import contacts


def _rows(*columns: str | tuple[str, ...]) -> np.dtype[np.void]:
    """Return a dtype with named columns; a column with several names has a different meaning for each kind of row."""
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
"""Row of the largest values of a contact since its onset, or of another quantity over the run.

All rows have the largest value and its instant [s]. Rows of contacts also have the impulse of the normal force [N s] and the
losses [J]. Rows of other quantities have their time integrals: of the value, of its square, or the time above a limit. Hard
contacts have m v^2 of the single impact with the largest impulse [J] and its instant [s]. Compliant contacts with friction
have, after their end, the largest total force and its instant.
"""

LOG = _rows("time", "guard", "mode", "rate", ("angle", "loss"), ("drive_work", "mass"), *_LARGEST)
"""Row of the event log: instant [s], guard, its new mode and its rate.

The onset of a contact also has the direction of the normal [rad] and the effective mass along it [kg]. The end of a contact
has its `PEAK` columns. An event of a component has the dissipated energy [J] and the work of the drives in it [J].
"""

BAND = _rows("limit", "last_above", "first_within")
"""Row of a monitored quantity with a limit: last instant above it and first instant not above it [s]; NaN if there is none."""


def by_name(rows: np.ndarray, described: np.dtype[np.void]) -> np.ndarray:
    """Return rows of floats as a structured array with named columns, shape (n,)."""
    return rows.view(described)[:, 0]


def nan_like(rows: np.ndarray) -> np.ndarray:
    """Return an array of the same shape and type as `rows`, filled with NaN."""
    return np.full(rows.shape, np.nan).astype(rows.dtype)


@dataclass(frozen=True)
class Trajectory:
    """Motion that a run has computed: samples, event log, largest values, and the status at its end."""

    plan: Plan
    system: Handle  # Handle of the `System`
    samples: Samples  # Samples until the end of the run
    log: np.ndarray  # (events,)
    peak: np.ndarray  # (guards + monitors,) Rows of contacts at the end of the run, then of monitored quantities
    end: float  # Time reached [s]
    band: np.ndarray  # (monitors,) Rows of monitored quantities
    status: str = "complete"  # "complete", "interrupted" or "failed"
    cause: str = ""  # Reason why the run is not complete
    # Method and the reason for it, steps, rejected, rates, jacobians, events, seconds
    statistics: dict[str, Any] = field(default_factory=dict)
    start: np.ndarray | None = None  # State at the start (ny,)
    warnings: tuple[str, ...] = ()  # Warnings about the start of the run
    # Instants at which the motion passed change points, and half the size of the steps across them [s]
    change_points: tuple[tuple[float, float], ...] = ()
    recorded: StepRecord | None = None  # Ends of steps, and located instants inside them

    @property
    def steps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return time, state and modes at the recorded ends of steps, before their events."""
        assert self.recorded is not None
        ends = self.recorded.end == 1
        return self.recorded.time[ends], self.recorded.state[ends], self.recorded.mode[ends]

    def record(self, samples: Samples | None = None) -> Record:
        """Evaluate positions, velocities, accelerations and forces at samples, by default its own; many on two threads."""
        entries_min = 50_000  # [values of states] fewer take less time than a thread and a copy of the system save
        evaluated, friction = self.samples if samples is None else samples, self.system.content.friction.component.size > 0
        halves = evaluated.state.size > entries_min and not friction and processors() > 1
        return (record_in_halves if halves else record)(self.plan.maps, self.system, evaluated)

    @cached_property
    def contacts(self) -> np.ndarray:
        """Table of contacts in the order of their onsets."""
        return contacts(self.log, self.peak, self.plan.companions[: len(self.plan.contacts)])

    def peaks(self, kind: int) -> np.ndarray:
        """Return the `PEAK` rows of one kind of monitored quantity."""
        return np.asarray(self.peak[self.plan.monitored_rows(kind)])

    def root_mean_squares(self, kind: int) -> np.ndarray:
        """Return the root mean squares of one kind of monitored quantity over the run.

        The integral of squares has the error of the stages of the steps: it is limited to squares of 0 to the largest value.
        """
        peaks = self.peaks(kind)
        if self.end <= 0.0:
            return np.asarray(peaks["largest"])
        return np.asarray(np.fmin(np.sqrt(np.maximum(peaks["square"], 0.0) / self.end), peaks["largest"]))

    def monitored(self, kind: int) -> np.ndarray:
        """Return the indices of the drives, components, contacts or tracked points with a monitored quantity of this kind."""
        monitor = self.system.content.model.monitor
        return np.asarray(monitor[monitor[:, 0] == kind, 1])

    def bands(self, kind: int) -> np.ndarray:
        """Return the `BAND` rows of one kind of monitored quantity."""
        return np.asarray(self.band[self.plan.monitored_rows(kind) - self.plan.model.guard_component.size])
