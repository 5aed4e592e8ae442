"""Find steps in which a sliding reverses. Most friction laws have a kink there, which no step of the run locates."""

from __future__ import annotations

from scissordyn.kernel import kernel, value_of
from scissordyn.mechanics.system import open_system


@kernel
def sliding(system, target):
    """Write the slip speeds of contacts and the rates of components as last evaluated; others for open contacts."""
    S = open_system(system)
    contacts, components = S.work.contact, S.work.coordinate_rates
    for j in range(contacts.size):
        target[j] = value_of(contacts[j].slip)
    for i in range(components.shape[0]):
        for q in range(components.shape[1]):
            target[contacts.size + components.shape[1] * i + q] = value_of(components[i, q])


@kernel
def count_reversals(before, after):
    """Return the number of speeds that have changed their sign."""
    count = 0
    for k in range(before.size):
        if before[k] * after[k] < 0.0:
            count += 1
    return count
