"""Pictures show the data of the run with names and units, and are readable."""

import dataclasses
import io
import math

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

import scissordyn as sd
from scissordyn.errors import printable
from scissordyn.plot.animation_scene import load_shapes
from scissordyn.plot.file import write
from scissordyn.plot.joint import force, orbit
from scissordyn.plot.over_time import energy, response, torque
from scissordyn.plot.report import draw_all
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import BEYOND_HORIZON, chosen_joints
from scissordyn.plot.still import structure
from scissordyn.plot.style import literal, wrap_label
from scissordyn.record.placement import Placement

from .made_up import CLEARANCE, CLEARANCE_JOINTS, END, made_up, mechanism_with, overlaps

ALL = ["response", "force", "torque", "orbit", "energy", "structure"]  # Names of the pictures that `plot` draws by default


def curve(axes, label):
    """Return the line with a label."""
    (found,) = [line for line in axes.lines if line.get_label() == label]
    return found


def figures(run, ideal, mechanism):
    """Return the pictures of a run by name."""
    return {
        "response": response(run, ideal),
        "force": force(run, ideal),
        "torque": torque(run, ideal),
        "orbit": orbit(run),
        "energy": energy(run),
        "structure": structure(run, mechanism),
    }


@pytest.mark.parametrize(
    ("unit", "largest", "factor", "shown"),
    [
        *(("s", 0.05, 1e3, "ms"), ("m", 0.5e-3, 1e3, "mm"), ("m", 0.05e-3, 1e6, "µm"), ("m", 1.9, 1.0, "m")),
        *(("m", 2e4, 1.0, "m"), ("N", 85e3, 1e-3, "kN"), ("N", -42.0, 1.0, "N"), ("N m", 7850.0, 1e-3, "kN·m")),
        *(("N", 150e3, 1e-3, "kN"), ("N", 999.0, 1.0, "N"), ("N", 0.1, 1e3, "mN"), ("J", 1e3, 1e-3, "kJ")),
        *(("s", 0.15, 1.0, "s"), ("m", 0.1, 1.0, "m"), ("J", 2e-6, 1e6, "µJ"), ("m/s^2", 7900.0, 1.0, "m/s²")),
        *(("rad/s^2", 25e3, 1e-3, "10³ rad/s²"), ("1", 2e-5, 1e6, "10⁻⁶"), ("J", 0.0, 1.0, "J")),
    ],
)
def test_engineering_scale(unit, largest, factor, shown):
    """Closed form: largest value between 1 and 1000 (length or time: 0.1 to 100); NaN and infinity are ignored."""
    scale = engineering(unit, [0.0, largest], [math.nan, math.inf])
    assert scale.factor == pytest.approx(factor, rel=1e-12)
    assert scale.unit == shown


TOLERANCE = 0.05e-3  # [m] tolerance of a tracked point

# Picture, panel, axis label, name of a curve, variable of the run, and factor between both
CURVES = [
    ("response", 0, "position [m]", "with clearance", "slider_position", 1.0),
    ("response", 1, "angle [deg]", "with clearance", "angle", 180.0 / math.pi),
    ("response", 2, "velocity [m/s]", "with clearance", "slider_velocity", 1.0),
    ("response", 3, "angular velocity\n[rad/s]", "with clearance", "angular_velocity", 1.0),
    ("response", 4, "acceleration [m/s²]", "with clearance", "slider_acceleration", 1.0),
    ("response", 5, "angular acceleration\n[rad/s²]", "with clearance", "angular_acceleration", 1.0),
    ("torque", 0, "driving torque [kN·m]", "with clearance", "drive_torque", 1e-3),
    ("energy", 0, "energy [kJ]", "kinetic", "kinetic_energy", 1e-3),
    ("energy", 0, "energy [kJ]", "potential", "potential_energy", 1e-3),
    ("energy", 0, "energy [kJ]", "work of the drive", "drive_work", 1e-3),
    ("energy", 1, "contacts [J]", "elastic", "elastic_energy", 1.0),
    ("energy", 1, "contacts [J]", "dissipated", "dissipated_energy", 1.0),
    ("energy", 2, "residual [µJ]", "residual of the balance", "energy_residual", 1e6),
]


def test_curves_show_the_data(run, ideal, arm):
    """Contract: each panel has the values of the run and of the ideal mechanism, in the unit of its label."""
    drawn = figures(run, ideal, arm)
    for kind, panel, label, name, variable, factor in CURVES:
        axes, values = drawn[kind][panel], run[variable]
        values = values.sel(body="unit 1/bar 2") if "body" in values.dims else values
        assert axes.get_ylabel() == label
        np.testing.assert_allclose(curve(axes, name).get_ydata(), factor * values, rtol=1e-12)
        np.testing.assert_allclose(curve(axes, name).get_xdata(), 1e3 * run["time"], rtol=1e-14)
    assert [len(drawn[kind]) for kind in ("response", "torque", "energy")] == [6, 1, 3]
    assert [axes.get_xlabel() for axes in drawn["response"]] == ["", "", "", "", "time [ms]", "time [ms]"]
    below = drawn["response"][4]
    np.testing.assert_array_equal(curve(below, "ideal joints").get_ydata(), ideal["slider_acceleration"])
    np.testing.assert_allclose(curve(drawn["torque"][0], "ideal joints").get_ydata(), ideal["drive_torque"] / 1e3, rtol=1e-14)
    assert curve(below, "ideal joints").is_dashed()
    assert not curve(below, "with clearance").is_dashed()
    assert [axes.get_ylabel() for axes in energy(ideal)] == ["energy [kJ]", "residual [µJ]"]


def test_round_off_of_the_ideal_run_is_not_drawn(run, ideal):
    """Contract: a derivative that is round-off is zero in both runs, so that it does not scale the panel."""
    run, ideal = run.copy(deep=True), ideal.copy(deep=True)
    for each in (run, ideal):
        each["angular_acceleration"][:] = 1e-13 * np.cos(np.arange(each["angular_acceleration"].size)).reshape(
            each["angular_acceleration"].shape
        )
    panel = response(run, ideal)[5]
    assert panel.get_ylabel() == "angular acceleration\n[rad/s²]"
    for label in ("with clearance", "ideal joints"):
        np.testing.assert_array_equal(curve(panel, label).get_ydata(), 0.0)


def test_units_are_not_broken_into_lines():
    """Contract: the label of a short axis is broken before its unit, not within its brackets."""
    assert wrap_label("acceleration [10³ m/s²]", 1.5, 9.0) == "acceleration\n[10³ m/s²]"
    assert wrap_label("force [N]", 5.0, 9.0) == "force [N]"


def test_response_of_another_body(run):
    """Contract: `body` chooses the angle; a wrong name gets a suggestion; without an ideal run no line is dashed."""
    drawn = response(run, body="unit 2/bar 1")
    np.testing.assert_array_equal(drawn[3].lines[0].get_ydata(), run["angular_velocity"].sel(body="unit 2/bar 1"))
    assert [len(axes.lines) for axes in drawn] == [1] * 6
    with pytest.raises(sd.InputError, match=r"did you mean 'unit 2/bar 1'\?"):
        response(run, body="unit 2/bar1")


def test_response_without_a_slider(run):
    """Contract: a mechanism without a guided output has the three panels of its first body."""
    names = {"unit 1/bar 2": "rod"}
    bodies = [names.get(str(name), str(name)) for name in run["body"].values]
    drawn = response(run.drop_vars([name for name in run if str(name).startswith("slider")]).assign_coords(body=bodies))
    assert len(drawn) == 3
    np.testing.assert_allclose(drawn[0].lines[0].get_ydata(), np.degrees(run["angle"].sel(body="unit 1/bar 1")), rtol=1e-14)


def test_constant_stays_flat(ideal):
    """Limit: the range of the axis does not shrink to the round-off of a constant speed."""
    spin = ideal["angular_velocity"].copy(data=np.full(ideal["angular_velocity"].shape, 5.0 * math.pi))
    spin.values[::2] += 2e-14
    low, high = response(ideal.assign(angular_velocity=spin))[3].get_ylim()
    assert low < 15.0
    assert high > 16.0


def test_each_drive_has_its_torque(run):
    """Contract: one panel per drive, each in its unit; a run without one is refused."""
    both = xr.concat([run["drive_torque"], 1e-4 * run["drive_torque"]], "drive").transpose("time", "drive")
    first, second = torque(run.assign(drive_torques=both.assign_attrs(units="N m")))
    assert (first.get_ylabel(), second.get_ylabel()) == ("torque of drive 1 [kN·m]", "torque of drive 2 [N·m]")
    with pytest.raises(sd.InputError, match="no drive, actuator or motor"):
        torque(run.drop_vars("drive_torque"))


def test_force_shows_the_data(run, ideal):
    """Contract: force, friction, peaks and intervals of the contact table, and the ideal reaction."""
    normal, friction = force(run, ideal)
    at_a = run.sel(joint="A")
    assert (normal.get_ylabel(), friction.get_ylabel()) == ("force [kN]", "friction force [kN]")
    drawn = np.array(curve(normal, "force").get_xydata())
    np.testing.assert_allclose(drawn[np.isin(drawn[:, 0], 1e3 * run["time"]), 1], at_a["normal_force"] / 1e3, rtol=1e-14)
    np.testing.assert_allclose(friction.lines[0].get_ydata(), at_a["friction_force"] / 1e3, rtol=1e-14)
    peaks = curve(normal, "peak of a contact")
    np.testing.assert_allclose(peaks.get_ydata(), run["peak_force"] / 1e3, rtol=1e-14)
    np.testing.assert_allclose(peaks.get_xdata(), 1e3 * (run["contact_start"] + run["peak_time"]), rtol=1e-14)
    reaction = ideal["reaction"].sel(joint="A")
    np.testing.assert_allclose(
        curve(normal, "ideal reaction").get_ydata(), np.hypot(reaction.sel(axis="x"), reaction.sel(axis="y")) / 1e3, rtol=1e-14
    )
    (strip,) = normal.collections
    intervals = np.array([[path.vertices[:, 0].min(), path.vertices[:, 0].max()] for path in strip.get_paths()])
    np.testing.assert_allclose(intervals[:, 0], 1e3 * run["contact_start"], rtol=1e-12)
    np.testing.assert_allclose(np.diff(intervals)[:, 0], 0.3, rtol=1e-9)


def test_contact_that_outlasts_the_run(run):
    """Limit: a contact without an end is shown until the run's end."""
    durations = run["contact_duration"].copy()
    durations[-1] = math.nan
    (strip,) = force(run.assign(contact_duration=durations))[0].collections
    assert strip.get_paths()[-1].vertices[:, 0].max() == pytest.approx(1e3 * END, rel=1e-12)


def test_force_without_contacts(ideal):
    """Limit: without contact the panel has a note; without friction there is no friction panel."""
    (axes,) = force(made_up(contacts=False), ideal)
    assert "no contact in this run" in [text.get_text() for text in axes.texts]
    assert not axes.collections
    with pytest.raises(sd.InputError, match="without clearance joints"):
        force(ideal)


def test_force_of_several_joints(two_joints):
    """Contract: each joint has its own panels with its own contacts; a wrong name gets a suggestion."""
    drawn = force(two_joints)
    assert [axes.get_title(loc="left") for axes in drawn] == ["joint A", "", "joint unit 1/pivot", ""]
    first, second = (curve(axes, "peak of a contact").get_xdata() for axes in (drawn[0], drawn[2]))
    shared = min(len(first), len(second))
    np.testing.assert_allclose(np.subtract(second[:shared], first[:shared]), 1.3, rtol=1e-9)
    assert len(force(two_joints, joint="unit 1/pivot")) == 2
    with pytest.raises(sd.InputError, match=r"did you mean 'unit 1/pivot'\?"):
        force(two_joints, joint="unit 1/pivto")


def lines_of(axes, label):
    """Return the lines of an orbit between samples, shape (lines, 2, 2)."""
    found = [drawn for drawn in axes.collections if drawn.get_label() == f"_{label}"]
    return np.array([segment for drawn in found for segment in drawn.get_segments()])


def test_orbit_shows_the_data(run):
    """Contract: free flight and contact together are the orbit, coloured by time; the circle is the clearance."""
    axes = orbit(run, exaggeration=1.0)[0]
    place, touching = 1e3 * run["eccentricity"].sel(joint="A").values, run["in_contact"].sel(joint="A").values
    lines, closed = np.stack([place[:-1], place[1:]], axis=1), touching[:-1] & touching[1:]
    np.testing.assert_allclose(lines_of(axes, "contact"), lines[closed], rtol=1e-12)
    np.testing.assert_allclose(lines_of(axes, "free flight"), lines[~closed], rtol=1e-12)
    time = np.concatenate([drawn.get_array() for drawn in axes.collections])
    np.testing.assert_allclose(np.sort(time), 0.5 * (run["time"].values[:-1] + run["time"].values[1:]), rtol=1e-12)
    circle = np.array(curve(axes, "clearance circle").get_xydata())
    np.testing.assert_allclose(np.hypot(*circle.T), 1e3 * CLEARANCE, rtol=1e-12)
    assert axes.get_aspect() == 1.0
    assert axes.get_xlabel() == "x of the journal [mm]"


def test_exaggerated_indentation_is_labelled(run):
    """Closed form: c + delta is drawn as c + 5 delta in the same direction, with a note; free flight is unchanged."""
    axes = orbit(run, exaggeration=5.0)[0]
    assert "indentation magnified 5 times" in axes.get_title(loc="left")
    touching = run["in_contact"].sel(joint="A").values
    starts = np.flatnonzero(touching[:-1] & touching[1:])
    depth = run["indentation"].sel(joint="A").values[starts]
    contact = lines_of(axes, "contact")[:, 0]
    np.testing.assert_allclose(np.hypot(*contact.T), 1e3 * (CLEARANCE + 5.0 * depth), rtol=1e-12)
    place = run["eccentricity"].sel(joint="A").values[starts]
    np.testing.assert_allclose(np.arctan2(*contact.T), np.arctan2(*place.T), atol=1e-12)


@pytest.mark.parametrize(
    ("depth", "said"), [(3e-5, ""), (1e-6, "indentation magnified 50 times"), (2e-5, "indentation magnified 2 times")]
)
def test_default_exaggeration(run, depth, said):
    """Closed form: the largest of 1, 2, 5, 10, ... that draws the deepest indentation no deeper than a tenth of c."""
    touching = run["in_contact"]
    place = run["eccentricity"] / np.hypot(run["eccentricity"].sel(axis="x"), run["eccentricity"].sel(axis="y"))
    (axes,) = orbit(run.assign(eccentricity=place * (CLEARANCE + xr.where(touching, depth, -depth))))
    assert axes.get_title(loc="left") == ", ".join(filter(None, ["joint A", said]))


def test_trust_horizon_is_shaded_and_labelled_once(arm, ideal):
    """Contract: every panel over time is shaded from the horizon to the end, and each figure explains it once."""
    doubtful = made_up(trusted_until=0.021)
    for name, drawn in figures(doubtful, ideal, arm).items():
        figure = drawn[0].get_figure(root=True)
        legends = [*figure.legends, *(axes.get_legend() for axes in drawn if axes.get_legend())]
        said = [text.get_text() for legend in legends for text in legend.get_texts()]
        assert sum(BEYOND_HORIZON in text for text in said) == 1, name
        if name in ("response", "force", "torque", "energy"):
            for axes in drawn:
                spans = [patch.get_window_extent().transformed(axes.transData.inverted()) for patch in axes.patches]
                assert [(round(box.x0, 9), round(box.x1, 9)) for box in spans] == [(21.0, 50.0)], name


@pytest.mark.parametrize("until", [math.nan, END])
def test_trusted_run_is_not_shaded(until, arm):
    """Limit: nothing is shaded when the horizon is unknown or at the end."""
    for name, drawn in figures(made_up(trusted_until=until), None, arm).items():
        labels = [label for axes in drawn for label in axes.get_legend_handles_labels()[1]]
        assert not any(BEYOND_HORIZON in label for label in labels), name


@pytest.mark.parametrize("joints", [("A",), tuple(CLEARANCE_JOINTS)])
@pytest.mark.parametrize("until", [math.nan, 0.021])
def test_texts_do_not_overlap(joints, until, ideal):
    """Contract: the boxes of all shown texts are apart from each other and inside the figure."""
    for name, drawn in figures(made_up(joints, trusted_until=until), ideal, mechanism_with(joints)).items():
        assert overlaps(drawn[0].get_figure(root=True)) == [], name


def test_overlaps_are_found():
    """Contract: `overlaps` finds two texts at one place, and one outside the figure."""
    figure = Figure()
    for text in ("one", "two"):
        figure.text(0.5, 0.5, text)
    figure.text(-0.1, 0.1, "out")
    assert overlaps(figure) == [("one", "two"), ("out", "edge")]


def test_given_axes_are_used(run, ideal):
    """Contract: pictures are drawn into the given Axes only; a wrong number of Axes is refused."""
    figure = Figure()
    six = figure.subplots(3, 2)
    assert response(run, ideal, axes=six.flat) == list(six.flat)
    assert not figure.legends
    one = Figure().subplots()
    assert torque(run, ideal, axes=one) == [one]
    assert orbit(run, axes=one) == [one]
    with pytest.raises(sd.InputError, match="got 1 Axes; expected 2 Axes"):
        force(run, ideal, axes=one)


def test_every_legend_entry_looks_different(run, ideal, arm):
    """Contract: no two curves of one panel share colour, dash, marker and width."""
    for name, drawn in figures(run, ideal, arm).items():
        for axes in drawn:
            handles, labels = axes.get_legend_handles_labels()
            looks = {
                ("patch", handle.get_facecolor())
                if isinstance(handle, Patch)
                else (handle.get_color(), handle.is_dashed(), handle.get_marker(), handle.get_linewidth())
                for handle in handles
                if isinstance(handle, Patch | Line2D)
            }
            assert len(looks) == len([handle for handle in handles if isinstance(handle, Patch | Line2D)]), (name, labels)


def test_one_sample():
    """Limit: a run of one sample is drawn, with one point per curve."""
    short = made_up().isel(time=[0])
    drawn = figures(short, None, mechanism_with(("A",)))
    for name, axes in drawn.items():
        picture = io.BytesIO()
        axes[0].get_figure(root=True).savefig(picture, format="svg")
        assert b"</svg>" in picture.getvalue(), name
    line = curve(drawn["torque"][0], "with clearance")
    assert line.get_xdata().tolist() == [0.0]
    assert line.get_ydata().tolist() == pytest.approx([1e-3 * float(short["drive_torque"][0])], rel=1e-12)  # in kN m


@pytest.mark.parametrize("name", [r"$\frac{$", "a $ b", "[/red]pin", "\x1b[31m\x00m", r"$\alpha$", r"a\$b", "{x}^_%"])
def test_names_are_text(name, run, arm):
    """Contract: a joint's name is drawn as text, not as a formula; a control character as its code."""
    joints = tuple(dataclasses.replace(joint, name=name) if joint.name == "A" else joint for joint in arm.joints)
    named = run.assign_coords(joint=[name if old == "A" else old for old in run["joint"].values.tolist()])
    named["contact_joint"] = named["contact_joint"].astype(object).where(named["contact_joint"] != "A", name)
    changed = dataclasses.replace(arm, joints=joints)
    shown, naming = figures(named, None, changed), set()
    for kind, axes in shown.items():
        figure = axes[0].get_figure(root=True)
        if any(literal(name) in text.get_text() for text in figure.findobj(Text)):
            naming.add(kind)
            figure.draw_without_rendering()
    assert {"orbit", "structure"} <= naming
    text = next(text for text in shown["structure"][0].texts if text.get_text().startswith(literal(name)))
    assert text._preprocess_math(text.get_text()) == (printable(name), False)


@pytest.mark.parametrize("format", ["png", "svg"])
def test_draw_all(format, run, ideal, arm, tmp_path):
    """Contract: all pictures, in a created folder, in the given format, with the same bytes each time, and nothing else."""
    first = draw_all(run, ideal, tmp_path / "a" / "b", arm, format)
    second = draw_all(run, ideal, tmp_path / "c", arm, format=format)
    assert [path.name for path in first] == [f"{name}.{format}" for name in ALL]
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == sorted(path.name for path in first)
    opening = {"png": b"\x89PNG", "svg": b"<?xml"}[format]
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes().startswith(opening)
        assert one.read_bytes() == other.read_bytes()


def test_draw_all_of_an_ideal_run(ideal, tmp_path):
    """Limit: without clearance joints and drives there are no pictures of forces, orbits and torques."""
    free = ideal.drop_vars("drive_torque")
    assert [path.stem for path in draw_all(free, None, tmp_path, mechanism_with(()))] == ["response", "energy", "structure"]


def test_failed_writes_leave_no_files(run, arm, tmp_path):
    """Contract: an unknown format writes nothing, and a file that cannot be replaced leaves no parts."""
    with pytest.raises(sd.InputError, match=r"did you mean 'png'\?"):
        draw_all(run, None, tmp_path / "new", arm, "pgn")
    assert not (tmp_path / "new").exists()
    (tmp_path / "taken.png").mkdir()
    with pytest.raises(sd.InputError, match="cannot write"):
        write(Figure(), tmp_path / "taken.png")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]
    (tmp_path / "file").touch()
    with pytest.raises(sd.InputError, match="cannot make the folder"):
        draw_all(run, None, tmp_path / "file", arm, only=["torque"])


def test_terms_of_the_energy_picture(run):
    """Contract: work of motors, energy of springs and losses of dampers are drawn by name, unless they are zero."""
    more = run.assign(
        motor_work=2.0 * run["drive_work"],
        load_work=0.0 * run["drive_work"],
        stored_energy=0.5 * run["kinetic_energy"],
        damper_loss=3.0 * run["dissipated_energy"],
    )
    balance, losses, _ = energy(more)
    labels = {line.get_label() for axes in (balance, losses) for line in axes.lines}
    assert {"work of motors and actuators", "springs and other components", "dampers and other components"} <= labels
    assert "work of forces and torques" not in labels
    assert losses.get_ylabel() == "losses [J]"


def test_joints_are_chosen_by_the_peaks_of_their_contacts(run):
    """Contract: joints are ranked by located peaks, also between samples; figures give the number of omitted joints."""
    names = [f"joint {k}" for k in range(8)]
    force_ = np.tile(np.linspace(1.0, 8.0, 8), (run.sizes["time"], 1))
    many = xr.Dataset(
        {
            "clearance": ("joint", np.full(8, 1e-4)),
            "normal_force": (("time", "joint"), force_, {"units": "N"}),
            "friction_force": (("time", "joint"), np.zeros_like(force_), {"units": "N"}),
            "reaction": (("time", "joint", "axis"), np.stack([force_, 0.0 * force_], axis=-1), {"units": "N"}),
            "contact_joint": ("contact", ["joint 0"]),
            "contact_start": ("contact", [float(run["time"][3])]),
            "contact_duration": ("contact", [1e-5]),
            "peak_time": ("contact", [5e-6]),
            "peak_force": ("contact", [100.0]),
        },
        coords={"time": run["time"], "joint": names},
    )
    assert chosen_joints(many, None) == ["joint 0", *names[3:]]
    figure = force(many)[0].get_figure(root=True)
    assert figure.get_supxlabel() == "2 more clearance joints with smaller forces"
    assert force(many, joint="joint 1")[0].get_figure(root=True).get_supxlabel() == ""


def test_largest_torque_is_the_located_one(run):
    """Contract: the mark is at the maximum that the run located between its samples, if it is in the window."""
    spike = xr.Dataset({"peak_drive_torque": ("drive", [2e5]), "peak_drive_torque_time": ("drive", [0.01234])})
    located = run.merge(spike.assign_coords(drive=["unit 1/bar 1"]))
    mark = next(line for line in torque(located)[0].lines if line.get_label() == "largest")
    assert np.allclose(mark.get_xydata(), [[12.34, 200.0 * np.sign(np.interp(0.01234, run["time"], run["drive_torque"]))]])
    other = located.assign(drive_torque=-located["drive_torque"].assign_attrs(units="N m"))
    other["drive_torque"].attrs.update(located["drive_torque"].attrs)
    turned = next(line for line in torque(other)[0].lines if line.get_label() == "largest")
    assert np.allclose(turned.get_xydata(), mark.get_xydata() * [1.0, -1.0])
    late = torque(located.isel(time=slice(1000, None)))[0]
    assert not [line for line in late.lines if line.get_label() == "largest"]


def test_round_off_of_a_constant_speed_is_not_drawn():
    """Limit: the acceleration of a crank at constant speed is drawn as zero; the slider's is not."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).driven(speed=20.0)
    run = sd.simulate(crank, until=0.1, samples=51)
    run["angular_acceleration"] = run["angular_acceleration"] + 1e-12
    drawn = response(run, body="crank")
    assert np.all(drawn[5].lines[0].get_ydata() == 0.0)
    assert np.abs(drawn[4].lines[0].get_ydata()).max() > 1.0


@pytest.fixture(scope="module")
def tracked():
    crank = sd.slider_crank().with_clearance("slider pin", sd.Clearance(2e-4)).track("pin", "rod", "end", TOLERANCE)
    return sd.simulate(crank.controlled(sd.PID(30.0, 0.5, limit=2.0), reference=sd.Cycloidal(0.0, 2.0, 0.05)), until=0.1)


def test_picture_of_a_deviation(tracked):
    """Contract: the curve reaches the located maximum, and the dotted line is the tolerance; a window has its part."""
    (axes,) = sd.plot.track(tracked)
    lines = {line.get_label(): line for line in axes.lines}
    factor = 1e3 if "mm" in axes.get_ylabel() else 1e6
    largest = float(tracked["peak_track_deviation"][0])
    assert np.max(lines["deviation"].get_ydata()) == pytest.approx(factor * largest, rel=1e-12)
    assert lines["largest"].get_ydata()[0] == pytest.approx(factor * largest)
    assert lines["tolerance"].get_ydata()[0] == pytest.approx(factor * TOLERANCE)
    assert sd.plot.track(tracked, start=0.02, end=0.03)[0].get_xlim() == pytest.approx((20.0, 30.0), abs=0.1)
    plain = sd.simulate(sd.slider_crank().driven(speed=100.0), until=0.01, samples=11)
    with pytest.raises(sd.InputError, match="tracked point"):
        sd.plot.track(plain)


def test_torque_shades_its_limit(tracked):
    """Contract: the shaded intervals last as long as the summary says, and lines mark the limit."""
    (axes,) = sd.plot.torque(tracked)
    shaded = [patch for patch in axes.patches if patch.get_label() == "at the limit"]
    lasting = tracked.scissordyn.summary().actuators[0].time_at_limit
    assert lasting > 0.0
    factor = 1e3 if "ms" in axes.get_xlabel() else 1.0
    assert sum(patch.get_width() for patch in shaded) == pytest.approx(factor * lasting, rel=0.02)
    limits = [float(line.get_ydata()[0]) for line in axes.lines if line.get_label() == "limit"]
    assert {abs(limit) for limit in limits} == {2.0}


def test_position_of_payloads_and_panels():
    """Contract: a payload is centred at its point and a panel between its two points, at every sample."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(150))
    arm = sd.with_panels(sd.with_payload(arm, "unit 2/bar 1.end", 12.0), "unit 1/bar 2", 1.0)
    moved = sd.simulate(arm, until=0.02, samples=5)
    placement = Placement.at(arm, moved, slice(None))
    panel, payload = load_shapes(arm, placement, 0.02)
    assert (panel.kind, payload.kind, payload.name) == ("panel", "payload", "payload, 12 kg")
    assert payload.points.mean(axis=1) == pytest.approx(placement.place(("unit 2/bar 1", "end")))
    ends = [placement.place(("unit 1/bar 2", name)) for name in ("start", "end")]
    assert panel.points.mean(axis=1) == pytest.approx(0.5 * (ends[0] + ends[1]))
    twice = sd.with_payload(arm, "unit 2/bar 1.end", 1.0).body("unit 2/bar 1")
    assert {"payload", "payload 2"} <= twice.points.keys()
    assert twice.payloads == (12.0, 1.0)
