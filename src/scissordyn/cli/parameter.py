"""Arguments and options of a command, declared in the annotations of its function."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import click

HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}
"""Context settings of all commands: the options that print the help."""


class Argument:
    """Argument of a command, known by its position; `attributes` are those of click, and "min" and "max" of a number."""

    def __init__(self, **attributes: Any) -> None:
        self.attributes = attributes

    def make(self, name: str, kind: Any, default: Any) -> click.Argument:
        """Return the argument of click; one of a list takes all remaining words."""
        several = -1 if get_origin(kind) is list else 1
        return click.Argument([name], nargs=several, **_common_attributes(kind, default, self.attributes))


class Option:
    """Option of a command, by default with the name of the function's parameter; `attributes` as for `Argument`."""

    def __init__(self, *names: str, **attributes: Any) -> None:
        self.names, self.attributes = names, attributes

    def make(self, name: str, kind: Any, default: Any) -> click.Option:
        """Return the option of click; one of a list is repeatable, and one of a bool is a flag."""
        names = self.names or (f"--{name.replace('_', '-')}",)
        shown: dict[Any, dict[str, Any]] = {bool: {"is_flag": True}, int: {"metavar": "N"}, float: {"metavar": "X"}}
        attributes = {"show_default": default != "", "multiple": get_origin(kind) is list, **shown.get(kind, {})}
        return click.Option([name, *names], **attributes | _common_attributes(kind, default, self.attributes))


def _common_attributes(kind: Any, default: Any, attributes: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of a parameter for click, with its default, and with its type instead of its bounds."""
    kind = get_args(kind)[0] if get_origin(kind) is list else kind
    bounds = {name: attributes[name] for name in ("min", "max") if name in attributes}
    rest = {name: value for name, value in attributes.items() if name not in bounds}
    ranged = {int: click.IntRange, float: click.FloatRange}
    required = default is inspect.Parameter.empty
    return {
        "type": click.Path(path_type=Path) if kind is Path else ranged[kind](**bounds) if bounds else kind,
        "required": required,
        **({} if required else {"default": default}),
        **rest,
    }


def make_command(function: Callable[..., int], name: str, about: str, example: str) -> click.Command:
    """Return a command that parses the parameters of a function and returns the function with its arguments."""
    hints, parameters = get_type_hints(function, include_extras=True), inspect.signature(function).parameters

    def parsed(**values: Any) -> Callable[[], int]:
        lists = {key: list(value) or parameters[key].default for key, value in values.items() if isinstance(value, tuple)}
        return partial(function, **values | lists)

    arguments: list[click.Parameter] = []
    for key, parameter in parameters.items():
        kind, mark = get_args(hints[key])
        kinds = [part for part in get_args(kind) if part is not NoneType] if NoneType in get_args(kind) else [kind]
        arguments.append(mark.make(key, kinds[0], parameter.default))
    epilog = f"Example: {example}"
    return click.Command(name, params=arguments, callback=parsed, help=about, epilog=epilog, context_settings=HELP_OPTIONS)
