"""Contact statistics and deviations count what the table of contacts says."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.analysis.contact import QUANTILES, contact_spans, deviation, smallest_arc
from scissordyn.casefile.configuration import write_configuration

from .made_up import BODIES, CLEARANCE, made_up_run

# [s] start and end of each contact in a made-up run; the last contact does not end
CONTACT_SPANS = [(0.1, 0.2), (0.4, 0.45), (0.9, math.nan)]


def test_fractions_of_time():
    """Closed form: contacts of 0.1, 0.05 and 0.1 s in 1 s, the last until the end; flights lie between them."""
    found = sd.contact_statistics(made_up_run(CONTACT_SPANS)).sel(joint="A")
    assert int(found["impacts"]) == 3
    assert float(found["impact_rate"]) == pytest.approx(3.0, rel=1e-14)
    assert float(found["contact_fraction"]) == pytest.approx(0.25, rel=1e-14)
    assert float(found["flight_fraction"]) == pytest.approx(0.75, rel=1e-14)
    assert float(found["longest_flight"]) == pytest.approx(0.45, rel=1e-14)
    assert float(found["peak_force"]) == 120.0
    np.testing.assert_allclose(found["peak_force_quantile"], np.quantile([100.0, 110.0, 120.0], QUANTILES), rtol=1e-14)
    assert float(found["contact_force"]) == pytest.approx(100.0, rel=1e-13)
    # the trapezoids at the five edges of contacts are off by half a sample of 1 ms each at most
    assert float(found["mean_force"]) == pytest.approx(25.0, abs=5 * 100.0 * 0.5e-3)


def test_quantile_over_the_contact_time():
    """Closed form: the force not exceeded for half of the contact time, however the samples are spread over it."""
    run = made_up_run(CONTACT_SPANS)
    time = run["time"].values
    touching = run["in_contact"].sel(joint="A").values.astype(bool)
    late = touching & (time > 0.39)
    force = np.where(touching, 100.0, 0.0)
    force[late] = 300.0  # for 0.15 s of 0.25 s, and in a fifth of the samples of that time
    run["normal_force"].loc[{"joint": "A"}] = force
    thin = ~late
    thin[np.flatnonzero(late)[::5]] = True
    for sampled in (run, run.isel(time=np.flatnonzero(thin))):
        found = sd.contact_statistics(sampled).sel(joint="A")
        assert float(found["contact_force_quantile"].sel(quantile=0.5)) == 300.0
        assert float(found["contact_force"]) == pytest.approx((100.0 * 0.1 + 300.0 * 0.15) / 0.25, rel=0.02)


def test_window_clips_contacts():
    """Closed form: a contact over the edge of the window counts by its part inside, and as an impact if it starts there."""
    run = made_up_run(CONTACT_SPANS)
    found = sd.contact_statistics(run, after=0.15, until=0.42).sel(joint="A")
    assert int(found["impacts"]) == 1
    assert float(found["contact_fraction"]) == pytest.approx(0.07 / 0.27, rel=1e-12)
    assert float(found["longest_flight"]) == pytest.approx(0.2, rel=1e-12)
    assert float(sd.contact_statistics(run, after=0.95).sel(joint="A")["flight_fraction"]) == pytest.approx(0.0, abs=1e-14)
    for after, until in ((0.5, 0.5), (0.5, 2.0), (math.nan, None)):
        with pytest.raises(sd.InputError, match="a window inside the run"):
            sd.contact_statistics(run, after=after, until=until)


@pytest.mark.parametrize("window", [(0.0, 1.0), (0.25, 1.0), (0.1, 0.8)])
def test_force_of_a_contact_that_lasts(window):
    """Closed form: few samples of a contact over the whole window count by the part of the window that is theirs."""
    run = made_up_run([(0.0, math.nan)], instants=5)
    time, (after, until) = run["time"].values, window
    force = 100.0 * time
    run["normal_force"].loc[{"joint": "A"}] = force
    found = sd.contact_statistics(run, after=after, until=until).sel(joint="A")
    inside = (time >= after) & (time <= until)
    width = np.minimum(time + 0.125, until) - np.maximum(time - 0.125, after)
    assert float(found["contact_force"]) == pytest.approx(np.average(force[inside], weights=width[inside]), rel=1e-13)
    if window == (0.0, 1.0):
        assert float(found["contact_force"]) == pytest.approx(float(found["mean_force"]), rel=1e-13)


def test_window_between_samples():
    """Limit: a window without a sample and without the largest force of a contact has no known force."""
    found = sd.contact_statistics(made_up_run([(0.0, math.nan)], instants=5), after=0.3, until=0.4).sel(joint="A")
    assert float(found["contact_fraction"]) == pytest.approx(1.0)
    assert all(math.isnan(float(found[name])) for name in ("peak_force", "mean_force", "contact_force"))


def test_no_contact_at_all():
    """Limit: without contacts there is one flight, no force, and what cannot be said is NaN."""
    found = sd.contact_statistics(made_up_run([])).sel(joint="A")
    assert float(found["flight_fraction"]) == 1.0
    assert float(found["longest_flight"]) == 1.0
    assert float(found["peak_force"]) == 0.0
    for name in ("contact_arc", "contact_arc_95", "contact_force", "impulse_mean", "dissipated_energy"):
        assert math.isnan(float(found[name]))
    with pytest.raises(sd.InputError, match="without clearance joints"):
        sd.contact_statistics(made_up_run([]).drop_vars("clearance"))


def test_impulses_and_losses():
    """Closed form: sums, means and quantiles of impulses and losses, over contacts begun in the window."""
    run = made_up_run(CONTACT_SPANS).assign(
        impulse=("contact", [1.0, 2.0, 6.0]),
        contact_damping_loss=("contact", [0.1, 0.2, 0.3]),
        contact_friction_loss=("contact", [1.0, 2.0, 3.0]),
    )
    found = sd.contact_statistics(run, after=0.3).sel(joint="A")
    assert [float(found[name]) for name in ("impulse", "impulse_mean", "impulse_largest")] == [8.0, 4.0, 6.0]
    np.testing.assert_allclose(found["impulse_quantile"], np.quantile([2.0, 6.0], QUANTILES), rtol=1e-14)
    assert float(found["dissipated_energy"]) == pytest.approx(5.5, rel=1e-14)
    assert float(found["dissipated_power"]) == pytest.approx(5.5 / 0.7, rel=1e-14)


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0, 6.2])
def test_smallest_arc(turn):
    """Closed form: 19 points on an arc of 0.5 and a stray one, light or heavy; the same for any rotation of the arc."""
    angles = np.append(np.linspace(0.0, 0.5, 19), math.pi) + turn
    assert smallest_arc(angles, fraction=0.95) == pytest.approx(0.5, abs=1e-12)
    assert smallest_arc(angles) == pytest.approx(math.pi, abs=1e-12)
    assert smallest_arc(angles, fraction=0.95, weights=np.append(np.ones(19), 9.0)) == pytest.approx(
        math.pi - 0.5 / 18, abs=1e-12
    )
    assert smallest_arc([turn]) == 0.0


def test_smallest_arc_against_search():
    """Cross-check: every arc from a point to a point, tried one by one."""
    random = np.random.default_rng(3)
    angles, weights = random.uniform(-20.0, 20.0, 40), random.uniform(0.0, 1.0, 40)
    ahead = np.mod(angles[None] - angles[:, None], 2.0 * np.pi)
    for fraction in (0.3, 0.8, 0.95):
        arcs = [
            reach
            for k in range(40)
            for reach in np.append(ahead[k], 0.0)
            if weights[ahead[k] <= reach + 1e-12].sum() >= fraction * weights.sum()
        ]
        assert smallest_arc(angles, fraction=fraction, weights=weights) == pytest.approx(min(arcs), abs=1e-12)


def test_contact_arc_is_the_bearing_s():
    """Closed form: a contact point that rotates by 1 rad in contact is at rest relative to a bearing that rotates with it."""
    run = made_up_run([(0.0, math.nan)])
    assert float(sd.contact_statistics(run).sel(joint="A")["contact_arc"]) == pytest.approx(1.0, abs=1e-12)
    joints = [sd.Revolute("A", ("bar", "end"), ("slider", "centre")), sd.Revolute("O", ("bar", "start"), ("ground", "origin"))]
    bodies = [sd.bar("bar", length=1.0, mass=1.0), sd.point_mass("slider", mass=1.0)]
    text = write_configuration(sd.Mechanism(bodies, joints, ground=(("origin", (0.0, 0.0)),)))
    turning = run["angle"].copy()
    turning.loc[{"body": "slider"}] = run["time"].values
    turned = run.assign(angle=turning).assign_attrs(configuration=text)
    found = sd.contact_statistics(turned)
    assert found.attrs["arc_frame"] == "bearing"
    assert float(found.sel(joint="A")["contact_arc"]) == pytest.approx(0.0, abs=1e-12)


def test_deviation_of_a_made_up_run():
    """Closed form: bars of unit 2 lag by 0.3 t and -0.1, a further revolution has no effect; the slider is off by 0.2 sin."""
    ideal, run = made_up_run([]), made_up_run([])
    time = run["time"].values
    run["angle"].values[:, BODIES.index("unit 2/bar 1")] += 0.3 * time
    run["angle"].values[:, BODIES.index("unit 2/bar 2")] += 2.0 * math.pi - 0.1
    run["slider_position"].values[:] += 0.2 * np.sin(2.0 * math.pi * time)
    run["position"].values[:, 0] += [0.03, 0.04]
    found = deviation(run, ideal)
    np.testing.assert_allclose(found["synchronisation_error"], np.maximum(0.3 * time, 0.1), atol=1e-14)
    assert float(found["synchronisation_error_max"]) == pytest.approx(0.3, rel=1e-12)
    assert float(found["output_error_max"]) == pytest.approx(0.2, rel=1e-5)
    assert float(found["output_error_rms"]) == pytest.approx(0.2 / math.sqrt(2.0), rel=1e-3)
    assert float(found["position_error_rms"].sel(body="unit 1/bar 1")) == pytest.approx(0.05, rel=1e-12)
    with pytest.raises(sd.InputError, match="the same options `until` and `samples`"):
        deviation(run, made_up_run([], instants=501))


def test_statistics_of_a_real_run(clearance_array, clearance_run):
    """Cross-check: fractions and impulses of contacts against the samples, their dissipation against that of the run."""
    ideal = sd.simulate(clearance_array.ideal(), until=0.05)
    found = sd.contact_statistics(clearance_run, ideal=ideal)
    joint = found.sel(joint="A")
    samples = float(clearance_run["in_contact"].sel(joint="A").mean())
    contacts = len(contact_spans(clearance_run, "A"))
    assert contacts == int(joint["impacts"]) > 5
    assert abs(float(joint["contact_fraction"]) - samples) < contacts / clearance_run.sizes["time"]
    assert 0.0 < float(found["output_error_max"]) < 4.0 * 0.5e-3
    assert float(joint["peak_force"]) == float(clearance_run["peak_force"].max())
    assert float(found["synchronisation_error_max"]) < CLEARANCE
    lost = float(clearance_run["damping_loss"][-1] + clearance_run["friction_loss"][-1])
    assert float(joint["dissipated_energy"]) == pytest.approx(lost, rel=1e-9)
    assert float(joint["impulse"]) / 0.05 == pytest.approx(float(joint["mean_force"]), rel=0.01)
