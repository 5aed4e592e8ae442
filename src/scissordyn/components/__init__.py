"""Components: springs, loads, motors, stops, latches and others; each file has the fields and the kernels of one component.

The package is callable: ``sd.component(port=..., force=...)`` is the decorator `declaration.component`, which has the same
name.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """Module class that makes this package callable. Importing a submodule replaces `sd.component` by the package."""

    def __call__(self, **options: Any) -> Any:
        """Make a class a component, as `declaration.component` does."""
        from scissordyn.components.declaration import component

        return component(**options)


sys.modules[__name__].__class__ = _CallablePackage
