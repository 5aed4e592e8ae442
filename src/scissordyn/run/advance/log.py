"""What an integration logs, by name: events, largest values and bands, as views of the integrator's rows."""

from __future__ import annotations

import numpy as np


def _rows(*columns: str | tuple[str, ...]) -> np.dtype[np.void]:
    """Rows of numbers; a column may have one name for each kind of row."""
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
"""An event: when [s], of which guard, its new mode, the rate of the guard. Of a contact that begins the direction of n [rad],
of a hard one its effective mass [kg] too; of a component what the event dissipates [J], and the work of the drives in it [J];
of a contact that ends its `PEAK`."""

BAND = _rows("limit", "last_above", "first_within")
"""Of a quantity with a limit: when it was last above, and first at or below it [s]; NaN for never."""


def by_name(rows: np.ndarray, described: np.dtype[np.void]) -> np.ndarray:
    """Rows of numbers with names for their columns, shape (n,)."""
    return rows.view(described)[:, 0]


def unknown(rows: np.ndarray) -> np.ndarray:
    """As many rows in which nothing is known."""
    return np.full(rows.shape, np.nan).astype(rows.dtype)
