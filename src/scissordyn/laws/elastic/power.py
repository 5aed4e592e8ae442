"""The kernel that all constant power laws share: F = K delta^n."""

from __future__ import annotations


def force(indentation, coefficient, exponent):
    """Force [N] at indentation delta > 0 [m]; p is K [N/m^n] and n."""
    return coefficient * indentation**exponent


def energy(indentation, coefficient, exponent):
    """Work [J] to press in by delta [m]."""
    return coefficient * indentation ** (exponent + 1.0) / (exponent + 1.0)
