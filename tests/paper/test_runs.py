"""Runs are computed once, stored completely, and computed again when outdated."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.run.advance.interrupt import check_interrupt
from scissordyn_paper import runs as module
from scissordyn_paper.beyond import REFERENCE, event_table
from scissordyn_paper.cache import Jobs, compute_tasks, fetch_all, provenance
from scissordyn_paper.cases import Choice, PaperCase, every_case
from scissordyn_paper.runs import compute, fetch_runs

CASE = PaperCase(None)  # Case of the paper without clearance


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the run of one case."""
    fetch_runs([CASE], tmp_path, engine=1)
    return tmp_path


def counting(monkeypatch):
    """Return a growing list of the cases that are computed."""
    made = []

    def counted(case, **options):
        made.append(case)
        return compute(case, **options)

    monkeypatch.setattr(module, "compute", counted)
    return made


def test_second_call_computes_nothing(folder, monkeypatch):
    """Contract: the stored run is read, and a case given twice is one run."""
    made = counting(monkeypatch)
    again = fetch_runs([CASE, CASE], folder, engine=1)
    assert made == []
    xr.testing.assert_equal(again[CASE], compute(CASE))
    assert [path.name for path in folder.iterdir()] == [f"{CASE.name}.nc"]


@pytest.mark.parametrize("spoil", ["cut", "case", "provenance"])
def test_damaged_or_outdated_files_are_replaced(folder, monkeypatch, spoil):
    """Contract: a truncated file, one of another choice and one of another version are computed again."""
    path = folder / f"{CASE.name}.nc"
    if spoil == "cut":
        path.write_bytes(path.read_bytes()[:1000])
    else:
        sd.save(sd.load(path).assign_attrs({spoil: "other"}), path)
    made = counting(monkeypatch)
    fetch_runs([CASE], folder, engine=1)
    assert made == [CASE]
    assert (sd.load(path).attrs["case"], sd.load(path).attrs["provenance"]) == (CASE.toml, provenance())


def test_failed_run_is_an_error(tmp_path, monkeypatch):
    """Contract: the error about a run that ends early names it, and no file is left."""
    broken = module.simulate

    def short(mechanism, **options):
        return broken(mechanism, **{**options, "most_steps": 10})

    monkeypatch.setattr(module, "simulate", short)
    with pytest.raises(sd.ScissordynError, match=r"run 'c-0\.5mm_150rpm' .*10 steps are not enough"):
        fetch_runs([PaperCase()], tmp_path, engine=1)
    assert not list(tmp_path.iterdir())


def test_threads_do_not_change_runs(runs, tmp_path):
    """Identity: two threads give the same results as one, bit for bit and in the same order."""
    cases = [PaperCase(0.2e-3), PaperCase(None)]
    found = fetch_runs(cases, tmp_path, engine=2)
    assert list(found) == cases
    for case in cases:
        xr.testing.assert_equal(found[case], runs[case])


def test_all_runs_are_predictable(runs):
    """Limit: a tenth of the tolerance gives the same results to the end of each run."""
    assert list(runs) == list(every_case(Choice()))
    for case, run in runs.items():
        assert run.attrs["trusted_until"] == pytest.approx(case.until)
        assert run.sizes["time"] == 2001


def test_first_contacts_of_a_second_formulation(runs):
    """Second formulation: Lagrange's equations in minimal coordinates; the table shows the differences.

    A relative tolerance of 1e-8 per step leaves 1e-10 at the first contact, and each contact magnifies it. A peak is flat, so
    that its time is known to half as many digits.
    """
    rows = event_table(runs[PaperCase()])
    expected = [column.reference[contact] for contact in range(3) for column in REFERENCE]
    for (name, reference, shown, difference), digits in zip(rows, expected, strict=True):
        assert reference == digits
        assert float(difference) < (1e-5 if "time to peak" in name else 3e-7), name
        assert float(shown) == pytest.approx(float(reference), rel=1.5 * float(difference) + 1e-10), name
    assert float(rows[0][3]) < 1e-10


def test_several_kinds_of_runs_together(runs, tmp_path):
    """Contract: each kind has its own folder, its results in the order of its cases, and its own progress."""
    moved, steps = PaperCase(0.2e-3), []
    free, ideal = fetch_all(
        Jobs((moved,), compute, tmp_path / "free", "clearance"),
        Jobs((CASE, CASE.ideal), compute, tmp_path / "ideal", "ideal"),
        engine=2,
        progress=lambda *step: steps.append(step),
    )
    assert sorted(steps) == [("clearance", 1, 1), ("ideal", 1, 1)]
    for found, case, folder in ((free, moved, "free"), (ideal, CASE, "ideal")):
        xr.testing.assert_equal(found[case], runs[case])
        assert [path.name for path in (tmp_path / folder).iterdir()] == [f"{case.name}.nc"]


def test_error_stops_running_tasks():
    """Contract: when the consumer of results fails, running tasks are interrupted."""
    begun, stopped = threading.Event(), threading.Event()

    def work(task):
        if task > 1:
            begun.set()
        assert begun.wait(60.0)
        try:
            while task > 1:
                check_interrupt()
                time.sleep(0.01)
        except KeyboardInterrupt:
            stopped.set()
            raise
        return task

    def fail(*_):
        raise ValueError("no picture")

    with ThreadPoolExecutor(2) as engine, pytest.raises(ValueError, match="no picture") as caught:
        for _ in compute_tasks(work, [1, 2], what=str, engine=engine, progress=fail):
            pass
    assert stopped.wait(10.0)
    assert caught.traceback
