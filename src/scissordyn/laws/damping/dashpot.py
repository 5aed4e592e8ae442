"""The kernel that all linear dashpots share: F = F_el + C delta'."""

from __future__ import annotations

from scissordyn.jit import kernel

__all__ = ["KERNEL_KIND", "force"]

KERNEL_KIND = 1


@kernel()
def force(elastic, delta, rate, approach, p):
    """Normal force [N], not yet clipped, from the elastic part [N] and delta' [m/s]; p is C [N s/m]."""
    return elastic + p[0] * rate
