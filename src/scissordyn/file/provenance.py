"""What numbers depend on beside their description: the sources of the package and the libraries below it."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib.metadata import version
from pathlib import Path

LIBRARIES = ("scissordyn", "numpy", "scipy", "xarray")

PACKAGE = Path(__file__).parents[1]

FACES = ("cli", "plot")  # Rooms that only show numbers. Every other source counts, so that a new one does without being named


@cache
def provenance(skip: tuple[str, ...] = FACES, packages: tuple[Path, ...] = (PACKAGE,)) -> str:
    """Versions, and a digest of the sources that numbers may depend on; equal means equal numbers."""
    digest = hashlib.sha256()
    for package in packages:
        left_out = [package / name for name in skip]
        for path in sorted([*package.rglob("*.py"), *package.rglob("*.c")]):
            if not any(path.is_relative_to(other) for other in left_out):
                digest.update(str(path.relative_to(package)).encode())
                digest.update(path.read_bytes())
    return json.dumps({**{name: version(name) for name in LIBRARIES}, "sources": digest.hexdigest()[:16]})
