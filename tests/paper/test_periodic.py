"""Regular and irregular motions under the periodic drive."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn_paper import periodic
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.periodic import CYCLES, PERIODIC, SKIP, examine, fetch_diagram, regularity_of


@pytest.fixture
def sooner(monkeypatch):
    """Shorten the runs: both motions below have settled after 20 periods."""
    monkeypatch.setattr(periodic, "ENSEMBLE_MEMBERS", 2)
    monkeypatch.setattr(periodic, "GROWTH_CYCLES", 60)
    monkeypatch.setattr(periodic, "GROWTH_SKIP", 20)


@pytest.mark.usefixtures("sooner")
def test_small_clearance_is_regular():
    """Second formulation: the samples repeat, and the exponent of two trajectories is negative."""
    run = examine(PaperCase(0.2e-3, choice=PERIODIC))
    found = regularity_of(run)
    assert (found.kind, found.regular, found.members, found.trusted_cycles) == ("periodic", True, 1, SKIP)
    assert math.isnan(found.growth)
    assert found.exponent < -3.0 * found.exponent_error
    assert run.sizes["cycle"] == CYCLES - SKIP


@pytest.mark.usefixtures("sooner")
def test_large_clearance_is_irregular():
    """Second formulation: the 0-1 test finds irregular motion, and the exponent of two trajectories is positive."""
    found = regularity_of(examine(PaperCase(0.7e-3, choice=PERIODIC)))
    assert (found.kind, found.regular, found.members, found.agreeing) == ("irregular", False, 2, 2)
    assert found.growth > 0.8
    assert found.exponent > 3.0 * found.exponent_error
    assert found.trusted_cycles < 20


@pytest.fixture
def short(monkeypatch, few_periods):
    for name, count in few_periods.items():
        monkeypatch.setattr(periodic, name, count)


@pytest.mark.usefixtures("short")
def test_verdicts_are_reproducible():
    """Contract: stored results depend on neither clock nor random numbers; too few samples are undecided."""
    one, two = (examine(PaperCase(choice=PERIODIC)) for _ in range(2))
    assert one.attrs["regularity"] == two.attrs["regularity"]
    assert (regularity_of(one).kind, regularity_of(one).regular) == ("transient only", None)
    np.testing.assert_array_equal(one["eccentricity"].values, two["eccentricity"].values)


@pytest.mark.usefixtures("short")
def test_damaged_diagram_is_computed_again(tmp_path):
    """Contract: a truncated file is replaced by the same diagram; a complete one is read."""
    path = tmp_path / "diagram.nc"
    first = fetch_diagram(path, engine=1)
    assert first["value"].values == pytest.approx([0.2e-3, 0.7e-3])
    assert first.sizes["cycle"] == 2
    path.write_bytes(path.read_bytes()[:2000])
    again = fetch_diagram(path, engine=1)
    np.testing.assert_array_equal(again["eccentricity"].values, first["eccentricity"].values)
    reported = []
    fetch_diagram(path, engine=1, progress=lambda *done: reported.append(done))
    assert reported == []


def test_full_disk_keeps_the_diagram(tmp_path, monkeypatch):
    """Contract: a diagram that cannot be written does not delete the stored one."""
    path = tmp_path / "bifurcation.nc"
    kept = b"what was done so far"
    path.write_bytes(kept)

    def full(*_, **__):
        raise sd.InputError(f"cannot write '{path}': No space left on device")

    monkeypatch.setattr(periodic, "bifurcation", full)
    with pytest.raises(sd.InputError, match="No space left"):
        periodic.fetch_diagram(path)
    assert path.read_bytes() == kept


def test_other_files_are_not_overwritten(tmp_path):
    """Contract: another file with the diagram's name is not overwritten."""
    path = tmp_path / "bifurcation.nc"
    path.write_text("notes")
    with pytest.raises(sd.InputError, match="not overwritten"):
        periodic.fetch_diagram(path)
    assert path.read_text() == "notes"
