"""Contracts of every run: closed energy balance, names, reproducibility, independence of sampling."""

import numpy as np
import pytest
import xarray as xr
from tests.build import chain, counts_of

import scissordyn as sd

CONTRACT = {
    (
        "time",
    ): "slider_position slider_velocity slider_acceleration drive_torque kinetic_energy potential_energy elastic_energy "
    "drive_work dissipated_energy energy_residual",
    ("time", "body"): "angle angular_velocity angular_acceleration",
    ("time", "body", "axis"): "position velocity acceleration",
    ("time", "joint"): "indentation normal_force friction_force slip_speed in_contact",
    ("time", "joint", "axis"): "eccentricity reaction",
    (
        "contact",
    ): "contact_joint contact_start approach_speed contact_angle peak_force peak_time contact_duration rebound_speed",
}
"""Variables of a run that users may rely on, by their dimensions."""


def same_bits(one, other):
    return one.tobytes() == other.tobytes() if one.dtype.kind == "f" else bool(np.array_equal(one, other))


@pytest.mark.parametrize("case", ["clearance_run", "frictional_run"])
def test_contract_of_names(case, request):
    """Contract: every variable that others may rely on is there, with its dimensions, units and long name."""
    run = request.getfixturevalue(case)
    for name, dims in ((name, dims) for dims, names in CONTRACT.items() for name in names.split()):
        assert run[name].dims == dims
        assert "long_name" in run[name].attrs
        assert name == "contact_joint" or "units" in run[name].attrs


def test_hidden_states_are_in_the_result(frictional_run):
    """Contract: the bristle deflection is recorded, within its bound mu_s/sigma_0, and only in contact."""
    z = frictional_run["bristle_deflection"].sel(joint="A")
    touching = frictional_run["in_contact"].sel(joint="A")
    assert np.array_equal(np.isfinite(z), touching)
    assert np.nanmax(np.abs(z)) <= 0.15 / 1e5 * (1 + 1e-6)


@pytest.mark.parametrize("case", ["clearance_run", "frictional_run"])
def test_energy_balance_closes(case, request):
    """Identity: T + U + V = work - losses within 1e-6 of the largest kinetic energy over 50 ms.

    Losses never fall by more than what bent bristles hold, F_n mu_s^2/(2 sigma_0), which they give back when slip reverses.
    """
    run = request.getfixturevalue(case)
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-6 * float(run["kinetic_energy"].max())
    assert float(np.max(run["dissipated_energy"])) > 1e-4 * float(run["kinetic_energy"].max())
    loss = run["friction_loss"].values
    held = float(run["normal_force"].max()) * 0.15**2 / (2.0 * 1e5)
    assert np.max(np.maximum.accumulate(loss) - loss) <= held
    assert case == "clearance_run" or loss[-1] > 100.0 * held


@pytest.mark.parametrize("case", ["clearance_run", "frictional_run"])
def test_constraints_hold(case, request):
    """Identity: bars keep their length within 1e-10 of it, at every sample."""
    assert request.getfixturevalue(case).attrs["length_error"] < 1e-10


@pytest.mark.parametrize("case", ["clearance_run", "frictional_run"])
def test_torque_two_ways(case, request):
    """Cross-check: the slider's Newton equation against the contact force; the journal's force feeds every reaction."""
    run = request.getfixturevalue(case)
    force = run["reaction"].sel(joint="A", axis="y")
    inertia = 5.0 * (run["slider_acceleration"] + 9.81)
    assert np.allclose(-force, inertia, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(inertia))))


def test_reactions_balance_the_whole_array(frictional_run):
    """Identity: ground pin and guide carry the rate of total momentum plus the weight, to 1e-9."""
    masses = xr.DataArray([5.68] * 4 + [5.0], coords={"body": frictional_run["body"]}, dims="body")
    rate = (masses * frictional_run["acceleration"]).sum("body")
    pull = frictional_run["reaction"].sel(joint="O") + frictional_run["reaction"].sel(joint="guide")
    needed = rate + xr.DataArray([0.0, 9.81 * float(masses.sum())], dims="axis", coords={"axis": ["x", "y"]})
    assert np.allclose(pull, needed, atol=1e-9 * float(np.max(np.abs(needed))))


def test_sampling_changes_nothing(clearance_array, clearance_run):
    """Identity: events and common samples are bit for bit the same for another output grid."""
    other = sd.simulate(clearance_array, until=0.05, samples=101)
    for name in ("contact_start", "approach_speed", "peak_force", "peak_time", "rebound_speed"):
        assert same_bits(other[name].values, clearance_run[name].values)
    assert other.attrs["end"] == clearance_run.attrs["end"]
    assert np.array_equal(other["slider_position"][[0, -1]], clearance_run["slider_position"][[0, -1]])


def test_small_clearance_tends_to_ideal(array):
    """Limit: slider and coupler stray from the ideal mechanism by no more than the clearance allows, and with it to nothing.

    The slider hangs on the journal within c + delta; at constant drive speed the coupler's end strays as far.
    """
    ideal = sd.simulate(array, until=0.02, samples=201)
    strays = []
    for clearance in (4e-4, 1e-4, 2.5e-5):
        run = sd.simulate(array.with_clearance("A", sd.Clearance(clearance)), until=0.02, samples=201)
        deepest = float(np.nanmax(run["indentation"].sel(joint="A")))
        stray = float(np.max(np.abs(run["slider_position"] - ideal["slider_position"])))
        assert stray < 3.0 * (clearance + max(deepest, 0.0))
        strays.append(stray)
    assert strays[0] > strays[1] > strays[2]


@pytest.mark.parametrize(("kinetic", "until", "tolerance", "contacts"), [(None, 0.012, 1e-11, 5), (0.01, 0.0045, 1e-10, 2)])
def test_stiff_and_explicit_agree(array, kinetic, until, tolerance, contacts):
    """Cross-check: methods of two families give the same first contacts; with LuGre friction the stiff one in fewer steps."""
    friction = sd.NoFriction() if kinetic is None else sd.LuGre(kinetic)
    arm = array.with_clearance("A", sd.Clearance(0.5e-3, friction=friction))
    tight = {"until": until, "samples": 11, "rtol": tolerance, "atol": tolerance}
    explicit, stiff = (sd.simulate(arm, method=method, **tight) for method in ("dop853", "rodas5p"))
    for name in ("contact_start", "approach_speed", "peak_force", "contact_duration"):
        assert np.allclose(explicit[name][:contacts], stiff[name][:contacts], rtol=1e-6)
    steps = [counts_of(run)["steps"] for run in (explicit, stiff)]
    assert kinetic is None or steps[0] > 2 * steps[1]


def test_round_trip_and_replay(frictional_array, tmp_path):
    """Identity: a saved run loads without loss, and its attributes run again to the same numbers bit for bit."""
    run = sd.simulate(frictional_array, until=0.01, samples=201, trust=True)
    loaded = sd.load(sd.save(run, tmp_path / "run.nc"))
    xr.testing.assert_identical(loaded, run)
    again = sd.replay(loaded)
    for name in run.variables:
        assert same_bits(again[name].values, run[name].values), name
    assert again.attrs["trusted_until"] == run.attrs["trusted_until"]


def test_start_in_contact_stays_in_contact(array):
    """Published number: started on the line of the ideal reaction, the compliant contact does not separate in 50 ms."""
    run = sd.simulate(array.with_clearance("A", sd.Clearance(0.5e-3)), until=0.05, start="in-contact")
    assert bool(np.all(run["in_contact"].sel(joint="A")))
    assert run.sizes["contact"] == 1
    first = run.isel(time=0)
    ideal = sd.simulate(array, until=0.01, samples=2).isel(time=0)
    normal = -first["eccentricity"].sel(joint="A") / np.hypot(*first["eccentricity"].sel(joint="A").values)
    pull = ideal["reaction"].sel(joint="A")
    assert np.allclose(normal, pull / np.hypot(*pull.values), atol=1e-6)


def test_interrupt_keeps_what_was_computed(clearance_array):
    """Identity: Ctrl-C gives an incomplete run that equals the beginning of the whole one."""

    def stop(time):
        if time > 0.1:
            raise KeyboardInterrupt

    run = sd.simulate(clearance_array, until=10.0, samples=20001, progress=stop)
    assert run.attrs["status"] == "interrupted"
    assert 0.1 < float(run["time"][-1]) <= run.attrs["end"] < 10.0
    assert np.all(np.isfinite(run["slider_position"]))


def test_interrupted_repetition_keeps_the_run(clearance_array):
    """Contract: Ctrl-C while the run is repeated for its horizon returns the whole run, marked, with no horizon."""
    times = [0.0]

    def stop(time):
        times.append(time)
        if time < times[-2]:
            raise KeyboardInterrupt

    run = sd.simulate(clearance_array, until=0.02, samples=51, trust=True, progress=stop)
    assert run.attrs["status"] == "interrupted"
    assert "while the run was repeated" in run.attrs["cause"]
    assert run.sizes["time"] == 51
    assert "trusted_until" not in run.attrs
    assert run.attrs["predictability"].startswith("unknown")


def test_unfinished_run_says_why(clearance_array):
    """Contract: a failed run returns its samples and one line with time, cause and joint."""
    run = sd.simulate(clearance_array, until=0.05, most_steps=100)
    assert run.attrs["status"] == "failed"
    assert "100 steps" in run.attrs["cause"]
    assert "\n" not in run.attrs["cause"]
    assert run.sizes["time"] > 1


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p", "rodas4p"])
@pytest.mark.parametrize("tolerance", [1e-4, 3e-5, 1e-5, 3e-6])
@pytest.mark.parametrize("kinetic", [0.0, 0.01, 0.1])
def test_large_tolerances_end_well(array, method, tolerance, kinetic):
    """Contract: steps that run away after an impact are rejected, whatever method and tolerance; the run completes."""
    friction = sd.LuGre(kinetic) if kinetic else sd.NoFriction()
    arm = array.with_clearance("A", sd.Clearance(0.5e-3, friction=friction))
    run = sd.simulate(arm, until=0.03, method=method, rtol=tolerance, atol=tolerance, samples=11)
    assert run.attrs["status"] == "complete"
    assert float(run["contact_start"][0]) == pytest.approx(0.001365125913, rel=30 * tolerance)


def test_light_bodies_at_rest_in_contact():
    """Limit: a standing chain of ten 1 g bars rests in a joint of 2 um clearance in some steps, not in tens of thousands.

    Positions of 12 m round by 3e-15 m, which a stiff contact turns into 1e-12 m/s, ten times the weight of a velocity.
    """
    bars = [sd.bar(f"bar {k}", length=1.2, mass=1e-3, angle=1.573) for k in range(10)]
    last = sd.Clearance(1.8e-6, journal_radius=15e-3, bearing_length=2e-3, friction=sd.LuGre(0.1))
    standing = chain(*bars, pins="ABCDEFGHIJ", gravity=9.81).with_clearance("J", last)
    run = sd.simulate(standing, until=0.022, samples=11, start="in-contact", most_steps=1000)
    assert run.attrs["status"] == "complete"
    assert counts_of(run)["steps"] < 200
