"""Contacts that begin slowly and are loaded afterwards: forces, steps, energies and warnings."""

import numpy as np
import pytest
from tests.build import EXAMPLES, balanced, counts_of, in_bearing, warnings_of

import scissordyn as sd

HALF = {"damping": sd.Flores(restitution=0.5)}  # Damping law with a restitution coefficient of 0.5
LOADED, ONSET = "refers to", "compare reference = 'loaded'"  # Words of the warning about a loaded contact, and of its advice


def lift(**laws):
    """Return a slow lift of nine loose pins."""
    laws = {"friction": sd.Ambrosio(kinetic=0.12)} | laws
    return sd.read_case(EXAMPLES / "lift.toml").mechanism.with_clearance("all", sd.Clearance(5e-5, **laws))


def lifted(**laws):
    """Return a run of the lift from static equilibrium."""
    return sd.simulate(lift(**laws), until=0.15, start="static", rtol=1e-5, atol=1e-5)


@pytest.fixture(scope="module")
def undamped():
    return lifted(damping=sd.law("damping", "none")())


def dropped(reference="loaded", speed=0.1, **run):
    """Return a mass that hits its bearing and bounces on it under gravity."""
    gap = sd.Clearance(0.5e-3, reference=reference, **HALF)
    ball = in_bearing(gap, position=(0.0, -0.5e-3), velocity=(0.0, -speed))
    return sd.simulate(ball, **{"until": 0.03, "start": "as-placed", "rtol": 1e-9, "atol": 1e-9} | run)


@pytest.mark.parametrize("restitution", [0.9, 0.5, 0.2])
def test_slow_loads_hardly_depend_on_restitution(restitution, undamped):
    """Limit: the forces of a slow lift are those without damping, except for a vibration, in no more steps."""
    run = lifted(damping=sd.Flores(restitution=restitution))
    assert float(run["peak_force"].max()) == pytest.approx(float(undamped["peak_force"].max()), rel=0.035)
    assert counts_of(run)["steps"] <= counts_of(undamped)["steps"]
    assert balanced(run, 1e-7, terms=("drive_work",))
    assert [text for text in warnings_of(run) if LOADED in text] == [text for text in warnings_of(run) if "began at" in text]
    assert len([text for text in warnings_of(run) if LOADED in text]) == 9


def test_bounce_comes_to_rest():
    """Closed form: flights of 2 v/g after four rebounds, then the mass stays on its bearing."""
    run = dropped()
    start, duration = run["contact_start"].values, run["contact_duration"].values
    assert start.size == 5
    assert np.isnan(duration[-1])
    assert start[-1] < 0.024
    flights = start[1:] - start[:-1] - duration[:-1]
    assert flights == pytest.approx(-2.0 * run["rebound_speed"].values[:-1] / 9.81, rel=1e-4)
    # the weight takes its part of the slower ones
    assert -run["rebound_speed"].values[0] == pytest.approx(0.46 * 0.1, rel=0.01)


@pytest.mark.parametrize("speed", [1e-2, 1.0])
def test_free_impact_is_the_published_one(speed):
    """Identity: without a load, impact and flight are those of the approach speed, bit for bit, without a warning."""
    runs = []
    for reference in ("loaded", "onset"):
        ball = in_bearing(sd.Clearance(0.5e-3, reference=reference, **HALF), velocity=(speed, 0.0))
        flight = ball.with_parts({"gravity": 0.0})
        # a stiff method chooses its first step in a contact by a force deeper in it, which depends on the reference
        runs.append(sd.simulate(flight, until=3e-3 / speed, samples=50, start="as-placed", method="dop853"))
    assert runs[0].sizes["contact"] >= 1
    for name in ("position", "normal_force", "contact_duration", "rebound_speed", "energy_residual", "effective_mass"):
        np.testing.assert_array_equal(runs[0][name].values, runs[1][name].values)
    assert not any("began at" in text for run in runs for text in warnings_of(run))


def test_warnings_of_loaded_contacts():
    """Contract: a contact loaded beyond an impact gives a warning about the reference of its damping."""
    loaded, onset = (lifted_gently(reference) for reference in ("loaded", "onset"))
    assert any(LOADED in text and ONSET not in text for text in warnings_of(loaded))
    assert any(ONSET in text for text in warnings_of(onset))


def lifted_gently(reference):
    """Return a mass that rests in its bearing and is pressed by a growing force."""
    press = sd.Force("press", ("ball", "centre"), (0.0, -2e4), time_function=sd.Cycloidal(0.0, 1.0, 0.02))
    ball = in_bearing(sd.Clearance(0.5e-3, reference=reference, **HALF), position=(0.0, -0.5e-3))
    return sd.simulate(ball.with_parts({"components": (press,)}), until=0.03, start="static")


@pytest.mark.parametrize("bending", [{"modes": 4}, {"modes": 12}, {"elements": 4}, {"elements": 8}])
def test_impact_on_a_bar_that_bends(bending):
    """Limit: an impact is nearly the published one for any division of a bar, which has the mass of the whole bar."""
    runs = {}
    for reference in ("loaded", "onset"):
        crank = sd.slider_crank(crank=0.05, rod=0.3, rod_mass=0.0942, rod_inertia=7.065e-4, slider_mass=0.5, gravity=0.0)
        crank = sd.with_bending(
            crank.driven(speed=sd.rpm(300)), "rod", bending_stiffness=11.2, axial_stiffness=8.4e6, **bending
        )
        spring = sd.law("stiffness", "linear")(5e6)
        law = sd.law("damping", "lankarani-nikravesh")(restitution=0.9)
        gap = sd.Clearance(5e-4, stiffness=spring, damping=law, reference=reference)
        runs[reference] = sd.simulate(crank.with_clearance("slider pin", gap), until=8e-3, samples=11)
    loaded, onset = runs["loaded"], runs["onset"]
    assert float(loaded["effective_mass"][0]) == pytest.approx(1.0 / (1.0 / 0.0942 + 1.0 / 0.5), rel=1e-12)
    assert float(loaded["rebound_speed"][0]) == pytest.approx(float(onset["rebound_speed"][0]), rel=0.01)


def test_slow_press_is_elastic():
    """Closed form: the normal force is the slowly growing load, without damping."""
    run = lifted_gently("loaded")
    at = int(np.argmin(np.abs(run["time"].values - 0.025)))
    assert float(run["normal_force"].values[at, 0]) == pytest.approx(2e4 + 9.81, rel=1e-4)
    assert float(run["peak_normal_force"].max()) == pytest.approx(2e4 + 9.81, rel=1e-3)


def test_forces_of_a_batch():
    """Identity: forces of a batch are bit for bit those of single runs, for contacts that begin at the start or later."""
    options = {"until": 0.05, "start": "static", "rtol": 1e-5, "atol": 1e-5}
    over = {"slider.mass": [8.0, 5.0]}
    batch = sd.simulate_many(lift(**HALF), over, measures=("peak_force",), threads=1, **options)
    for k, mass in enumerate(over["slider.mass"]):
        run = sd.simulate(lift(**HALF).replace("slider.mass", mass), samples=2, **options)
        largest = run["peak_force"].groupby(run["contact_joint"]).max()
        for joint in largest["contact_joint"].values:
            assert float(batch["peak_force"].isel(case=k).sel(joint=joint)) == float(largest.sel(contact_joint=joint))


def test_slowly_loaded_stop():
    """Limit: an end stop that is reached slowly carries its load, for any restitution."""
    stop = sd.TravelStop("stop", ("ball", "centre"), direction=0.0, limit=1e-4, stiffness=1e8, exponent=1.5, restitution=0.2)
    press = sd.Force("press", ("ball", "centre"), (500.0, 0.0), time_function=sd.Cycloidal(0.0, 1.0, 0.1))
    ball = sd.point_mass("ball", mass=1.0, position=(0.0, 0.0))
    rail = sd.Guide("rail", ("ball", "centre"))
    run = sd.simulate(sd.Mechanism((ball,), guides=(rail,), components=(stop, press), gravity=0.0), until=0.15, samples=301)
    force = -run["travel_stop_force"].values[:, 0]
    load = 500.0 * np.interp(run["time"].values, *cycloid(0.1))
    settled = run["time"].values > 0.05
    assert force[settled] == pytest.approx(load[settled], rel=5e-3)


def cycloid(duration):
    """Return instants and values of a cycloidal rise to one."""
    part = np.linspace(0.0, 2.0, 4001)
    return duration * part, np.where(part < 1.0, part - np.sin(2.0 * np.pi * part) / (2.0 * np.pi), 1.0)
