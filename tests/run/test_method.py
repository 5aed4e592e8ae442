"""Automatic choice of the integrator, and runs without energies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.build import counts_of, in_bearing, on_pin

import scissordyn as sd
from scissordyn.plan.plan import plan
from scissordyn.run import method
from scissordyn.run.advance import tolerance as tolerance_module
from scissordyn.run.advance.tolerance import error_weights
from scissordyn.run.method import STABILITY_LIMIT, fastest_modes, film_steps, jacobian, projected_jacobian, undamped_eigenvalues
from scissordyn.run.trajectory import compute, make_driver

# Bending stiffness [N m^2] and axial stiffness [N] of a steel tube
TUBE = {"bending_stiffness": 42743.0, "axial_stiffness": 7.5e7}
FRICTIONLESS = sd.NoFriction()  # Friction law without friction


def _array(*, modes=0, friction=FRICTIONLESS):
    """Return the paper's array with a friction law, with bending bars if modes are given."""
    made = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, friction=friction))
    return (sd.with_bending(made, **TUBE, modes=modes) if modes else made).driven(speed=sd.rpm(150))


def assert_chosen(mechanism, method, options):
    """Check the chosen method, and that the choice leaves the start of the run unchanged."""
    driver, _, choice = make_driver(plan(mechanism), options)
    asked, _, _ = make_driver(plan(mechanism), replace(options, method=method))
    assert choice.method == driver.method == method
    for found, expected in zip(driver.system.content.state, asked.system.content.state, strict=True):
        assert np.array_equal(found, expected, equal_nan=True)
    assert np.array_equal(driver.system.content.parameters.component, asked.system.content.parameters.component)
    assert np.array_equal(driver.state.y, asked.state.y)


@pytest.mark.parametrize(
    ("bent", "start", "method"),
    [
        (True, "concentric", "dop853"),
        (True, "in-contact", "dop853"),
        (True, "as-placed", "dop853"),
        (True, "static", "rodas5p"),
        (False, "in-contact", "rodas5p"),
    ],
)
def test_integrator_of_a_start(bent, start, method):
    """Contract: explicit steps if contacts that are closed at the start open at once, as those of bending bars may."""
    assert_chosen(_array(modes=2 if bent else 0), method, sd.Options(1e-3, start=start))


def _clamped(**how):
    """Return a heavy bar of 0.5 m, clamped by its drive, that bends by modes or by elements."""
    bar = sd.bar("bar", length=0.5, mass=0.2)
    return sd.with_bending(on_pin(bar, gravity=9.81), bending_stiffness=1.2e3, axial_stiffness=2e7, **how).driven(speed=0.0)


def _on_a_spring():
    """Return a lever whose weight a spring of 60 kHz holds."""
    spring = sd.TorsionSpring("spring", "bar", "ground", stiffness=1e11, free_angle=0.0)
    return on_pin(sd.bar("bar", length=1.0, mass=2.0), spring, gravity=9.81)


# Mechanisms that only vibrate about equilibrium
RESTING = [_clamped(modes=3), _clamped(modes=24), _clamped(elements=8), _on_a_spring()]


@pytest.mark.parametrize("mechanism", RESTING, ids=["3 modes", "24 modes", "8 elements", "spring"])
def test_what_rests_takes_few_steps(mechanism):
    """Limit: from static equilibrium nothing moves, whatever vibrations are possible; explicit steps have to resolve them."""
    assert_chosen(mechanism, "rodas5p", sd.Options(0.1, start="static"))
    chosen = sd.simulate(mechanism, until=0.1, samples=3, start="static")
    explicit = sd.simulate(mechanism, until=5e-3, samples=3, start="static", method="dop853")
    assert counts_of(chosen)["steps"] < 10
    assert counts_of(explicit)["steps"] > 100
    np.testing.assert_allclose(chosen["position"].values - chosen["position"].values[0], 0.0, atol=1e-9)


@pytest.mark.parametrize("mechanism", RESTING, ids=["3 modes", "24 modes", "8 elements", "spring"])
def test_what_vibrates_takes_explicit_steps(mechanism):
    """Contract: vibrations that move something are resolved, which explicit steps do at less cost."""
    assert_chosen(mechanism, "dop853", sd.Options(0.1, start="concentric"))


def test_a_slow_motion_steps_across_vibrations_at_rest():
    """Cross-check: an array of tubes that starts without a jerk moves as with explicit steps, in a tenth of the steps."""
    array = sd.with_bending(sd.scissor(units=2), **TUBE).driven(motion=sd.Cycloidal(0.0, 0.5, 2.0))
    chosen, explicit = (
        sd.simulate(array, until=0.1, samples=11, start="static", method=method) for method in ("auto", "dop853")
    )
    assert counts_of(chosen)["method"] == "rodas5p"
    assert 10 * counts_of(chosen)["steps"] < counts_of(explicit)["steps"]
    np.testing.assert_allclose(chosen["position"].values, explicit["position"].values, atol=1e-8)


@pytest.mark.parametrize(("modes", "method"), [(2, "rodas5p"), (24, "dop853")])
def test_integrator_of_bristles_and_modes(modes, method):
    """Contract: explicit steps for friction with states where implicit ones need large matrices."""
    bent = _array(modes=modes, friction=sd.LuGre(kinetic=0.1))
    assert make_driver(plan(bent), sd.Options(1e-3))[2].method == method


@pytest.mark.parametrize(
    ("friction", "reason"),
    [(sd.law("friction", "coulomb")(0.1), "is steep about zero slip speed"), (sd.LuGre(kinetic=0.1), "has internal states")],
)
def test_reason_for_implicit_steps_with_friction(friction, reason):
    """Contract: the reason names the states of the friction law, or its ramp if it has none."""
    chosen = make_driver(plan(_array(friction=friction)), sd.Options(1e-3))[2]
    assert chosen.method == "rodas5p"
    assert f"the friction law of joint 'A' {reason}" in chosen.reason


@pytest.mark.parametrize(("start", "until"), [("in-contact", 2e-3), ("static", 2e-2)])
def test_explicit_steps_are_cheaper_from_contact(start, until):
    """Cross-check: both integrators find the same motion of bars from contact; the chosen one needs no Jacobians."""
    runs = {method: sd.simulate(_array(modes=2), until=until, start=start, method=method) for method in ("auto", "rodas5p")}
    chosen, stiff = (counts_of(run) for run in runs.values())
    assert chosen["jacobians"] == 0
    assert chosen["steps"] < 5 * stiff["steps"]  # which cost ten times as much
    apart = np.abs(runs["auto"]["position"].values - runs["rodas5p"]["position"].values)
    assert float(np.max(apart)) < 1e-3 * 0.5e-3


@pytest.mark.parametrize(
    ("clearance", "viscosity", "bearing", "method"),
    [
        (2e-4, 0.01, "finite", "dop853"),
        (2e-4, 0.1, "finite", "rodas5p"),
        (2e-4, 0.01, "long", "dop853"),
        (2e-4, 0.1, "long", "rodas5p"),
        (5e-4, 0.05, "short", "rodas5p"),
        (1e-3, 1e-4, "short", "dop853"),
        (1e-3, 0.1, "finite", "dop853"),
    ],
)
def test_integrator_of_a_film(clearance, viscosity, bearing, method):
    """Contract: the method depends on the stiffness of the film before metal touches; the choice changes nothing."""
    oil = sd.Lubrication(viscosity=viscosity, bearing=bearing)
    gap = sd.Clearance(clearance, friction=FRICTIONLESS, lubrication=oil)
    assert_chosen(sd.scissor(units=2).with_clearance("A", gap).driven(speed=sd.rpm(150)), method, sd.Options(1e-3))


def test_steps_through_a_film():
    """Second formulation: a mass pressed through a long bearing's film; the number of stable steps as an integral over time."""
    mass, clearance, roughness = 140.0, 4e-5, 4e-7
    oil = sd.Lubrication(viscosity=5e-4, bearing="long", roughness=roughness, asperities=0.0)
    gap = sd.Clearance(clearance, journal_radius=0.02, bearing_length=0.04, friction=FRICTIONLESS, lubrication=oil)
    joint = sd.Revolute("bearing", ("shaft", "centre"), ("ground", "O"), clearance=gap)
    shaft = sd.Body("shaft", mass, 1.0, {"centre": (0.0, 0.0)})
    pressed = sd.Mechanism((shaft,), joints=(joint,), ground=(("O", (0.0, 0.0)),), gravity=9.81)
    driver, prepared, _ = make_driver(plan(pressed), sd.Options(1e-3))
    tolerances = error_weights(driver.plan, driver.system, prepared.y, rtol=1e-8, atol=1e-8)
    tolerances = replace(tolerances, time_scale=math.sqrt(clearance / 9.81))
    found = film_steps(driver.plan, driver.system, prepared.y, tolerances)

    run = sd.simulate(pressed, until=0.05, samples=20001)
    speed, force = (
        run["film_squeeze_speed"].values[:, 0],
        (run["film_force"][:, 0, 1] - run["film_asperity_force"][:, 0]).values,
    )
    moving = (speed > 0.0) & (run["film_thickness"].values[:, 0] > 0.0)
    decay = np.where(moving, force / np.where(moving, speed, 1.0) / mass, 0.0)
    expected = float(np.trapezoid(decay, run["time"].values)) / STABILITY_LIMIT
    assert 0.5 * expected < found < 2.0 * expected


@pytest.mark.parametrize("modes", [4, 16])
def test_fastest_modes_of_many_states(modes, monkeypatch):
    """Cross-check: products with the Jacobian give the fastest modes of all its eigenvalues."""
    bent = sd.with_bending(
        sd.scissor(units=2).with_clearance("all", sd.Clearance(1e-4, friction=FRICTIONLESS)), **TUBE, modes=modes
    )
    servo = bent.controlled(sd.PID(2e4, derivative=3500.0), speed=sd.rpm(2))
    options = sd.Options(1e-3)
    found = {}
    for most in (10**6, 0):
        monkeypatch.setattr(method, "DENSE_STATES_MAX", most)
        driver, prepared, choice = make_driver(plan(servo), options)
        assert choice.method == "rodas5p"
        found[most] = fastest_modes(driver.plan, driver.system, prepared.y)
    assert found[0][0] == pytest.approx(found[10**6][0], rel=1e-5)
    assert found[0][1] == pytest.approx(found[10**6][1], rel=0.05)


@pytest.mark.parametrize("damping", [0.0, 1e-6])
def test_eigenvalues_without_damping_have_half_as_many_squares(damping):
    """Cross-check: roots of half as many eigenvalues are those of the whole Jacobian; damped bars have no such roots."""
    bent = sd.with_bending(sd.scissor(units=2), **TUBE, modes=4, damping=damping).driven(speed=sd.rpm(150))
    driver, prepared, _ = make_driver(plan(bent), sd.Options(1e-3))
    matrix = jacobian(driver.system, prepared.y)
    found, expected = undamped_eigenvalues(matrix), np.linalg.eigvals(matrix)
    assert (found is None) == (damping > 0.0)
    if found is not None:
        assert np.sort(np.abs(found)) == pytest.approx(np.sort(np.abs(expected)), rel=1e-6, abs=1e-3)
        assert np.max(np.abs(found.real)) == pytest.approx(np.max(np.abs(expected.real)), rel=1e-3, abs=1e-6)


def test_stiff_steps_do_not_resolve_axial_waves(monkeypatch):
    """Limit: contacts agree with a run at 1e-11, with 60 % of the steps of equal error weights."""
    bent = sd.with_bending(sd.scissor(units=2).with_clearance("A", sd.Clearance(1e-4, friction=FRICTIONLESS)), **TUBE, modes=4)
    servo = bent.controlled(sd.PID(2e4, derivative=3500.0), speed=sd.rpm(50))
    steps, starts, peaks = [], [], []
    for vibrations, tolerance in ((tolerance_module.BENDING_FACTOR, 1e-8), (1.0, 1e-8), (1.0, 1e-11)):
        monkeypatch.setattr(tolerance_module, "BENDING_FACTOR", vibrations)
        run = sd.simulate(servo, until=4e-3, samples=11, rtol=tolerance, atol=tolerance)
        statistics = counts_of(run)
        assert statistics["method"] == "rodas5p"
        steps.append(statistics["steps"])
        starts.append(run["contact_start"].values)
        peaks.append(run["peak_force"].values)
    assert steps[0] < 0.6 * steps[1]
    assert peaks[0].size == peaks[2].size > 0
    assert starts[0] == pytest.approx(starts[2], abs=5e-8)
    assert peaks[0] == pytest.approx(peaks[2], rel=1e-3)


def arrays():
    """Return the paper's array with friction, falling under delayed feedback, and with clearance everywhere."""
    arm = sd.scissor(units=2)
    friction = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.1))
    driven = arm.driven(speed=sd.rpm(150))
    falling = arm.replace("gravity", 9.81).with_clearance("A", sd.Clearance(1e-4))
    fed_back = falling.controlled(sd.Pyragas(50.0, 0.002, onset=0.0))
    return {
        "friction": driven.with_clearance("A", friction),
        "delay": fed_back,
        "everywhere": driven.with_clearance("all", sd.Clearance(0.5e-3)),
    }


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p", "rodas4p"])
@pytest.mark.parametrize("name", ["friction", "delay", "everywhere"])
def test_motion_without_energies(name, method):
    """Identity: without energies samples, steps and contact instants are the same bit for bit, with fewer evaluations."""
    options = sd.Options(0.02, samples=101, method=method, rtol=1e-6, atol=1e-6)
    whole, motion = (compute(plan(arrays()[name]), options, monitor=on, record_steps=True) for on in (True, False))
    assert whole.status == "complete"
    assert whole.log.size > 1
    for part in ("time", "state", "mode", "memory", "mass", "reference"):
        np.testing.assert_array_equal(getattr(motion.samples, part), getattr(whole.samples, part), err_msg=part)
    for mine, other in zip(motion.steps, whole.steps, strict=True):
        np.testing.assert_array_equal(mine, other)
    for name in ("time", "guard", "mode", "rate", "angle"):
        np.testing.assert_array_equal(motion.log[name], whole.log[name])
    assert motion.statistics["steps"] == whole.statistics["steps"]
    assert motion.statistics["rates"] < whole.statistics["rates"]
    assert np.any(whole.samples.total)
    assert not np.any(motion.samples.total)
    assert not any(np.any(motion.peak[name]) for name in ("largest", "integral", "square", "friction_loss"))


@pytest.mark.parametrize("speed", [0.443156478236942, 0.444, 0.44495])
def test_no_step_passes_over_a_contact(speed):
    """Cross-check: a step that begins at a contact is not longer than the contact, although it was long in free flight."""
    ball = sd.Body("ball", mass=1.0, inertia=1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(0.0, speed))
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=sd.Clearance(0.01, journal_radius=0.02))
    thrown = sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=9.81)
    stiff, explicit = (
        sd.simulate(thrown, until=0.15, start="as-placed", method=method, rtol=1e-8, atol=1e-8)
        for method in ("rodas5p", "dop853")
    )
    assert stiff.attrs["status"] == "complete"
    np.testing.assert_allclose(stiff["contact_start"], explicit["contact_start"], atol=1e-9)
    np.testing.assert_allclose(stiff["peak_force"], explicit["peak_force"], rtol=1e-5)


def test_step_of_a_free_rotation():
    """Closed form: a body that rotates beside a hard contact gains a millionth of its energy in a run, by its longest step."""
    speed, until = 200.0, 1.0
    rotor = sd.Body("rotor", 1.0, 0.01, {"o": (0.0, 0.0), "a": (0.1, 0.0)}, angular_velocity=speed)
    ball = in_bearing(sd.Clearance(1.0, journal_radius=1.1, contact="hard"))
    run = sd.simulate(
        replace(ball, bodies=(*ball.bodies, rotor), gravity=0.0), until=until, start="as-placed", samples=3, trust=False
    )
    step = counts_of(run)["step"]
    assert "fastest rotation" in counts_of(run)["reason"]
    assert 0.75 * (speed * step) ** 4 * until / step == pytest.approx(1e-6, rel=1e-9)
    gained = float(run["kinetic_energy"][-1] / run["kinetic_energy"][0]) - 1.0
    assert gained == pytest.approx(1e-6, rel=0.05)


@pytest.mark.parametrize("products", [2, 60])
def test_modes_of_few_states(products):
    """Identity: there are as many products as states at most, and then all eigenvalues."""
    driver, prepared, _ = make_driver(plan(_array()), sd.Options(1e-3))
    small, whole = projected_jacobian(driver.system, prepared.y, products), jacobian(driver.system, prepared.y)
    assert small.shape == (min(products, prepared.y.size),) * 2
    if products > prepared.y.size:
        # round-off in the real parts of pairs would change their order
        rates = [np.sort_complex(np.round(np.linalg.eigvals(matrix), 4)) for matrix in (small, whole)]
        np.testing.assert_allclose(*rates, atol=1e-5 * np.abs(rates[1]).max())
