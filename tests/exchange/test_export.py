"""Mechanisms and runs for other programs: drawings, cut lists, MJCF, pin forces, beams, and the commands."""

import csv
import dataclasses
import io
import json
import math
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest
from tests.build import ORIGIN, chain, on_pin, planetary, wheel
from tests.exchange.links import linkage

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.exchange.export import cut_list, drawing
from scissordyn.exchange.forces import LOCATED_COLUMN, beam_file, envelope, force_json, force_table, missed_peaks, to_csv
from scissordyn.exchange.mjcf_text import mjcf
from scissordyn.plot.series import select_window

from .peer import by_mujoco, mujoco

ezdxf = pytest.importorskip("ezdxf")

ANGLE = sd.RelativeAngle  # Short name of the coordinate class
LOOSE = sd.Clearance(0.5e-3, journal_radius=10e-3)  # Clearance of exported joints


def arm():
    return sd.scissor(units=2).with_clearance("A", LOOSE)


def test_holes_have_the_sizes_of_the_joints():
    """Closed form: bore = journal radius + clearance; the outline is half circles around the ends and two sides."""
    mechanism = sd.four_bar().with_clearance("all", LOOSE)
    space = ezdxf.read(io.StringIO(drawing(mechanism, width=0.06))).modelspace()
    outlines = list(space.query("LWPOLYLINE"))
    assert len(outlines) == 3
    radii = {layer: [circle.dxf.radius for circle in space.query(f'CIRCLE[layer=="{layer}"]')] for layer in ("bore", "journal")}
    assert radii["bore"] == pytest.approx([10.5] * len(radii["bore"]))
    assert radii["journal"] == pytest.approx([10.0] * len(radii["journal"]))
    assert len(radii["bore"]) + len(radii["journal"]) == 6
    for outline, body in zip(outlines, mechanism.bodies, strict=True):
        points = [(x, y) for x, y, _ in outline.get_points("xyb")]
        turned = [4.0 * math.atan(bulge) for *_, bulge in outline.get_points("xyb")]
        assert sum(turned) == pytest.approx(2.0 * math.pi)
        pairs = list(zip(points, points[1:] + points[:1], turned, strict=True))
        for a, b, arc in pairs:
            if arc:
                assert math.dist(a, b) == pytest.approx(60.0 * math.sin(0.5 * arc))
        hull = sum(math.dist(a, b) for a, b, arc in pairs if not arc)
        places = sorted(body.points.values())
        if len({y for _, y in places}) == 1:
            assert hull == pytest.approx(2e3 * (places[-1][0] - places[0][0]))
    with pytest.raises(sd.InputError, match="a wider bar"):
        drawing(mechanism, width=0.02)


def test_equal_bars_are_one_row_of_the_cut_list():
    """Closed form: the bars of a scissor array with pins of 8 mm; a joint without a size is an error."""
    mechanism = arm()
    with pytest.raises(sd.InputError, match="has no pin radius"):
        cut_list(mechanism)
    soft = sd.with_bending(sd.four_bar(), "rocker", bending_stiffness=1e3, axial_stiffness=1e6, modes=2)
    with pytest.raises(sd.InputError, match="bar 'rocker/beam' bends: a drawing and a cut list have rigid bars only"):
        drawing(soft, pin_radius=4e-3)
    rows = list(csv.DictReader(io.StringIO(cut_list(mechanism, pin_radius=4e-3).decode())))
    assert sum(int(row["count"]) for row in {row["bar"]: row for row in rows}.values()) == 4
    assert {row["length [mm]"] for row in rows} == {"2000"}
    assert {row["diameter [mm]"] for row in rows} == {"8", "20"}
    assert {row["x [mm]"] for row in rows} == {"0", "1000", "2000"}


def swing(model, until, samples):
    """Return the mass centres of all bodies in a motion by MuJoCo."""
    made = mujoco.MjModel.from_xml_string(model.text)
    names = [mujoco.mj_id2name(made, mujoco.mjtObj.mjOBJ_BODY, k) for k in range(1, made.nbody)]
    return names, by_mujoco(model.text, until, samples, lambda data: data.xipos[1:, :2])


def arms():
    """Return a double pendulum."""
    return chain(sd.bar("a", length=0.5, mass=1.0, angle=-0.4), sd.bar("b", length=0.4, mass=0.7, angle=-1.1))


def crank():
    lengths = {"crank": 0.3, "rod": 0.8, "angle": 0.7}
    return sd.slider_crank(crank_mass=1.0, rod_mass=1.0, rod_inertia=0.06, slider_mass=2.0, gravity=9.81, **lengths)


@pytest.mark.parametrize(("made", "allowed"), [(arms, 1e-9), (crank, 2e-5), (sd.four_bar, 2e-5)])
def test_the_ideal_mechanism_moves_the_same_in_mujoco(made, allowed):
    """Cross-check by a second code: free motion for 0.5 s; loops only as exactly as MuJoCo's soft constraints close them."""
    mechanism = made()
    run = sd.simulate(mechanism, until=0.5, samples=11, rtol=1e-10)
    model = mjcf(mechanism)
    names, found = swing(model, 0.5, 11)
    for k, name in enumerate(names):
        assert np.max(abs(found[:, k] - run["position"].sel(body=name).values)) < allowed, name


def test_bars_that_bend_are_rigid_in_mujoco():
    """Cross-check by a second code: the parts of a bar that bends stay together, and the linkage moves as one of rigid bars."""
    soft = sd.with_bending(sd.four_bar(), "rocker", bending_stiffness=1e3, axial_stiffness=1e6, modes=2)
    model = mjcf(soft)
    assert "bars that bend are rigid" in model.notes
    run = sd.simulate(sd.four_bar(), until=0.5, samples=11, rtol=1e-10)
    names, found = swing(model, 0.5, 11)
    for name in ("crank", "coupler"):
        assert np.max(abs(found[:, names.index(name)] - run["position"].sel(body=name).values)) < 2e-5


def belt():
    """Return a double pendulum whose second arm turns relative to the first in a ratio to the angle of the first."""
    return dataclasses.replace(arms(), couplings=(sd.Coupling("belt", ANGLE("b", "a"), ANGLE("a"), -0.6),))


def weighted_planetary():
    """Return a planetary gear under gravity, whose coordinates are sums of joint angles and become tendons in MJCF."""
    return dataclasses.replace(planetary(), gravity=9.81)


def rack():
    """Return a rack on an incline whose coordinate is not along the incline."""
    pinion, tooth = wheel("pinion", 1e-3), sd.point_mass("rack", mass=2.0, position=(0.1, -0.05))
    bed = sd.Guide("bed", ("rack", "centre"), through=(0.1, -0.05), direction=0.3)
    teeth = sd.Coupling("teeth", sd.Slide(("rack", "centre"), -0.1), ANGLE("pinion"), 0.05)
    pin = sd.Revolute("A", ("pinion", "c"), ("ground", "O"))
    return sd.Mechanism((pinion, tooth), (pin,), guides=(bed,), ground=ORIGIN, couplings=(teeth,))


def screw():
    """Return an arm that turns a motor by a screw from the ground to its end, which becomes a tendon between two points."""
    arm = sd.bar("arm", length=0.6, mass=3.0, position=(0.0, 0.0), angle=0.5)
    pins = sd.Revolute("A", ("arm", "start"), ("ground", "O")), sd.Revolute("M", ("motor", "c"), ("ground", "P"))
    nut = sd.Coupling("screw", sd.Distance(("ground", "P"), ("arm", "end")), ANGLE("motor"), 0.002)
    ground = (*ORIGIN, ("P", (0.5, 0.0)))
    return sd.Mechanism((arm, wheel("motor", 1e-4, (0.5, 0.0))), pins, ground=ground, couplings=(nut,))


@pytest.mark.parametrize(
    ("made", "body", "turned", "allowed"),
    [(belt, "b", 0.5, 1e-8), (weighted_planetary, "sun", 3.0, 1e-8), (rack, "pinion", 3.0, 1e-7), (screw, "motor", 30.0, 1e-4)],
)
def test_couplings_move_the_same_in_mujoco(made, body, turned, allowed):
    """Cross-check by a second code: angles of bodies over 0.5 s, which turn by more than a number."""
    mechanism = made()
    run = sd.simulate(mechanism, until=0.5, samples=11, rtol=1e-10, atol=1e-12)
    angle = run["angle"].sel(body=body).values
    assert np.ptp(angle) > turned
    turns = by_mujoco(mjcf(mechanism).text, 0.5, 11, lambda data: data.body(body).xmat[[0, 3]])
    for (cos, sin), here in zip(turns, angle, strict=True):
        assert abs(math.remainder(math.atan2(sin, cos) - here, 2.0 * math.pi)) < allowed


def test_couplings_that_return_and_those_that_mjcf_cannot_say():
    """Contract: a relation of joints is read again, a drive is a motor, backlash is named, a point off its guide one line."""
    found = sd.read_mjcf(mjcf(belt()).text).mechanism.couplings
    assert [(part.ratio, part.output.unit) for part in found] == [(-0.6, "rad")]
    drive = sd.CoordinateDrive("elbow", ANGLE("b"), sd.Polynomial((-1.1, 1.0)))
    model = mjcf(dataclasses.replace(arms(), coordinate_drives=(drive,)))
    assert "the motion of drive 'elbow': replaced by a motor" in model.notes
    assert mujoco.MjModel.from_xml_string(model.text).nu == 1
    loose = mjcf(sd.with_backlash(rack(), "teeth", 0.01))
    assert loose.text == mjcf(rack()).text
    assert loose.notes == ("the backlash of coupling 'teeth': left out",)
    off = sd.Coupling("x", sd.Slide(("b", "end")), ANGLE("a"), 0.1)
    with pytest.raises(
        sd.InputError, match=r"coupling 'x': MJCF cannot represent the slide of 'b.end'; expected a slide along the guide"
    ):
        mjcf(dataclasses.replace(arms(), couplings=(off,)))


def test_drives_and_components_are_named_and_a_rod_is_refused():
    """Contract: what MJCF does not hold is said; the speed of a drive is kept at the start."""
    model = mjcf(arm().driven(speed=sd.rpm(150)))
    assert any("the prescribed angle of 'unit 1/bar 1'" in note for note in model.notes)
    assert "joints with clearance are ideal" in model.notes
    assert f"{sd.rpm(150)!r}"[:8] in model.text
    rod = sd.Rod("rod", ("a", "end"), ("ground", "O"), 0.5)
    with pytest.raises(sd.InputError, match="MJCF cannot represent rod 'rod'"):
        mjcf(dataclasses.replace(arms(), rods=(rod,)))


def test_export_warns_of_what_a_model_does_not_hold(tmp_path):
    """Contract: in Python too, each part that is left out is a warning."""
    spring = sd.Spring("spring", ("ground", "O"), ("a", "end"), 100.0, 0.5)
    mechanism = dataclasses.replace(arms(), components=(spring,))
    with pytest.warns(UserWarning, match="left out|ideal|replaced") as said:
        sd.export(mechanism, tmp_path / "model.xml")
    assert [str(warning.message) for warning in said] == list(mjcf(mechanism).notes)
    assert "Spring 'spring': left out" in mjcf(mechanism).notes


def test_a_link_becomes_a_case_that_runs_and_is_exported(tmp_path, capsys, monkeypatch):
    """Contract: import, run and export by the commands; wrong input is one line with status 2 and writes nothing."""
    monkeypatch.chdir(tmp_path)
    places = {"A": (0.0, 0.0), "B": (0.3, 0.4), "C": (1.75, 1.1), "D": (1.6, 0.0)}
    address = linkage(places, ("AB", "BC", "CD"), "AD", "A", speed=30)
    assert status_of(["import", address, "-o", "case.toml", "--until", "0.2 s"]) == 0
    assert "note: units: lengths in m" in capsys.readouterr().out
    assert status_of(["run", "case.toml", "-o", "run.nc", "-q"]) == 0
    for words in (
        ["run.nc", "forces.csv", "--forces"],
        ["run.nc", "envelope.csv", "--envelope"],
        ["run.nc", "forces.json", "--forces"],
        ["run.nc", "forces.inp", "--forces", "--section", "20x30 mm"],
        ["run.nc", "table.csv"],
        ["case.toml", "bars.dxf", "--pin", "20 mm"],
        ["case.toml", "cut.csv", "--pin", "20 mm"],
        ["case.toml", "model.xml"],
        ["case.toml", "unit.fmu", "--sources"],
    ):
        assert status_of(["export", *words]) == 0, words
        assert status_of(["export", *words]) == 0, words  # what it wrote it may replace
        assert (tmp_path / words[1]).stat().st_size > 100
    capsys.readouterr()
    monkeypatch.setenv("CC", "no-such-compiler")
    for words in (
        ["import", address[:-3], "-o", "new.toml"],
        ["import", "none.dxf", "-o", "new.toml"],
        ["import", "case.toml", "-o", "new.toml"],
        ["import", address, "--unit", "mm", "-o", "new.toml"],
        ["export", "case.toml", "new.fmu"],
        ["export", "case.toml", "new.dxf"],
        ["export", "case.toml", "new.stl"],
        ["export", "run.nc", "new.inp", "--forces"],
        ["export", "run.nc", "new.dxf"],
    ):
        assert status_of(words) == 2, words
        assert capsys.readouterr().err.count("\n") == 1
        assert not list(tmp_path.glob("new.*"))


GRAVITY = 9.81  # [m/s^2] gravitational acceleration


@pytest.fixture(scope="module")
def pendulum():
    """Return a uniform bar of 2 kg and 0.8 m on a pin, driven at a constant speed."""
    driven = on_pin(sd.bar("bar", length=0.8, mass=2.0, angle=0.3), gravity=GRAVITY).driven(speed=5.0)
    return driven, sd.simulate(driven, until=1.0, samples=101)


def test_the_force_on_a_turning_bar_is_centripetal_force_and_weight(pendulum):
    """Closed form: along the bar m (g sin - w^2 L/2), across it m g cos; the drive's torque is m g L/2 cos."""
    mechanism, run = pendulum
    forces = sd.pin_forces(run, mechanism)
    angle = run["angle"].sel(body="bar").values
    along = 2.0 * (GRAVITY * np.sin(angle) - 25.0 * 0.4)
    across = 2.0 * GRAVITY * np.cos(angle)
    assert forces["force_along"].values[:, 0] == pytest.approx(np.stack([along, across], axis=1), abs=1e-9)
    assert forces["other_force"].values == pytest.approx(np.zeros((101, 1, 2)), abs=1e-9)
    assert forces["other_torque"].values[:, 0] == pytest.approx(across * 0.4, abs=1e-9)
    assert forces["other_torque"].values[:, 0] == pytest.approx(run["drive_torque"].values, abs=1e-9)
    found = envelope(forces).iloc[0]
    size = np.hypot(along, across)
    assert found["largest force [N]"] == pytest.approx(size.max())
    assert found["at time [s]"] == run["time"].values[np.argmax(size)]
    assert (found["least x [N]"], found["largest x [N]"]) == pytest.approx((along.min(), along.max()))


def test_forces_on_all_bars_balance_with_clearance():
    """Contract: both bodies of a joint feel opposite forces, no bar has further ones; friction is a moment of its joint."""
    loose = sd.Clearance(5e-4, friction=sd.LuGre(kinetic=0.05))
    mechanism = sd.slider_crank(gravity=9.81).with_clearance("slider pin", loose).driven(speed=50.0)
    run = sd.simulate(mechanism, until=0.05, samples=301)
    forces = sd.pin_forces(run, mechanism)
    names = list(zip(forces["end_body"].values, forces["end_joint"].values, strict=True))
    one, other = (forces["force"].values[:, names.index((body, "crank pin"))] for body in ("crank", "rod"))
    assert np.max(abs(one + other)) == 0.0
    largest = float(np.max(abs(forces["force"].values)))
    assert np.max(abs(forces["other_force"].values)) < 1e-9 * largest
    friction = run["friction_force"].sel(joint="slider pin").values
    moment = forces["moment"].values[:, names.index(("rod", "slider pin"))]
    assert np.max(abs(friction)) > 1.0
    assert np.max(abs(moment + 0.01 * friction)) < 1e-9 * largest
    assert np.max(abs(forces["other_torque"].sel(body="rod").values)) < 1e-9 * largest
    table = force_table(forces)
    assert len(table) == 301 * len(names)
    read = pd.read_csv(io.BytesIO(to_csv(table)))
    assert read["x [N]"].values == pytest.approx(forces["force"].values[..., 0].ravel())
    held = json.loads(force_json(forces))
    assert np.array(held["ends"][0]["force"]) == pytest.approx(forces["force"].values[:, 0])


def test_a_peak_between_samples_is_in_the_envelope_and_said():
    """Contract: with few samples the located peak is in its column and named; samples at the contacts' instants reach it."""
    mechanism = sd.slider_crank().with_clearance("slider pin", sd.Clearance(5e-4)).driven(speed=50.0)
    run = sd.simulate(mechanism, until=0.05, samples=21)
    rows = envelope(sd.pin_forces(run, mechanism)).set_index(["body", "joint"])
    peak = float(run["peak_force"].max())
    assert rows.loc[("slider", "slider pin"), LOCATED_COLUMN] == rows.loc[("rod", "slider pin"), LOCATED_COLUMN] == peak
    ideal = float(run["joint_peak_force"].sel(joint="crank pin"))
    assert rows.loc[("rod", "crank pin"), LOCATED_COLUMN] == ideal > 2.0 * rows.loc[("rod", "crank pin"), "largest force [N]"]
    assert rows.loc[("slider", "slider pin"), "largest force [N]"] < 0.5 * peak
    assert len(missed_peaks(run)) == 4
    assert f"largest is {peak:.4g} N" in " ".join(missed_peaks(run))
    dense = sd.simulate(mechanism, until=0.05, samples="auto")
    assert missed_peaks(dense) == []


def test_largest_forces_of_a_window_are_inside_it():
    """Contract: part of a run has the maxima of its own contacts, and none of other joints whose largest force is outside."""
    driven = sd.scissor(units=1).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(0.2e-3))
    run = sd.simulate(driven, until=5e-3, samples=101)
    late = select_window(run, 4e-3, 5e-3)
    forces = sd.pin_forces(late, driven)
    loose, ideal = (forces.isel(end=np.flatnonzero(forces["end_joint"] == name)) for name in ("A", "O"))
    inside = run["contact_start"] + run["peak_time"]
    wanted = float(run["peak_force"].where((inside >= 4e-3) & (inside <= 5e-3)).max())
    assert float(run["joint_peak_force_time"].max()) < 4e-3
    np.testing.assert_array_equal(loose["located_peak"], wanted)
    assert np.isnan(ideal["located_peak"].values).all()
    assert not [line for line in missed_peaks(late) if "'A'" not in line]


def test_beams_are_in_equilibrium_and_refuse_what_they_cannot_say(pendulum):
    """Contract: forces and moments of an input file of CalculiX add up to nothing; a round section is an error."""
    mechanism, run = pendulum
    forces = sd.pin_forces(run, mechanism)
    text = beam_file(forces, run, mechanism, section="20x30 mm").decode()
    places = {}
    for line in text.partition("*NODE")[2].partition("*ELEMENT")[0].splitlines()[1:]:
        number, x, _, _ = line.split(",")
        places[int(number)] = float(x)
    total = np.zeros(3)
    for line in text.partition("*CLOAD")[2].partition("*NODE FILE")[0].splitlines():
        if line and not line.startswith("**"):
            node, degree, value = (float(part) for part in line.split(","))
            total += value * np.array([degree == 1, degree == 2, degree == 6 or (degree == 2) * places[int(node)]], float)
    assert np.max(abs(total)) < 1e-9 * 60.0
    with pytest.raises(sd.InputError, match="section 'round' of the beams is not a rectangle"):
        beam_file(forces, run, mechanism, section="round")


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_the_stretch_of_a_turning_bar(pendulum, tmp_path):
    """Closed form: a bar that turns stretches by m w^2 L^2 / (3 E A); its supports take nothing."""
    mechanism, run = pendulum
    still = sd.Mechanism(mechanism.bodies, mechanism.joints, ground=mechanism.ground, gravity=0.0).driven(speed=5.0, body="bar")
    run = sd.simulate(still, until=0.1, samples=11)
    text = beam_file(sd.pin_forces(run, still), run, still, section="20x30 mm")
    (tmp_path / "bar.inp").write_bytes(text)
    done = subprocess.run(["ccx", "bar"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-500:]
    frd = (tmp_path / "bar.frd").read_text()
    block = frd.partition("DISP")[2].partition("-3")[0]
    moved = [float(line[13:25]) for line in block.splitlines() if line.startswith(" -1")]
    assert max(moved, key=abs) == pytest.approx(2.0 * 25.0 * 0.8**2 / (3.0 * 210e9 * 6e-4), rel=1e-3)
    totals = [line.split() for line in (tmp_path / "bar.dat").read_text().splitlines() if len(line.split()) == 3]
    numbers = [
        float(part)
        for row in totals
        for part in row
        if part.lstrip("-").replace(".", "").replace("E", "").replace("+", "").replace("-", "").isdigit()
    ]
    assert numbers
    assert max(map(abs, numbers)) < 1e-6 * 20.0
    assert math.isfinite(sum(numbers))
