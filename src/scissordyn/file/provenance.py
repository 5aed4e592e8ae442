"""Provenance of results: a digest of the package's sources, and the versions of the libraries."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

LIBRARIES = ("scissordyn", "numpy", "scipy", "xarray")  # packages whose versions a result records

PACKAGE = Path(__file__).parents[1]  # folder with the sources of this package

DISPLAY_SUBPACKAGES = ("cli", "plot")  # subpackages that only show results; the digest of sources omits them


@cache
def provenance(skip: tuple[str, ...] = DISPLAY_SUBPACKAGES, packages: tuple[Path, ...] = (PACKAGE,)) -> str:
    """Return library versions and a digest of the sources that may affect results, as JSON; equal texts mean equal results."""
    from importlib.metadata import version

    digest = hashlib.sha256()
    for package in packages:
        left_out = [package / name for name in skip]
        for path in sorted([*package.rglob("*.py"), *package.rglob("*.c")]):
            if not any(path.is_relative_to(other) for other in left_out):
                digest.update(str(path.relative_to(package)).encode())
                digest.update(path.read_bytes())
    return json.dumps({**{name: version(name) for name in LIBRARIES}, "sources": digest.hexdigest()[:16]})
