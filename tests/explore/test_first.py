"""The first run of the explorer: computed once, shown by every page, and stopped for none but the page that stops it."""

from __future__ import annotations

import threading
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.explore.case import FileCase
from scissordyn.explore.first import FirstRun
from scissordyn.explore.session import Session
from scissordyn.run.simulate import simulate

from .browser import CASE


@pytest.fixture
def case() -> FileCase:
    """A short case."""
    return FileCase("case.toml", CASE, Path(), tomllib.loads(CASE))


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> tuple[threading.Event, list[int]]:
    """Runs that wait for an event before they begin, and a list with an entry for each."""
    opened, runs = threading.Event(), []

    def held(*given: Any, **named: Any) -> xr.Dataset:
        runs.append(1)
        assert opened.wait(30.0)
        return simulate(*given, **named)

    monkeypatch.setattr("scissordyn.run.simulate.simulate", held)
    return opened, runs


def until(condition: Callable[[], bool]) -> None:
    """Wait for a thread."""
    for _ in range(600):
        if condition():
            return
        time.sleep(0.05)
    raise AssertionError("it did not happen within 30 s")


def begun(case: FileCase) -> FirstRun:
    """A case that has been read, and whose run is going on."""
    first = FirstRun(lambda: case)
    first.begin()
    return first


def test_those_who_wait_for_the_case_are_told_once(case: FileCase) -> None:
    """Identity: who asks before the case has been read is told when it is, and who asks later at once, of an error too."""
    told: list[str] = []

    def broken() -> FileCase:
        raise InputError("no such case")

    for opened, wanted in ((lambda: case, None), (broken, "no such case")):
        told.clear()
        first = FirstRun(opened)
        first.when_read(lambda: told.append("early"))
        assert told == []
        first.begin()
        assert told == ["early"]
        first.when_read(lambda: told.append("late"))
        assert told == ["early", "late"]
        assert (first.case is None) == (wanted is not None)
        assert (None if first.error is None else str(first.error)) == wanted
        until(lambda first=first, wanted=wanted: first.known is not None or wanted is not None)  # type: ignore[misc]


def test_first_run_is_computed_once(case: FileCase, gate: tuple[threading.Event, list[int]]) -> None:
    """Identity: a page that comes while the run is going on takes it over; later ones have its result at once."""
    opened, runs = gate
    first = begun(case)
    early = Session(case, lambda what: None, first)
    assert early.computing
    opened.set()
    until(lambda: early.good is not None)
    late = Session(case, lambda what: None, first)
    assert late.good is early.good
    assert not late.computing
    assert len(runs) == 1
    assert late.change("drive.speed", "120 rpm")  # its runs have other numbers, or the browser would take them for the first
    until(lambda: late.good is not early.good)
    assert late.good is not None
    assert early.good is not None
    assert late.good.number > early.good.number
    for session in (early, late):
        session.close()


def test_page_that_ends_or_stops_leaves_others_alone(case: FileCase, gate: tuple[threading.Event, list[int]]) -> None:
    """Identity: a page beside the one that has taken the first run over computes its own, whatever that one does."""
    opened, runs = gate
    first = begun(case)
    stopping = Session(case, lambda what: None, first)
    stopping.stop()
    other = Session(case, lambda what: None, first)
    opened.set()
    until(lambda: not (stopping.computing or other.computing))
    assert len(runs) == 2
    assert other.good is not None
    assert other.good.run is not None
    assert other.good.run.attrs["status"] == "complete"
    assert first.known is None
    for session in (stopping, other):
        session.close()
