"""The kernel that all linear dashpots share: F = F_el + C delta'."""

from __future__ import annotations


def force(elastic, rate, coefficient):
    """Normal force [N], not yet clipped, from the elastic part [N] and delta' [m/s]; p is C [N s/m]."""
    return elastic + coefficient * rate
