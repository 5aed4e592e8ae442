"""Parts of the page that show a run: cards, table, legend, curves, orbit, scene."""

import base64
import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.plot.style import SIZES

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.explore.answers import (
    CURVE_POINTS_MAX,
    DrawnCurves,
    cards,
    contact_table,
    curves_as_csv,
    differences,
    figures,
    orbit,
)
from scissordyn.explore.case import open_case
from scissordyn.explore.drag import assembled
from scissordyn.laws.elastic.linear import Linear
from scissordyn.numeral import numeral
from scissordyn.plot.canvas import pack_run
from scissordyn.plot.scale import engineering
from scissordyn.record.summary import summary_of

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))  # Case files of all examples


def held(limit, tolerance):
    """Return the run of a slider-crank turned by a limited controller, with a tracked point that has a tolerance."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    servo = crank.controlled(sd.PID(proportional=200.0, derivative=2.0, limit=limit), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    return sd.simulate(
        dataclasses.replace(servo, tracks=(sd.Track("face", "slider", "centre", tolerance=tolerance),)), until=0.1, samples=201
    )


def test_cards_judge_by_what_is_allowed():
    """Identity: a limit that is reached and a tolerance that is left are missed, wider ones are met; values are the run's."""
    tight, wide = held(5.0, 1e-6), held(1e4, 1.0)
    for run, judged in ((tight, "missed"), (wide, "met")):
        found = {card["title"].split()[0]: card for card in cards(summary_of(run))}
        assert found["face"]["judged"] == found["torque"]["judged"] == judged
        assert found["largest"]["value"] == sd.units.short(float(run["peak_force"].max()), "N")


def drawn(run, joint=""):
    """Return the figures of a run over time by name."""
    return {figure["name"]: figure for figure in figures(run, summary_of(run), (), joint, "slider")["figures"]}


def test_allowed_values_are_drawn_where_curves_come_near():
    """Contract: the limit that is reached is a line, at the sides that are; one that is far off is none."""
    for run, torques, tracks in ((held(5.0, 1e-6), {5.0, -5.0}, [1e-6]), (held(1e4, 1.0), set(), [])):
        shown = drawn(run)
        assert set(shown["torque"]["levels"]) == torques  # [N m]
        assert shown["track"]["levels"] == pytest.approx([1e3 * size for size in tracks])  # [mm]
        assert shown["track"]["unit"] == "mm"


def test_file_of_curves_has_their_values():
    """Contract: each column of the file is a curve of the run at its samples, with its unit."""
    run = held(5.0, 1e-3)
    rows = list(csv.reader(curves_as_csv(run, summary_of(run), "slider pin", "slider").splitlines()))
    table = {head: np.array([float(row[k]) for row in rows[1:]]) for k, head in enumerate(rows[0])}
    at = np.searchsorted(table["time [s]"], run["time"].values)
    assert np.array_equal(table["time [s]"][at], run["time"].values)
    assert np.array_equal(table["torque of actuator of crank [N m]"][at], run["control_torque"].values[:, 0])
    assert np.array_equal(table["deviation of face [m]"][at], run["track_deviation"].values[:, 0])
    assert table["force at slider pin [N]"].max() == float(run["peak_force"].max())


def test_legend_names_the_numbers_that_differ(case):
    """Contract: of two cases the changed numbers in both, and of equal ones that they are."""
    other = case.changed({"clearance.0.clearance": "0.3 mm", "drive.speed": "100 rpm"})
    assert differences([case, other]) == [
        "drive speed 150 rpm, clearance A clearance 0.5 mm",
        "drive speed 100 rpm, clearance A clearance 0.3 mm",
    ]
    assert differences([case, case]) == ["the same values"] * 2


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_starred_angles_move_the_mechanism(path):
    """Contract: an angle with a slider of its own changes where the mechanism starts; one that a drive overrides has none."""
    case = open_case(path)
    for field in case.fields.values():
        if field.starred and field.name == "angle":
            other = case.changed({field.key: f"{field.value[0] + 0.05!r} rad"})
            before, after = (assembled(each.mechanism)[0]["position"].values[0] for each in (case, other))
            assert np.abs(after - before).max() > 1e-3


def test_controller_and_motor_have_torque_and_work():
    """Identity: without a drive the torque of a controller is a curve, and its work is one of the energies."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4)
    turned = crank.controlled(sd.PID(proportional=10.0, limit=5.0), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    run = sd.simulate(turned, until=0.1, samples=101)
    chosen = DrawnCurves(run, summary_of(run), "", turned.output_body)
    assert [source.name for source in chosen.torques.values()] == ["torque of actuator of crank"]
    assert chosen.figures["torque"].title == "torque"
    time, found = chosen.columns(run)
    sampled = np.isin(time, run["time"].values)  # the located peak stands between them
    np.testing.assert_array_equal(found["torque 1"][sampled], run["control_torque"].values[:, 0])
    np.testing.assert_array_equal(found["motor_work"][sampled], run["motor_work"].values)
    assert np.abs(found["torque 1"]).max() == float(run["peak_control_torque"][0])
    assert "drive_work" not in found
    assert run["motor_work"].values[-1] > 0.1


@pytest.mark.parametrize("samples", [41, 3 * CURVE_POINTS_MAX])
def test_curves_of_the_page_reach_their_peaks(crank, samples):
    """Contract: the curves of few and of very many samples reach the located peaks of force and torque."""
    run = sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=samples)
    shown = drawn(run, "slider pin")
    for name, peak in (("force", float(run["peak_force"].max())), ("torque", float(run["peak_drive_torque"][0]))):
        figure = shown[name]
        scale, line = engineering("N" if name == "force" else "N m", peak), figure["lines"][0]
        assert figure["unit"] == scale.unit
        assert np.abs(line["y"]).max() == pytest.approx(scale.factor * peak, rel=1e-12)
        assert line["x"].size <= CURVE_POINTS_MAX + 2


def test_long_orbit_keeps_its_outermost_points(crank):
    """Contract: of an orbit with more points than are drawn the deepest indentation and the range of both axes stay."""
    run = sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=3 * CURVE_POINTS_MAX)
    drawn = orbit(run, "slider pin", 1.0)
    place = run["eccentricity"].sel(joint="slider pin")
    assert np.hypot(drawn["x"], drawn["y"]).max() == np.hypot(*place.transpose("axis", "time").values).max()
    for axis in "xy":
        assert (drawn[axis].min(), drawn[axis].max()) == (place.sel(axis=axis).min(), place.sel(axis=axis).max())
    assert drawn["x"].size <= CURVE_POINTS_MAX + 2


CLEARANCE, WIDTH = 1e-4, 0.02  # Clearance and width of the block of a clearance guide [m]


def test_canvas_gets_the_channel_of_a_clearance_guide():
    """Closed form: a block that falls from the middle is between surfaces at 1.35 half widths, and touches the lower one."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    linkage = linkage.with_clearance("guide", sd.GuideClearance(CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))
    run = sd.simulate(linkage, until=0.05, samples=201)
    (channel,) = json.loads(pack_run(run, linkage))["channels"]
    assert channel["name"] == "guide"
    assert channel["joint"].startswith("guide/corner ")
    assert dict(channel["surfaces"]) == {
        1.0: pytest.approx(1.0 + SIZES.magnified_clearance),
        -1.0: pytest.approx(-1.0 - SIZES.magnified_clearance),
    }
    block = np.frombuffer(base64.b64decode(channel["block"]), np.float32).reshape(201, channel["count"], 2)
    touching = np.frombuffer(base64.b64decode(channel["touching"]), np.uint8).reshape(201, channel["count"])
    assert np.abs(block[0, :, 1]).max() == pytest.approx(1.0, rel=1e-6)
    assert np.all(block[touching.any(axis=1)][:, :, 1].min(axis=1) < -1.0)
    assert touching.any()
    assert not touching[0].any()


def test_short_contacts_have_digits_beside_long_ones():
    """Limit: of contacts of 0.4 ms and 2 s, both durations can be read from the table: three digits or more of each."""
    number = xr.Variable("contact", [0.0004, 2.0])
    names = ("contact_start", "approach_speed", "peak_force", "contact_duration", "rebound_speed")
    run = xr.Dataset({**dict.fromkeys(names, number), "contact_joint": ("contact", ["A", "A"])})
    columns = contact_table(run)["columns"]
    titles = {column["title"]: column["values"].tolist() for column in columns}
    places = next(column["places"] for column in columns if column["title"] == "duration [ms]")
    assert [numeral(value, places) for value in titles["duration [ms]"]] == ["0.400", "2000"]
    assert titles["duration [ms]"] == [0.4, 2000.0]
    assert "peak force [N]" in titles
