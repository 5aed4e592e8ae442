"""The kernel that all constant power laws share: F = K delta^n."""

from __future__ import annotations

from scissordyn.jit import kernel

__all__ = ["KERNEL_KIND", "energy", "force"]

KERNEL_KIND = 3


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]; p is K [N/m^n] and n."""
    return p[0] * delta ** p[1]


@kernel()
def energy(delta, p):
    """Work [J] to press in by delta [m]."""
    return p[0] * delta ** (p[1] + 1.0) / (p[1] + 1.0)
