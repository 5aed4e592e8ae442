"""Slopes of laws without derivatives, for parts of stiff steps that straddle a kink."""

from __future__ import annotations

from scissordyn.kernel import kernel, value_of
from scissordyn.mechanics.system import open_system


@kernel
def freeze(array):
    """Remove the derivatives of an array."""
    for k in range(array.size):
        array[k] = value_of(array[k])


@kernel
def freeze_slopes(system):
    """Remove the derivatives of the slopes of force elements, which are differences: at a kink they are nearly infinite."""
    W = open_system(system).work
    freeze(W.block_v)
    freeze(W.block_x)
    freeze(W.force_by_state)
    freeze(W.rate_by_v)
    freeze(W.rate_by_x)
    freeze(W.rate_by_state)
