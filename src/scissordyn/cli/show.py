"""The summary and the table of contacts of a run."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr
from rich import box
from rich.console import Console, HighlighterType, JustifyMethod, OverflowMethod
from rich.style import Style
from rich.table import Table
from rich.text import Text

from scissordyn.cli.scale import column, short
from scissordyn.errors import printable
from scissordyn.simulation.warn import energy_turned_over

__all__ = ["TextConsole", "console", "counted", "show_events", "show_summary"]

WIDTH = 100
"""Columns of the output without a terminal."""


class TextConsole(Console):
    """A console on which every text is shown as it is: names from files are no markup, no emoji and no escape codes."""

    def render_str(
        self,
        text: str,
        *,
        style: str | Style = "",
        justify: JustifyMethod | None = None,
        overflow: OverflowMethod | None = None,
        emoji: bool | None = None,
        markup: bool | None = None,
        highlight: bool | None = None,
        highlighter: HighlighterType | None = None,
    ) -> Text:
        """The text, line by line, with its control characters made visible."""
        lines = "\n".join(map(printable, text.split("\n")))
        return super().render_str(lines, style=style, justify=justify, overflow=overflow, emoji=False, markup=False)


def console() -> Console:
    """Console on stdout, not narrower than the tables for a file or a pipe."""
    plain = TextConsole(highlight=False, soft_wrap=False)
    return plain if plain.is_terminal else TextConsole(highlight=False, width=WIDTH)


def counted(number: int, thing: str = "contact") -> str:
    """A count of things, as "1 contact" or "3 contacts"."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def show_events(run: xr.Dataset, rows: int, to: Console) -> None:
    """Print the first contacts of a run.

    Parameters
    ----------
    run : Dataset
    rows : int
        Largest number of contacts to show.
    to : Console
    """
    found = run.sizes["contact"]
    if not found or rows <= 0:
        return
    shown = run.isel(contact=slice(0, rows))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("contact", justify="right")
    table.add_column("joint", no_wrap=True)
    columns = [list(map(str, range(1, shown.sizes["contact"] + 1))), shown["contact_joint"].values.tolist()]
    headings = (
        ("start", "contact_start", "s", 1.0),
        ("approach", "approach_speed", "m/s", 1.0),
        ("angle of n", "contact_angle", "deg", 180.0 / math.pi),
        ("peak force", "peak_force", "N", 1.0),
        ("to peak", "peak_time", "s", 1.0),
        ("duration", "contact_duration", "s", 1.0),
        ("rebound", "rebound_speed", "m/s", 1.0),
    )
    for title, name, unit, factor in headings:
        unit, texts = column(shown[name].values * factor, unit)
        table.add_column(f"{title}\n[{unit}]", justify="right")
        columns.append(texts)
    for row in zip(*columns, strict=True):
        table.add_row(*row)
    to.print(table)
    if found > rows:
        to.print(f"... and {counted(found - rows, 'more contact')} (--events {found} shows all)\n")


def _locked_and_stopped(run: xr.Dataset) -> list[str]:
    """Sentences on latches that locked and on end stops."""
    if "event_kind" not in run:
        return []
    found = []
    events = zip(run["event_name"].values, run["event_kind"].values, run["event_time"].values, strict=True)
    losses = run["event_loss"].values
    reached: dict[str, list[float]] = {}
    for (name, kind, when), loss in zip(events, losses, strict=True):
        if kind == "locked":
            found.append(f"Latch {name} locked at {short(float(when), 's')}, with a loss of {short(float(loss), 'J')}.")
        elif kind == "reached":
            reached.setdefault(str(name), []).append(float(when))
    for name, times in reached.items():
        found.append(f"End stop {name} was reached {counted(len(times), 'time')}, first at {short(times[0], 's')}.")
    return found


def show_summary(run: xr.Dataset, to: Console) -> None:
    """Print a run in one paragraph, and its warnings."""
    attributes = run.attrs
    statistics = json.loads(attributes["statistics"])
    end = float(attributes["end"])
    parts = [
        f"{short(end, 's')} simulated in {short(statistics['seconds'], 's')}: {statistics['steps']} steps of "
        f"{statistics['method']}, {statistics['rejected']} rejected."
    ]
    for joint in dict.fromkeys(run["contact_joint"].values.tolist()):
        here = run.isel(contact=np.flatnonzero(run["contact_joint"].values == joint))
        lasting = np.where(
            np.isnan(here["contact_duration"].values), end - here["contact_start"].values, here["contact_duration"].values
        )
        highest = int(np.argmax(here["peak_force"].values))
        when = float(here["contact_start"].values[highest] + here["peak_time"].values[highest])
        fraction = float(lasting.sum()) / end if end > 0.0 else 0.0
        parts.append(
            f"Joint {joint}: {counted(here.sizes['contact'])}, in contact {100.0 * fraction:.3g} % of the time, "
            f"largest force {short(float(here['peak_force'].values[highest]), 'N')} at {short(when, 's')}."
        )
    parts += _locked_and_stopped(run)
    if run.sizes["time"]:
        residual = float(np.abs(run["energy_residual"].values).max())
        turned_over = energy_turned_over(run)
        relative = f", {residual / turned_over:.1e} of the converted energy" if turned_over > 0.0 else ""
        parts.append(f"The energy balance closes to {short(residual, 'J')}{relative}.")
    if "trusted_until" in attributes:
        trusted, contacts = float(attributes["trusted_until"]), counted(int(attributes["trusted_contacts"]))
        parts.append(f"Trusted until {short(trusted, 's')}, through {contacts}.")
    elif "predictability" in attributes:
        parts.append(f"The predictability horizon is {attributes['predictability']}.")
    to.print(" ".join(parts), markup=False)
    for warning in json.loads(attributes["warnings"]):
        to.print(f"Warning: {warning}", markup=False)
