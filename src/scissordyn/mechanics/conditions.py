"""The quadratic conditions of a mechanism: unit lengths, moving guides, massless links and latches."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.errors import InputError
from scissordyn.mechanics.elimination import Elimination, Expression, contradiction, in_words
from scissordyn.mechanics.form import Condition, Form, Layout, combine
from scissordyn.mechanics.motion import course_start
from scissordyn.model.body import GROUND

__all__ = ["find_conditions", "order_conditions"]

CONTRADICTION = 1e-7
"""Lengths that differ by less than this fraction are one length."""

NAMED = 3
"""So many of a family of parallel bodies are named."""


def find_conditions(layout: Layout, elimination: Elimination) -> tuple[Condition, ...]:
    """The quadratic conditions of a mechanism.

    Parameters
    ----------
    layout : Layout
        Without conditions.
    elimination : Elimination
        Of the linear conditions, to say which of them contradict a length.

    Returns
    -------
    tuple of Condition

    Raises
    ------
    InputError
        If what is known of a body's direction contradicts its length.
    """
    found = [*_lengths(layout, elimination), *_moving_guides(layout), *_links(layout), *_latches(layout)]
    return order_conditions(layout, found)


def order_conditions(layout: Layout, found: list[Condition]) -> tuple[Condition, ...]:
    """Conditions in an order in which those that share coordinates are near."""
    if len(found) < 3:
        return tuple(found)
    rows = np.repeat(np.arange(len(found)), [condition.columns.size for condition in found])
    columns = np.concatenate([condition.columns for condition in found])
    free = columns < layout.free
    incidence = sp.csr_array((np.ones(int(np.sum(free))), (rows[free], columns[free])), shape=(len(found), layout.free))
    graph = sp.csr_array(incidence @ incidence.T)
    return tuple(found[index] for index in reverse_cuthill_mckee(graph, symmetric_mode=True))


def _lengths(layout: Layout, elimination: Elimination) -> list[Condition]:
    """One condition of unit length per family of parallel bars."""
    families: dict[tuple[bytes, ...], list[str]] = {}
    forms: dict[str, Form] = {}
    sizes: dict[str, float] = {}
    for body in layout.mechanism.bodies:
        if not body.rotates:
            continue
        form = layout.direction(body.name)
        square = form.rows.T @ form.rows  # the same for directions that differ by a rotation
        if not np.any(form.columns < layout.free):
            length = _known_length(layout, form, square)
            if not abs(length - 1.0) <= CONTRADICTION:  # NaN is no length
                raise _wrong_length(layout, elimination, body.name, length)
            continue
        scale = np.max(np.abs(square))
        row, column = np.nonzero(np.abs(square) > 1e-12 * scale)
        values = np.round(square[row, column] / scale, 9) + 0.0  # no negative zeros
        key = form.columns[row].tobytes(), form.columns[column].tobytes(), values.tobytes()
        family = families.setdefault(key, [])
        family.append(body.name)
        forms[body.name], sizes[body.name] = form, math.sqrt(float(scale))
        length = sizes[body.name] / sizes[family[0]]
        if abs(length - 1.0) > CONTRADICTION:
            raise _wrong_length(layout, elimination, body.name, length, family[0])
    return [
        Condition(((1.0, forms[family[0]]),), 0.5, subject=_bodies(family), bodies=tuple(family))
        for family in families.values()
    ]


def _bodies(names: list[str]) -> str:
    """Parallel bodies in words."""
    quoted = [f"'{name}'" for name in names]
    return ("body " if len(names) == 1 else "bodies ") + in_words(quoted, NAMED)


def _known_length(layout: Layout, form: Form, square: np.ndarray) -> float:
    """Length of a direction that only b(t) enters; NaN if it varies with the drives.

    |d|^2 = b^T Q b is constant for all angles th_i if Q has no coupling between 1 and the drives, nor between two drives, and
    is a multiple of the identity for each drive; it is then the sum of these multiples.
    """
    basis = form.columns - layout.free
    full = np.zeros((layout.basis, layout.basis))
    full[np.ix_(basis, basis)] = square
    total = full[0, 0]
    expected = np.zeros_like(full)
    expected[0, 0] = total
    for first in range(1, layout.basis, 2):
        share = 0.5 * (full[first, first] + full[first + 1, first + 1])
        expected[first, first] = expected[first + 1, first + 1] = share
        total += share
    varies = np.max(np.abs(full - expected)) > CONTRADICTION
    return math.nan if varies else math.sqrt(max(float(total), 0.0))


def _wrong_length(layout: Layout, elimination: Elimination, body: str, length: float, twin: str = "") -> InputError:
    """The error for a body whose direction, known or a multiple of that of its twin, would not have its length."""
    d = layout.offsets[body] + 2
    relation: list[Expression] = [{d: 1.0}, {d + 1: 1.0}]
    if twin:
        turn = layout.direction(body).rows @ np.linalg.pinv(layout.direction(twin).rows)
        e = layout.offsets[twin] + 2
        relation = [{d + axis: 1.0, e: -float(turn[axis, 0]), e + 1: -float(turn[axis, 1])} for axis in (0, 1)]
    change = (
        "would have to change its length" if math.isnan(length) else f"would have to be {length:.6g} times as long as it is"
    )
    return contradiction(elimination.behind(relation), f"body '{body}' {change}")


def _moving_guides(layout: Layout) -> list[Condition]:
    """Followers on lines that moving bodies carry.

    With w from the body's origin to the follower and g the unit vector across the line, w . g is constant.
    """
    found = []
    for guide in layout.mechanism.guides:
        if guide.body == GROUND or guide.clearance is not None:
            continue
        across = -math.sin(guide.direction), math.cos(guide.direction)
        turned = layout.direction(guide.body)
        g = Form(turned.columns, np.array([[across[0], -across[1]], [across[1], across[0]]]) @ turned.rows)
        w = combine([(layout.place(guide.follower), 1.0), (layout.origin(guide.body), -1.0)])
        level = across[0] * guide.through[0] + across[1] * guide.through[1]
        subject = f"guide '{guide.name}' of bodies '{guide.follower[0]}' and '{guide.body}'"
        parts = _product(w, g)
        if any(np.any(form.columns < layout.free) for _, form in parts):
            found.append(Condition(parts, level, subject=subject, bodies=(guide.follower[0], guide.body)))
            continue
        raise InputError(f"{subject} lies between bodies that cannot move against each other", "leave it out")
    return found


def _product(w: Form, g: Form) -> tuple[tuple[float, Form], ...]:
    """The scalar product w . g as weighted squares of w + g and w - g."""
    return (0.5, combine([(w, 1.0), (g, 1.0)])), (-0.5, combine([(w, 1.0), (g, -1.0)]))


def _links(layout: Layout) -> list[Condition]:
    """Massless links: |end - start|^2 / 2 is constant, or follows a course."""
    mechanism, found = layout.mechanism, []
    for link in mechanism.rods:
        form = combine([(layout.place(link.end), 1.0), (layout.place(link.start), -1.0)])
        if not np.any(form.columns < layout.free):
            raise InputError(f"rod '{link.name}' between points that cannot move against each other", "leave it out")
        length = course_start(link.motion) if link.motion else link.length
        if length is None:
            length = math.dist(mechanism.place(link.start), mechanism.place(link.end))
        if not length > 0.0:
            raise InputError(f"rod '{link.name}' starts with length {length:g} m", "a positive length")
        found.append(
            Condition(
                ((1.0, form),),
                0.5 * length * length,
                link.name,
                link.motion,
                subject=f"rod '{link.name}'",
                bodies=(link.start[0], link.end[0]),
            )
        )
    return found


def _latches(layout: Layout) -> list[Condition]:
    """Latches: with w the body's direction turned back by the angle and g the base's turned left, w . g = 0."""
    found = []
    for latch in layout.mechanism.latches:
        cos, sin = math.cos(latch.angle), math.sin(latch.angle)
        body = layout.direction(latch.body)
        base = layout.fixed_direction if latch.base == GROUND else layout.direction(latch.base)
        w = Form(body.columns, np.array([[cos, sin], [-sin, cos]]) @ body.rows)
        parts = _product(w, Form(base.columns, np.array([[0.0, -1.0], [1.0, 0.0]]) @ base.rows))
        if not any(np.any(form.columns < layout.free) for _, form in parts):
            raise InputError(f"latch '{latch.name}' between bodies whose angle is prescribed", "bodies that can turn freely")
        found.append(
            Condition(parts, 0.0, latch.name, latch=True, subject=f"latch '{latch.name}'", bodies=(latch.body, latch.base))
        )
    return found
