"""Changes to a case from the command line."""

from __future__ import annotations

from typing import Any

import pytest

from scissordyn.config.change import changed
from scissordyn.errors import InputError


def tree() -> dict[str, Any]:
    """A parsed case of two clearance joints."""
    return {
        "drive": {"speed": "150 rpm"},
        "clearance": [
            {"joint": "A", "clearance": "0.5 mm", "friction": "lugre"},
            {"joint": "unit 1/pivot", "clearance": "1 mm"},
        ],
    }


@pytest.mark.parametrize(
    ("change", "path", "value"),
    [
        ("drive.speed=250 rpm", ("drive", "speed"), "250 rpm"),
        ("drive.speed = 250 rpm", ("drive", "speed"), "250 rpm"),
        ("drive.speed='250 rpm'", ("drive", "speed"), "250 rpm"),
        ("run.samples=11", ("run", "samples"), 11),
        ("run.trust=true", ("run", "trust"), True),
        ("clearance.1.clearance=2 mm", ("clearance", 1, "clearance"), "2 mm"),
        ("clearance.unit 1/pivot.clearance=2 mm", ("clearance", 1, "clearance"), "2 mm"),
        ("clearance.A.friction.kinetic=0.1", ("clearance", 0, "friction"), {"law": "lugre", "kinetic": 0.1}),
        ("clearance.A.friction={law='ambrosio'}", ("clearance", 0, "friction"), {"law": "ambrosio"}),
        ("run.note=a=b", ("run", "note"), "a=b"),
        ("run.note=1\nother = 2", ("run", "note"), "1\nother = 2"),
        ("drive.table.time=0 1 ms", ("drive", "table"), {"time": "0 1 ms"}),
    ],
)
def test_a_change_is_made_at_its_path(change: str, path: tuple[str | int, ...], value: object) -> None:
    """Contract: the value at the path, everything else and the original as they were."""
    before = tree()
    found: Any = changed(before, [change])
    for key in path:
        found = found[key]
    assert found == value
    assert before == tree()


@pytest.mark.parametrize("path", ["clearance", "clearance.A", "clearance.0"])
def test_a_table_that_is_the_only_one_need_not_be_named(path: str) -> None:
    """Identity: its keys, and keys of its laws, with its name, its place and without."""
    single = {"clearance": [{"joint": "A", "clearance": "1 mm", "friction": "lugre"}]}
    found = changed(single, [f"{path}.clearance=2 mm", f"{path}.friction.kinetic=0.1", f"{path}.contact=hard"])
    assert found["clearance"] == [
        {"joint": "A", "clearance": "2 mm", "friction": {"law": "lugre", "kinetic": 0.1}, "contact": "hard"}
    ]


def test_later_changes_see_earlier_ones() -> None:
    """Contract: two changes of one value."""
    assert changed(tree(), ["drive.speed=1 rpm", "drive.speed=2 rpm"])["drive"]["speed"] == "2 rpm"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("drive.speed", "an equals sign"),
        ("=3", "a path of keys"),
        ("drive..speed=3", "a path of keys"),
        ("drive.speed.x=3", "no keys below"),
        ("clearance.B.clearance=3 mm", "one of A, unit 1/pivot, 0, 1"),
        ("clearance.2.clearance=3 mm", "no '2' there"),
        ("clearance.unit 1/pivo.clearance=3 mm", "did you mean 'unit 1/pivot'"),
        ("clearance.A=3", "whole table"),
        ("clearance.clearance=1 mm", "which [[clearance]] is not said"),
    ],
)
def test_a_path_that_leads_nowhere_is_refused(change: str, says: str) -> None:
    """Contract: the message quotes the change."""
    with pytest.raises(InputError, match="--set") as caught:
        changed(tree(), [change])
    assert says in str(caught.value)


def test_a_change_of_all_tables_is_that_of_each() -> None:
    """Identity: "clearance.all.KEY" is "clearance.NAME.KEY" for each name; a table called "all" is meant itself."""
    single = changed(tree(), ["clearance.A.friction=none", "clearance.unit 1/pivot.friction=none"])
    assert changed(tree(), ["clearance.all.friction=none"]) == single
    named = {"clearance": [{"joint": "all"}, {"joint": "A"}]}
    assert changed(named, ["clearance.all.clearance=1 mm"])["clearance"] == [
        {"joint": "all", "clearance": "1 mm"},
        {"joint": "A"},
    ]
