"""Components: springs, loads, motors, stops, latches and their like, one a file, description and kernel together.

The package can be called: ``sd.component(port=..., force=...)`` is the decorator `declaration.component`, whose name it has.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """As soon as a module of this package is imported, Python puts the package where `sd.component` has been."""

    def __call__(self, **options: Any) -> Any:
        """Make a class a component, see `declaration.component`."""
        from scissordyn.components.declaration import component

        return component(**options)


sys.modules[__name__].__class__ = _CallablePackage
