"""Points of bodies in a case file."""

from __future__ import annotations

from typing import Any

from scissordyn.annotation import MismatchError, body_point
from scissordyn.component.place import BodyPoint
from scissordyn.config.shape import Context, reader
from scissordyn.errors import InputError


@reader(lambda: {"type": "string", "pattern": r"^.+\..+$"})
def _read_body_point(given: Any, context: Context) -> BodyPoint:
    if isinstance(given, list) and len(given) == 2 and all(isinstance(name, str) for name in given):  # a name with a dot
        return given[0], given[1]
    try:
        return body_point(given if isinstance(given, str) else "")
    except MismatchError:
        raise InputError("not a point of a body", 'text "BODY.POINT", where the body may be ground', '"crank.end"') from None


BODY_POINT = _read_body_point
"""For ``Annotated[BodyPoint, BODY_POINT]``: a key whose value is "body.point"."""
