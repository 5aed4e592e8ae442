"""The first run of the explorer: computed once, shown by every page, and stopped for none but the page that stops it."""

import threading
from dataclasses import replace

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.casefile.configuration import read_configuration
from scissordyn.explore.case import open_case
from scissordyn.explore.session import Session, Worker
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.simulate import compute_results

from .heard import PATIENCE, until


def shown(session):
    """Return the run that a session shows."""
    assert session.good is not None
    assert session.good.run is not None
    return session.good.run


@pytest.fixture
def gate(monkeypatch):
    """Make runs with clearance wait for an event before they begin; return the event, and a list with an entry for each."""
    opened, runs = threading.Event(), []

    def wait(mechanism, *given, **named):
        if mechanism != mechanism.ideal():
            runs.append(1)
            assert opened.wait(PATIENCE)
        return compute_results(mechanism, *given, **named)

    monkeypatch.setattr("scissordyn.run.simulate.compute_results", wait)
    return opened, runs


def test_first_run_is_computed_once(case, gate):
    """Contract: a page that comes after the run has it at once; its later runs have other numbers."""
    opened, runs = gate
    early = Session(case, lambda what: None)
    assert early.computing
    assert early.first is None
    opened.set()
    until(lambda: early.first is not None and early.first.fine is not None)
    late = Session(case, lambda what: None, early.first)
    assert shown(late) is shown(early)
    assert late.good.fine is early.good.fine
    assert not late.computing
    assert len(runs) == 1
    assert late.change({"drive.speed": "120 rpm"})  # its runs have other numbers, or the browser would take them for the first
    until(lambda: not late.computing)
    assert late.good.number > early.good.number
    for session in (early, late):
        session.worker.close()


def test_page_that_stops_leaves_others_alone(case, gate):
    """Contract: a run that a page has stopped is not that of the case, and a page beside it computes its own."""
    opened, runs = gate
    stopping = Session(case, lambda what: None)
    until(lambda: runs == [1])
    stopping.worker.stop()
    other = Session(case, lambda what: None, stopping.first)
    opened.set()
    until(lambda: not (stopping.computing or other.computing))
    assert len(runs) == 2
    assert shown(other).attrs["status"] == "complete"
    assert stopping.first is None
    for session in (stopping, other):
        session.worker.close()


def test_ideal_motion_is_shown_before_the_run(case, gate):
    """Contract: the motion with ideal joints is there while the run is held; then the run."""
    opened, _ = gate
    session = Session(case, lambda what: None)
    until(lambda: session.good is not None)
    ideal = session.good
    assert (ideal.note, session.computing) == ("ideal joints", True)
    run = shown(session)
    wanted = sd.simulate(case.mechanism.ideal(), until=case.options.until, samples=run.sizes["time"], rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(run["angle"].values, wanted["angle"].values, rtol=0.0, atol=1e-12)
    opened.set()
    until(lambda: not session.computing)
    assert session.good is session.first
    assert session.first.note == ""
    assert session.first.case.options == case.options
    assert session.first.number == session.worker.number > ideal.number
    session.worker.close()


def test_long_run_is_preceded_by_a_coarse_one(case):
    """Contract: ideal joints, coarse and accurate come in this order with rising numbers, each with its own tolerance."""
    found = []

    def take(outcome):
        if outcome.fine is None:
            found.append(outcome)

    worker = Worker(take, lambda number, fraction: None, estimate_seconds=0.0, long_run_seconds=0.0)
    number = worker.order(case, staged=True)
    until(lambda: bool(found) and not found[-1].note)
    worker.close()
    assert [outcome.note for outcome in found] == ["ideal joints", "coarse run, rtol 1e-5", ""]
    assert [outcome.number for outcome in found] == [number - 2, number - 1, number]
    runs = [outcome.run for outcome in found if outcome.run is not None]
    tolerances = [options.rtol for options in (read_configuration(run).options for run in runs) if options is not None]
    assert tolerances == [1e-5, 1e-5, case.options.rtol]


@pytest.mark.parametrize("samples", [41, "auto"])
def test_curves_follow_with_the_instants_of_contacts(case, samples):
    """Contract: a run is reported once more for its curves, that of `samples = "auto"`, and the session has both."""
    few = case.changed({})
    few.options = replace(case.options, samples=samples)
    found = []
    session = Session(few, found.append)
    until(lambda: session.good is not None and session.good.fine is not None)
    fine = as_dataset(session.good.fine)
    wanted = sd.simulate(case.mechanism, until=case.options.until, samples="auto")
    assert shown(session).sizes["time"] == few.options.count
    common = np.intersect1d(fine["time"], wanted["time"])  # all but those that round otherwise
    assert common.size >= wanted.sizes["time"] - 4
    np.testing.assert_array_equal(*(run["eccentricity"].sel(time=common) for run in (fine, wanted)))
    assert float(fine["normal_force"].max()) == pytest.approx(float(wanted["peak_force"].max()), rel=1e-6)
    configured = read_configuration(session.good.fine).options
    assert configured is not None
    assert configured.samples == "auto"  # a saved run is the one that is drawn
    session.change({"drive.speed": "120 rpm"})
    until(lambda: not session.computing)
    assert found.index("fine") > found.index("run")
    session.worker.close()


def test_saved_run_is_shown_without_computing(case, gate, tmp_path):
    """Contract: a saved run is that of the first page, bit for bit; a change computes a run of its own."""
    opened, runs = gate
    run = as_dataset(compute_results(case.mechanism, replace(case.options, rtol=1e-8, atol=1e-8)))
    sd.save(run, tmp_path / "run.nc")
    saved = open_case(tmp_path / "run.nc")
    session = Session(saved, lambda what: None)
    assert not session.computing
    assert runs == []
    np.testing.assert_array_equal(shown(session)["normal_force"].values, run["normal_force"].values)
    opened.set()
    assert session.change({"run.until": "7 ms"})
    until(lambda: not session.computing)
    assert len(runs) == 1
    assert session.good.number > 1
    assert float(shown(session)["time"].values[-1]) == pytest.approx(7e-3)
    session.worker.close()
