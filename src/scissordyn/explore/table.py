"""The table of contacts; a click on a row moves the animation there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS, DataTable, InlineStyleSheet, NumberFormatter, TableColumn

from scissordyn.explore.shell import area
from scissordyn.plot.scale import Scale, engineering

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ContactTable"]

COLUMNS = (
    ("contact_start", "start", "s"),
    ("approach_speed", "approach", "m/s"),
    ("peak_force", "peak force", "N"),
    ("contact_duration", "duration", "s"),
    ("rebound_speed", "rebound", "m/s"),
)

USUAL = {"s": "ms", "N": "kN"}
"""Units of most runs; with other ones the browser makes the table anew, once for each column."""

LONG = 10.0
"""Shorter times are in milliseconds [s]."""

LOOK = """
:host { --background-color: var(--sd-back, #fff); color: var(--sd-ink, #222) }
.slick-row, .slick-header-column, .slick-cell, .slick-header, .slick-header-columns, .slick-viewport, .bk-data-table
  { background: var(--sd-back, #fff) !important; color: var(--sd-ink, #222) !important }
.slick-header-column { font-size: 10px; padding: 4px 2px !important }
.slick-row.active, .slick-cell.selected { background: var(--sd-fill, #e4e4e4) !important }
"""

CLICKED = """
if (cb_obj.indices.length) {
  const k = cb_obj.indices[0];
  window.dispatchEvent(new CustomEvent("scissordyn:go", { detail: source.data["seconds"][k] }));
}
"""


class ContactTable:
    """The contacts of a run.

    It shows times in ms, forces in kN: units that suit the numbers of the run.
    """

    def __init__(self) -> None:
        names = ["number", "joint", "seconds", *(name for name, _, _ in COLUMNS)]
        self.source = ColumnDataSource({name: [] for name in names}, name="contact data")
        self.columns = [TableColumn(field="number", title="#", width=36), TableColumn(field="joint", title="joint", width=130)]
        form = NumberFormatter(format="0.000", nan_format="-")
        for name, title, unit in COLUMNS:
            shown = f"{title} [{USUAL.get(unit, unit)}]"
            self.columns.append(TableColumn(field=name, title=shown, formatter=form, width=84))
        self.table: Any = DataTable(
            source=self.source,
            columns=self.columns,
            sizing_mode="stretch_both",
            styles=area("table"),
            index_position=None,
            reorderable=False,
            stylesheets=[InlineStyleSheet(css=LOOK)],
            name="contacts",
        )
        self.source.selected.js_on_change("indices", CustomJS(args={"source": self.source}, code=CLICKED))

    def show(self, run: xr.Dataset) -> None:
        """Write the contacts of a run."""
        count = run.sizes["contact"]
        data: dict[str, Any] = {
            "number": np.arange(1, count + 1),
            "joint": run["contact_joint"].values.astype(str),
            "seconds": run["contact_start"].values,
        }
        for (name, title, unit), column in zip(COLUMNS, self.columns[2:], strict=True):
            values = run[name].values
            finite = np.abs(values[np.isfinite(values)])
            scale = engineering(unit, finite) if unit in ("s", "N") else Scale(1.0, unit)
            if scale.unit == "s" and finite.max(initial=0.0) < LONG:  # contacts last for less than a digit of seconds
                scale = Scale(1e3, "ms")
            data[name] = scale.factor * values
            column.title = f"{title} [{scale.unit}]"
        self.source.selected.indices = []
        self.source.data = data
