"""Pin forces, their envelopes, and the worst load of a bar as beams."""

import io
import json
import math
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

import scissordyn as sd
from scissordyn.errors import InputError
from scissordyn.exchange.beams import beam_file
from scissordyn.exchange.forces import LOCATED, envelope, force_json, force_table, missed_peaks, to_csv

GRAVITY = 9.81


@pytest.fixture(scope="module")
def pendulum():
    """A uniform bar of 2 kg and 0.8 m on a pin, driven at a constant speed."""
    bar = sd.bar("bar", length=0.8, mass=2.0, angle=0.3)
    made = sd.Mechanism((bar,), (sd.Revolute("pin", ("bar", "start"), ("ground", "O")),), ground=(("O", (0.0, 0.0)),))
    driven = made.driven(speed=5.0, body="bar")
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
    """Contract: both bodies of a joint feel opposite forces, and no bar has further forces; friction acts as a torque."""
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
    torque = forces["other_torque"].sel(body="rod").values
    assert np.max(abs(torque + 0.01 * friction)) < 1e-9 * largest
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
    assert rows.loc[("slider", "slider pin"), LOCATED] == rows.loc[("rod", "slider pin"), LOCATED] == peak
    assert math.isnan(rows.loc[("rod", "crank pin"), LOCATED])
    assert rows.loc[("slider", "slider pin"), "largest force [N]"] < 0.5 * peak
    assert [f"largest is {peak:.4g} N" in line for line in missed_peaks(run)] == [True]
    dense = sd.simulate(mechanism, until=0.05, samples="auto")
    assert missed_peaks(dense) == []


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
    with pytest.raises(InputError, match="section 'round' of beams"):
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
