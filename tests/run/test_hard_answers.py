"""What is said of runs with hard contact: estimated forces, impulses, and one line for what such contact does not have."""

from __future__ import annotations

import dataclasses
import io
import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.cli.compare import measures
from scissordyn.cli.show import show_events, show_summary
from scissordyn.cli.text_console import TextConsole
from scissordyn.errors import InputError
from scissordyn.exchange.fmu.pack import fmu
from scissordyn.explore.answers import cards, contact_table
from scissordyn.run.answer.joint_force import joint_summaries
from scissordyn.run.answer.summary import summary_of
from scissordyn.run.options import Options


def array(contact: str) -> sd.Mechanism:
    """Two units whose slider pin has clearance."""
    joint = sd.Clearance(5e-4, damping=sd.Flores(0.7), contact=contact)  # type: ignore[arg-type]
    return sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint)


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    """Some impacts at one hard joint."""
    return sd.simulate(array("hard"), until=0.01, samples=101)


def test_the_largest_force_is_an_estimate(run: xr.Dataset) -> None:
    """Contract: the largest of the estimates of impacts and of the sampled forces that last, and it is called so everywhere."""
    largest = max(float(run["peak_force_estimate"].max()), float(run["normal_force"].sel(joint="A").max()))
    answer = summary_of(run).force
    assert answer is not None
    assert answer.estimated
    assert answer.force == largest > 0.0
    assert str(answer).endswith("; an estimate, as contact is hard.")
    (joint,) = joint_summaries(run)
    assert (joint.largest, joint.when) == (answer.force, answer.when)
    assert measures(run)["largest force at A"] == (largest, "N")
    assert cards(summary_of(run))[0]["detail"].endswith(", an estimate")


def test_a_run_without_impacts_has_no_largest_force(run: xr.Dataset) -> None:
    """Limit: estimates and samples that are not known."""
    nothing = run.assign(peak_force_estimate=run["peak_force_estimate"] * math.nan, normal_force=run["normal_force"] * math.nan)
    assert summary_of(nothing).force is None
    out = io.StringIO()
    show_summary(nothing, TextConsole(file=out, width=200))
    assert "no largest force, as contact is hard" in out.getvalue()


def test_impulses_stand_in_the_place_of_peaks(run: xr.Dataset) -> None:
    """Contract: tables in the terminal and in the explorer have the impulses of the run, and no number is NaN."""
    out = io.StringIO()
    to = TextConsole(file=out, width=200)
    show_events(run, 5, to)
    show_summary(run, to)
    assert "impulse" in out.getvalue()
    assert "peak" not in out.getvalue()
    assert "nan" not in out.getvalue()
    shown = {column["title"]: column["values"] for column in contact_table(run)["columns"]}
    assert np.array_equal(shown["impulse [N s]"], run["impulse"].values)


def test_tables_of_both_kinds_of_contact_have_impulses_and_peaks(run: xr.Dataset) -> None:
    """Contract: where one of the contacts has a force, as a compliant one beside hard ones, it is shown beside the impulses."""
    one = run["contact"] == 0
    both = run.assign(peak_force=run["peak_force"].where(~one, 321.0), peak_time=run["peak_time"].where(~one, 1e-4))
    out = io.StringIO()
    show_events(both, 5, TextConsole(file=out, width=200))
    assert {"impulse", "peak force", "to peak"} <= set(out.getvalue().replace("  ", "\n").replace("\n ", "\n").split("\n"))
    assert "321.0" in out.getvalue()
    assert "nan" not in out.getvalue()
    assert {"impulse [N s]", "peak force [N]"} <= {column["title"] for column in contact_table(both)["columns"]}


def test_compliant_contact_keeps_its_peaks() -> None:
    """Contract: no estimate where the contact has a force."""
    run = sd.simulate(array("compliant"), until=0.01, samples=101)
    answer = summary_of(run).force
    assert answer is not None
    assert not answer.estimated
    assert answer.force == float(run["peak_force"].max())
    titles = [column["title"] for column in contact_table(run)["columns"]]
    assert any("peak force" in title for title in titles)
    assert "impulse [N s]" not in titles


@pytest.mark.parametrize("kinds", [("hard",), ("compliant",), ("compliant", "hard")])
def test_a_batch_that_names_no_measures_has_forces_of_its_contacts(kinds: tuple[str, ...]) -> None:
    """Identity: the largest forces of each kind of contact that there is, equal to those of the run, and no others."""
    mechanism = array(kinds[0])
    for name, kind in zip(("unit 1/pivot",), kinds[1:], strict=False):
        clearance = mechanism.joint("A").clearance
        assert clearance is not None
        mechanism = mechanism.with_clearance(name, dataclasses.replace(clearance, contact=kind))
    batch = sd.simulate_many(mechanism, {"A.clearance": [5e-4]}, until=0.01, threads=1)
    run = sd.simulate(mechanism, until=0.01)
    assert ("peak_force" in batch, "peak_force_estimate" in batch) == ("compliant" in kinds, "hard" in kinds)
    for name in {"peak_force", "peak_force_estimate"} & set(batch):
        found, own = batch[name].isel(case=0), run[name].values
        for joint, value in zip(found["joint"].values.tolist(), found.values.tolist(), strict=True):
            largest = np.nanmax(own[run["contact_joint"].values == joint], initial=0.0)
            assert value == largest > 0.0 or (math.isnan(value) and largest == 0.0)
        assert np.any(np.isfinite(found))


def test_what_hard_contact_does_not_have_is_refused_in_one_line() -> None:
    """Bad input: an FMU, and a requirement on forces that impacts do not have."""
    with pytest.raises(InputError, match="joint 'A' with hard contact, for which an FMU has no equations"):
        fmu(array("hard"), Options(until=0.01), sources_only=True)
    with pytest.raises(InputError, match="'peak_force' of joint 'A', whose contact is hard: its impacts have no largest force"):
        sd.study(array("hard"), {"A.clearance": (1e-4, 5e-4)}, until=0.01, requirements={"peak_force": 500.0}, points=2)
