"""Arguments and options of a command, declared in the annotations of its function."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import click


class Parameter:
    """Argument or option; `attributes` are those of click, and "min" and "max" of a number."""

    def __init__(self, *names: str, **attributes: Any) -> None:
        self.names, self.attributes = names, attributes

    def made(self, name: str, kind: Any, default: Any) -> click.Parameter:
        """Return the parameter of click for a parameter of a function, its type without None, and its default."""
        raise NotImplementedError


class Argument(Parameter):
    """Argument of a command, known by its position."""

    def made(self, name: str, kind: Any, default: Any) -> click.Parameter:
        """Return the argument of click; one of a list takes all remaining words."""
        given: dict[str, Any] = (
            {"required": True} if default is inspect.Parameter.empty else {"required": False, "default": default}
        )
        return click.Argument([name], nargs=-1 if get_origin(kind) is list else 1, **given | _typed(kind, self.attributes))


class Option(Parameter):
    """Option of a command; without a name it has that of the function's parameter."""

    def made(self, name: str, kind: Any, default: Any) -> click.Parameter:
        """Return the option of click; one of a list is repeatable, and one of a bool is a flag."""
        names = self.names or (f"--{name.replace('_', '-')}",)
        required = default is inspect.Parameter.empty
        given: dict[str, Any] = {"required": required} | ({} if required else {"default": default})
        given |= {"show_default": default != "", "multiple": get_origin(kind) is list}
        shown: dict[Any, dict[str, Any]] = {bool: {"is_flag": True}, int: {"metavar": "N"}, float: {"metavar": "X"}}
        return click.Option([name, *names], **given | shown.get(kind, {}) | _typed(kind, self.attributes))


def _typed(kind: Any, attributes: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of a parameter with its type instead of its bounds."""
    kind = get_args(kind)[0] if get_origin(kind) is list else kind
    bounds = {name: attributes[name] for name in ("min", "max") if name in attributes}
    rest = {name: value for name, value in attributes.items() if name not in bounds}
    ranged = {int: click.IntRange, float: click.FloatRange}
    return {"type": click.Path(path_type=Path) if kind is Path else ranged[kind](**bounds) if bounds else kind, **rest}


def make_command(function: Callable[..., int], name: str, about: str, example: str) -> click.Command:
    """Return a command that parses the parameters of a function and returns the function with its arguments."""
    hints, parameters = get_type_hints(function, include_extras=True), inspect.signature(function).parameters

    def parsed(**values: Any) -> Callable[[], int]:
        lists = {key: list(value) or parameters[key].default for key, value in values.items() if isinstance(value, tuple)}
        return partial(function, **values | lists)

    made = []
    for key, parameter in parameters.items():
        kind, mark = get_args(hints[key])
        kinds = [part for part in get_args(kind) if part is not NoneType] if NoneType in get_args(kind) else [kind]
        made.append(mark.made(key, kinds[0], parameter.default))
    return click.Command(
        name,
        params=made,
        callback=parsed,
        help=about,
        epilog=f"Example: {example}",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
