"""Dynamics of deployable scissor structures, and of any planar mechanism, with clearance, contact and friction in joints."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

__version__ = "0.1.0"


def _homes() -> dict[str, str]:
    """Where each public name is defined: what `__init__.pyi` imports. It is imported when it is first used."""
    homes: dict[str, str] = {}
    with open(f"{__file__}i", encoding="utf-8") as stub:
        imports = stub.read().split("\nfrom scissordyn.")[1:]
    for words in map(str.split, imports):
        homes |= {words[k - 1].strip("("): words[0] for k, word in enumerate(words) if word == "as"}
    return homes


_HOME = _homes()

__all__ = sorted([*_HOME, "plot"], key=lambda name: (not name.isupper(), not name[0].isupper(), name))


class _Study(ModuleType):
    """The room of studies, which can be called: ``sd.study(...)``."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        return _study()(*given, **named)

    def __dir__(self) -> list[str]:
        return []

    __doc__ = property(lambda _: _study().__doc__)
    __signature__ = property(lambda _: import_module("inspect").signature(_study()))


def _study() -> Any:
    from scissordyn.lookup import public

    return public("scissordyn", "study", _HOME)


class _Package(ModuleType):
    """The package. Its function `study` has the name of a room, which Python would put in its place when it loads that."""

    @property
    def study(self) -> Any:
        return import_module("scissordyn.study")

    @study.setter
    def study(self, room: ModuleType) -> None:
        room.__class__ = _Study


def __getattr__(name: str) -> Any:
    if name == "plot":  # a room with names of its own
        return import_module("scissordyn.plot")
    from scissordyn.lookup import public

    value = globals()[name] = public("scissordyn", name, _HOME)
    return value


def __dir__() -> list[str]:
    return ["__version__", *__all__]


sys.modules[__name__].__class__ = _Package
