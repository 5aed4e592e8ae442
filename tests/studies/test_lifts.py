"""Lifts: measures of statics in batches and studies by closed forms, and the example study of the lightest bars."""

import math
from pathlib import Path

import numpy as np
import pytest
from tests.build import EXAMPLES

import scissordyn as sd
from scissordyn.cli.main import status_of

G, ARMS = 9.81, 36.0  # Gravity [m/s^2] and mass of the arms [kg]


def jack_force(payload):
    """Return the jack's force across the foot of the lowest lift of three stages [N]."""
    foot = 0.9397
    return 3.0 * G * (payload + 0.5 * ARMS) * foot / math.sqrt(1.0 - foot**2)


def test_batch_is_statics_of_each_case():
    """Identity: the largest forces are those of statics; without other measures nothing is integrated."""
    lift = sd.read_case(EXAMPLES / "lift.toml").mechanism
    names = ("static_rod_force", "static_reaction", "static_component_force")
    batch = sd.simulate_many(lift, {"gravity": [4.0, 9.81]}, until=0.9, start="static", measures=(*names, "mass"))
    assert list(batch["status"].values) == ["complete"] * 2
    assert batch.attrs["integration_seconds"] == 0.0
    np.testing.assert_allclose(batch["static_rod_force"].values[:, 0], jack_force(40.0) * np.array([4.0, G]) / G, rtol=1e-11)
    forces = sd.statics(lift, until=0.9, points=101)
    sizes = np.maximum(np.abs(forces["least"]), np.abs(forces["largest"]))
    for name, dim, kind in (
        ("static_reaction", "ideal_joint", "reaction"),
        ("static_component_force", "component", "travel stop force"),
    ):
        for part in batch[dim].values.tolist():
            largest = float(batch[name].sel({dim: part})[1])
            assert largest == pytest.approx(float(sizes.sel(quantity=f"{kind} {part}")), rel=1e-3)
    also = sd.simulate_many(lift, {"gravity": [9.81]}, until=0.1, measures=("static_rod_force", "steps"))
    assert float(also["steps"][0]) > 0.0


def test_measures_of_couplings_servos_and_bars():
    """Identity: measures of couplings, drives, servos and bending bars are those of statics."""
    entry = sd.zoo["screw-driven-array"]
    forces = sd.statics(entry.mechanism, until=0.5, points=51)
    names = ("static_drive_torque", "static_coupling_force")
    batch = sd.simulate_many(entry.mechanism, {"gravity": [G]}, until=0.5, measures=names)
    sizes = [float(np.abs(forces[name]).max()) for name in ("drive_torque", "coupling_force")]
    assert [float(batch[name].values[0, 0]) for name in names] == pytest.approx(sizes)
    servo = sd.read_case(EXAMPLES / "controlled.toml")
    batch = sd.simulate_many(servo.mechanism, {"gravity": [G]}, until=servo.run.until, measures=("static_component_force",))
    torque = sd.statics(servo.mechanism, until=servo.run.until, points=51)["drive_torque"]
    assert float(batch["static_component_force"].values[0, 0]) == pytest.approx(float(np.abs(torque).max()), rel=1e-3)
    table = sd.read_case(EXAMPLES / "lift_table.toml")
    batch = sd.simulate_many(table.mechanism, {"gravity": [G]}, until=0.6, measures=("static_bar_stress",))
    stress = sd.statics(table.mechanism, until=0.6, points=51)["bar_largest_stress"]
    np.testing.assert_allclose(batch["static_bar_stress"].values[0], stress)
    with pytest.raises(sd.InputError, match="without stroke"):
        sd.simulate_many(sd.zoo["press"].mechanism, {"gravity": [G]}, until=0.1, measures=("static_reaction",))


def test_friction_counts_as_the_drives_move():
    """Identity: the drive torque includes friction in the direction of motion."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0).driven(sd.Polynomial((0.5, 1.0)))
    parts = (sd.Force("cut", ("slider", "centre"), force=(-250.0, 0.0)), sd.PinFriction("bearing", "crank", 0.02, 0.2))
    rubbed = crank.with_parts({"components": parts})
    batch = sd.simulate_many(rubbed, {"bearing.kinetic": [0.2]}, until=2.0, measures=("static_drive_torque",))
    forward = sd.statics(rubbed, until=2.0, points=101, friction="forward")
    assert float(batch["static_drive_torque"].values[0, 0]) == pytest.approx(
        float(np.abs(forward["drive_torque"]).max()), rel=1e-4
    )


# Study file of a lift with an uncertain load
STUDY = """
case = "lift.toml"
measures = ["static_rod_force"]
require = ["jack.static_rod_force < 4.9 kN"]

[uncertain]
"load.mass" = "norm(loc=40, scale=4) kg"

[sampling]
samples = 8
"""

# Tables of a load on the platform, part of a case file
LOAD = """[[body]]
name = "load"
mass = "40 kg"
points = { centre = "0, 0 m" }
position = "1.026, 0.940 m"

[[joint]]
name = "platform"
journal = "load.centre"
bearing = "unit 3/bar 1.end"

"""


def test_study_sizes_the_jack(tmp_path, capsys):
    """Closed form: the force of each sample of the payload, and the fraction that meets the bound."""
    text = (EXAMPLES / "lift.toml").read_text()
    payload, rod = text.index("[[payload]]"), text.index("[[rod]]")
    (tmp_path / "lift.toml").write_text(text[:payload] + LOAD + text[rod:])
    (tmp_path / "study.toml").write_text(STUDY)
    assert status_of(["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "study.db"), "--threads", "1"]) == 0
    report = capsys.readouterr().out
    results = sd.open_study(tmp_path / "study.db").dataset
    force = results["static_rod_force"].sel(rod="jack").values
    np.testing.assert_allclose(force, jack_force(results["load.mass"].values), rtol=1e-10)
    assert f"{100.0 * np.mean(force < 4900.0):.1f}%" in report


CASE = Path(__file__).parents[2] / "examples" / "lift_table.toml"  # Case file of a lift table
LOOSER = ["run.rtol=1e-6", "run.atol=1e-6"]  # Options of less accurate runs


def bars(material, section):
    """Return changes of material and section."""
    return [f"structure.bars.material={material}", f"structure.bars.section={section}", *LOOSER]


def test_mass_is_density_times_area():
    """Closed form: four bars of a metre, and 15 kg of table and slider."""
    chosen = sd.read_case(CASE, bars("aluminium", "tube 80x80x2 mm")).mechanism
    area = 0.08**2 - 0.076**2
    assert sum(body.mass for body in chosen.bodies) == pytest.approx(15.0 + 4 * 2700.0 * area, rel=1e-12)


def test_sag_at_rest_is_that_of_other_beams():
    """Second formulation: chains of beam elements instead of modes, in static equilibrium."""
    sag = []
    for also in ([], ["structure.bars.modes=auto", "structure.bars.elements=4"]):
        case = sd.read_case(CASE, [*bars("aluminium", "tube 80x80x2 mm"), *also])
        run = sd.simulate(case.mechanism, until=1e-6, samples=2, start="static")
        sag.append(float(run["track_deviation"].values[0, 0]))
    assert sag[0] == pytest.approx(sag[1], rel=2e-3)
    assert sag[0] == pytest.approx(4.55e-3, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("material", "section", "off", "stress"),
    [
        ("aluminium", "tube 80x80x2 mm", 16.45e-3, 0.261),
        ("titanium", "tube 80x80x1 mm", 19.59e-3, 0.143),
        ("steel", "tube 80x80x1 mm", 10.34e-3, 0.528),
    ],
)
def test_numbers_of_the_measured_page(material, section, off, stress):
    """Cross-check: deviation and utilisation are those of docs/decisions/measured/study_results.md."""
    case = sd.read_case(CASE, bars(material, section))
    run = sd.simulate(case.mechanism, **case.run.keywords)
    assert float(run["track_deviation"].max()) == pytest.approx(off, rel=2e-3)
    assert float(run["bar_largest_utilisation"].max()) == pytest.approx(stress, rel=5e-3)
