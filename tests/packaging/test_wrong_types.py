"""Wrong types: public functions refuse them with the package's own error."""

from __future__ import annotations

import inspect
import math
import random
from typing import Any

import pytest

import scissordyn as sd

# Values of many types, most of them wrong, with which public functions are called
VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 3, 1.5, math.nan, math.inf, "", "text", b"bytes", [], [1], {}, {"a": 1}, (1, 2), object(), int, 1j),
    lambda value: value,
)

DRAWS = 12  # Number of random calls of each function


def public_functions() -> list[str]:
    """Return names of all public functions and classes but errors."""
    named = ((name, getattr(sd, name)) for name in sd.__all__)
    return [name for name, one in named if callable(one) and not (isinstance(one, type) and issubclass(one, BaseException))]


def drawn(name: str, number: int) -> tuple[list[Any], dict[str, Any]]:
    """Return arguments of wrong types for all required parameters, and sometimes for an optional one."""
    chance, positional, named = random.Random(f"{name} {number}"), list[Any](), dict[str, Any]()
    optional = []
    for parameter in inspect.signature(getattr(sd, name)).parameters.values():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        if parameter.default is not parameter.empty:
            optional.append(parameter.name)
        elif parameter.kind is parameter.KEYWORD_ONLY:
            named[parameter.name] = chance.choice(VALUES)
        else:
            positional.append(chance.choice(VALUES))
    if optional and chance.random() < 0.5:
        named[chance.choice(optional)] = chance.choice(VALUES)
    return positional, named


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", public_functions())
def test_wrong_types_are_the_errors_of_the_package(name, tmp_path, monkeypatch):
    """Contract: random values of wrong types are accepted or refused with `ScissordynError`, never with another error."""
    monkeypatch.chdir(tmp_path)
    for number in range(DRAWS):
        positional, named = drawn(name, number)
        try:
            getattr(sd, name)(*positional, **named)
        except sd.ScissordynError:  # one line always
            continue
        except Exception as error:
            raise AssertionError(f"sd.{name}(*{positional}, **{named})") from error


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "30 deg", None, True, 1j])
def test_units_refuse_values_that_are_not_finite(value):
    """Contract: angles and speeds are finite numbers."""
    for function in (sd.degrees, sd.rpm):
        with pytest.raises(sd.InputError, match="expected a finite number"):
            function(value)


@pytest.mark.parametrize("name", ["goals", "measures", "requirements"])
def test_lists_of_texts_of_a_study(name):
    """Contract: a number in the place of a text, or of a list of texts, is an error in one line."""
    given = {"measures": "peak_force", name: 0}
    with pytest.raises(sd.InputError, match=f"study: {name} = 0; expected a text, or a list of texts"):
        sd.study(sd.slider_crank(), until=1e-3, factors={"crank.mass": (1.0, 2.0)}, **given)
