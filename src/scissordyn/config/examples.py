"""Where the case files are that come with the package."""

from __future__ import annotations

from pathlib import Path


def folder_of_examples() -> Path:
    """Where they are: beside the package's modules in an installation, in the root of its repository otherwise."""
    package = Path(__file__).parents[1]
    installed = package / "examples"
    return installed if installed.is_dir() else package.parents[1] / "examples"
