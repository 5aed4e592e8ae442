"""What numbers depend on beside their description: the sources of the package and the libraries below it."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib.metadata import version
from pathlib import Path

__all__ = ["FACES", "LIBRARIES", "provenance"]

LIBRARIES = ("scissordyn", "numpy", "scipy", "numba", "llvmlite", "xarray")

FACES = ("cli", "plot")
"""Rooms that only show numbers. Every other source counts, so that a new one does without being named."""


@cache
def provenance(skip: tuple[str, ...] = (*FACES, "paper")) -> str:
    """Versions, and a digest of the sources that numbers may depend on; equal means equal numbers.

    Parameters
    ----------
    skip : tuple of str
        Folders and files of the package that no number depends on.

    Returns
    -------
    str
        JSON.
    """
    package = Path(__file__).parents[1]
    left_out = [package / name for name in skip]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        if not any(path.is_relative_to(other) for other in left_out):
            digest.update(str(path.relative_to(package)).encode())
            digest.update(path.read_bytes())
    return json.dumps({**{name: version(name) for name in LIBRARIES}, "sources": digest.hexdigest()[:16]})
