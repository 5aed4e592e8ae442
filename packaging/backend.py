"""Setuptools, with a C compiler from PyPI on a machine that has none, or for another machine."""

import os
import shutil
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403


def _requirements() -> list[str]:
    compilers = os.environ.get("CC", "").split()[:1] or ["cc", "gcc", "clang"]
    elsewhere = bool(os.environ.get("SCISSORDYN_TARGET"))
    return ["numpy>=2.0", "scipy>=1.14", *(["ziglang"] if elsewhere or not any(map(shutil.which, compilers)) else [])]


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """What kernels are translated and compiled with."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *_requirements()]


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """The same for an installation in place."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *_requirements()]
