"""The walk over descriptions: each value has a path, by which it is found and replaced."""

from __future__ import annotations

from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.model.walk import at, given, is_described, leaves, replaced

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


@pytest.mark.parametrize("case", EXAMPLES, ids=lambda path: path.stem)
def test_every_value_is_found_and_replaced_at_its_path(case: Path) -> None:
    """Contract: what the walk meets is at its path, and another number there changes that one value alone."""
    mechanism = sd.read_case(case).mechanism
    met = list(leaves(mechanism))
    assert len({leaf.path for leaf in met}) == len(met) > 10
    assert all(at(mechanism, leaf.path) is leaf.value for leaf in met)
    masses = [leaf for leaf in met if leaf.quantity is not None and leaf.quantity.unit == "kg"]
    assert masses
    for leaf in masses[:4]:
        new = replaced(mechanism, leaf.path, 1.25 * leaf.value)
        changed = [(one.path, two.value) for one, two in zip(met, leaves(new), strict=True) if one.value != two.value]
        assert changed == [(leaf.path, 1.25 * leaf.value)]


@pytest.mark.parametrize("case", EXAMPLES, ids=lambda path: path.stem)
def test_what_is_given_makes_the_same(case: Path) -> None:
    """Contract: the fields that are not their default, handed to the class, make an equal description."""
    mechanism = sd.read_case(case).mechanism
    parts = [part for field in ("bodies", "joints", "guides", "drives", "components") for part in getattr(mechanism, field)]
    assert parts
    assert all(map(is_described, parts))
    for part in (mechanism, *parts):
        assert type(part)(**{field.name: value for field, value in given(part)}) == part


def test_a_tuple_with_a_unit_is_one_value() -> None:
    """Contract: points are values in metres by their names; the sign of a zero is no default."""
    body = sd.Body("rod", 1.0, 0.1, points={"tip": (0.2, 0.0)}, centre=(-0.0, 0.0))
    units = {leaf.path: leaf.quantity.unit for leaf in leaves(body) if leaf.quantity is not None}
    assert units["points", "tip"] == units["centre",] == "m"
    assert [field.name for field, _ in given(body)] == ["name", "mass", "inertia", "points", "centre"]
