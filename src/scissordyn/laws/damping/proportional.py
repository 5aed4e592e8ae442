"""The kernel that all damping factors share: F = F_el (1 + xi delta'/delta'(-))."""

from __future__ import annotations

from scissordyn.jit import kernel

__all__ = ["KERNEL_KIND", "force"]

KERNEL_KIND = 0


@kernel()
def force(elastic, delta, rate, approach, p):
    """Normal force [N], not yet clipped, from the elastic part [N], delta' [m/s] and delta'(-) [m/s]."""
    return elastic * (1.0 + p[0] * rate / approach)
