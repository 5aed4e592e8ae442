"""Time stepping with hard contacts as functions of addresses, by the names that its loop calls."""

from __future__ import annotations

from scissordyn.kernel import kernel
from scissordyn.mechanics import hard_contact, hard_impact, hard_powers
from scissordyn.mechanics.hard_rows import open_hard
from scissordyn.mechanics.system import open_system


@kernel
def step(t, h, y, new, address, hard):
    """See `hard_contact.hard_step`."""
    hard_contact.hard_step(t, h, y, new, open_system(address), open_hard(hard))


@kernel
def restore(hard):
    """See `hard_contact.restore`."""
    hard_contact.restore(open_hard(hard))


@kernel
def guards_ahead(t, y, address, hard, value, rate):
    """See `hard_contact.guards_ahead`."""
    hard_contact.guards_ahead(t, y, value, rate, open_system(address), open_hard(hard))


@kernel
def impact(t, h, y, address, hard):
    """See `hard_impact.hard_impact`."""
    hard_impact.hard_impact(t, h, y, open_system(address), open_hard(hard))


@kernel
def monitor(t, h, y, address, hard, power, rows):
    """See `hard_powers.hard_monitor`."""
    hard_powers.hard_monitor(t, h, y, open_system(address), open_hard(hard), power, rows)


HARD_FUNCTIONS = {"step": step, "restore": restore, "guards_ahead": guards_ahead, "impact": impact, "monitor": monitor}
