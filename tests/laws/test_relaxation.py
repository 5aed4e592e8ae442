"""Surfaces that relax: linear elements in closed form, and runs compared with the equation of one mass."""

import math

import numpy as np
import pytest
from bouncing import JOINT, at, row
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from tests.build import in_bearing

import scissordyn as sd
from scissordyn.laws.damping.standard_linear_solid import StandardLinearSolid
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.evaluate import elastic_force, normal_force, settled_states
from scissordyn.laws.experiment import impact

STIFFNESS, MASS = 2e5, 3.0  # Stiffness [N/m] and mass [kg] of a contact that relaxes


def forces_of(law, elastic, time):
    """Return the normal force for a history of elastic forces; the state follows by the trapezoidal rule."""
    z, dz, force, values = np.zeros(1), np.zeros(1), np.zeros(len(time)), row(law)
    decay = 0.5 * np.diff(time) / law.relaxation_time
    for k in range(len(time)):
        if k:
            z[0] = ((1.0 - decay[k - 1]) * z[0] + decay[k - 1] * (elastic[k] + elastic[k - 1])) / (1.0 + decay[k - 1])
        force[k] = normal_force(at(law), elastic[k], 1e-5, 0.0, 0.5, z, dz, values)
    return force


def test_relaxation_after_a_sudden_indentation():
    """Closed form: F_el (1 + r e^(-t/tau)) after a sudden indentation, and F_el in the settled state."""
    law, time = StandardLinearSolid(1.5, 2e-3), np.linspace(0.0, 0.01, 20001)
    force = forces_of(law, np.full(time.size, 100.0), time)
    force[0] = 250.0  # the rule has half of the first interval there
    np.testing.assert_allclose(force, 100.0 * (1.0 + 1.5 * np.exp(-time / 2e-3)), rtol=1e-3)
    z, dz = np.zeros(1), np.ones(1)
    settled_states(at(law, "settled"), 100.0, 1e-5, z, row(law))
    assert normal_force(at(law), 100.0, 1e-5, 0.3, 0.5, z, dz, row(law)) == 100.0
    assert dz[0] == 0.0


@pytest.mark.parametrize("frequency", [10.0, 80.0, 600.0])
def test_energy_of_a_cycle(frequency):
    """Closed form: a cycle of a linear spring about an indentation dissipates pi a^2 k r w tau/(1 + w^2 tau^2)."""
    law, omega, amplitude = StandardLinearSolid(0.8, 2e-3), 2.0 * math.pi * frequency, 1e-4
    cycles = 3 + math.ceil(40.0 * law.relaxation_time * frequency)
    time = np.linspace(0.0, cycles / frequency, 4000 * cycles + 1)
    depth = 3e-4 + amplitude * np.sin(omega * time)
    force = forces_of(law, STIFFNESS * depth, time)[-4001:]
    work = np.trapezoid(force, depth[-4001:])
    lag = omega * law.relaxation_time
    assert work == pytest.approx(math.pi * amplitude**2 * STIFFNESS * 0.8 * lag / (1.0 + lag**2), rel=1e-3)


@pytest.mark.parametrize("time", [1e-4, 3e-3, 0.1])
def test_impact_on_a_linear_solid(time):
    """Closed form: the matrix exponential of mass, spring and relaxing spring, until the force would pull."""
    law = StandardLinearSolid(1.5, time)
    bounced = impact(Linear(STIFFNESS), law, JOINT, mass=MASS, speed=0.4)
    stiff, lag = STIFFNESS * 2.5, STIFFNESS * 1.5
    motion = np.array([[0.0, 1.0, 0.0], [-stiff / MASS, 0.0, lag / MASS], [1.0 / time, 0.0, -1.0 / time]])
    states = np.array([expm(motion * t) @ [0.0, 0.4, 0.0] for t in bounced.time])
    force = stiff * states[:, 0] - lag * states[:, 2]
    pushing = slice(1, int(np.argmax(force[1:] < 0.0)) or None)
    np.testing.assert_allclose(bounced.force[pushing], force[pushing], atol=1e-6 * force.max())
    assert bounced.restitution < 1.0


@pytest.mark.parametrize(("ratio", "time", "stiffness"), [(0.0, 1e-3, 1.0), (1.5, 1e6, 2.5), (1.5, 1e-9, 1.0)])
def test_limits_are_springs(ratio, time, stiffness):
    """Limit: no relaxing part, an infinite and a zero relaxation time each give an elastic impact of pi sqrt(m/k)."""
    bounced = impact(Linear(STIFFNESS), StandardLinearSolid(ratio, time), JOINT, mass=MASS, speed=0.4)
    assert bounced.restitution == pytest.approx(1.0, rel=2e-6)
    assert bounced.time[-1] == pytest.approx(math.pi * math.sqrt(MASS / (stiffness * STIFFNESS)), rel=2e-6)


def rotor(gap):
    """Return a mass whose pin has clearance in a bearing at the origin."""
    body = sd.Body("rotor", mass=MASS, inertia=0.01, points={"c": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("A", ("rotor", "c"), ("ground", "O"), clearance=gap)
    return sd.Mechanism((body,), (pin,), ground=(("O", (0.0, 0.0)),))


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_mass_that_falls_into_its_bearing(method):
    """Second formulation: m y'' = m g - F_n with its own state z over several contacts, by scipy's DOP853."""
    gap = sd.Clearance(2e-4, damping=StandardLinearSolid(1.5, 5e-4))
    run = sd.simulate(rotor(gap), until=0.05, samples=501, rtol=1e-10, atol=1e-10, method=method)
    stiffness, surfaces = gap.stiffness, gap.surfaces
    values = row(stiffness, surfaces)

    def motion(_, y):
        depth = y[0] - 2e-4
        elastic = elastic_force(at(stiffness), depth, values) if depth > 0.0 else 0.0
        lag = elastic - y[2] if depth > 0.0 else 0.0
        return [y[1], 9.81 - max(elastic + 1.5 * lag, 0.0) / MASS, lag / 5e-4]

    def touch(_, y):
        return y[0] - 2e-4

    touch.terminal = True
    time, state, expected = 0.0, np.zeros(3), np.full(run.sizes["time"], np.nan)
    while time < 0.05:
        touch.direction = -1.0 if abs(touch(0.0, state)) < 1e-12 and state[1] > 0.0 else 1.0
        part = solve_ivp(motion, (time, 0.05), state, method="DOP853", rtol=1e-11, atol=1e-13, events=touch, dense_output=True)
        inside = (run["time"].values >= time) & (run["time"].values <= part.t[-1])
        expected[inside] = part.sol(run["time"].values[inside])[0]
        time, state = part.t[-1], np.array([2e-4, part.y[1, -1], 0.0])
    fallen = -run["eccentricity"].sel(joint="A", axis="y").values
    assert run.sizes["contact"] > 3
    np.testing.assert_allclose(fallen, expected, atol=1e-9)
    residual = abs(run["energy_residual"]).max() / abs(run["dissipated_energy"]).max()
    assert float(residual) < 1e-6


def test_static_start_rests_on_the_elastic_law():
    """Closed form: the weight is carried by the elastic law alone, and the mass stays at rest."""
    gap = sd.Clearance(2e-4, damping=StandardLinearSolid(1.5, 5e-4), friction=sd.LuGre(0.1))
    run = sd.simulate(rotor(gap), until=0.01, samples=11, start="static")
    depth = -run["eccentricity"].sel(joint="A", axis="y").values - 2e-4
    elastic = elastic_force(at(gap.stiffness), depth[0], row(gap.stiffness, gap.surfaces))
    assert elastic == pytest.approx(MASS * 9.81, rel=1e-9)
    np.testing.assert_allclose(depth, depth[0], rtol=1e-8)
    np.testing.assert_allclose(run["relaxed_force"].sel(joint="A"), MASS * 9.81, rtol=1e-8)
    assert {"bristle_deflection", "relaxed_force"} <= set(run)


def test_modes_with_relaxation():
    """Closed form: relaxing contacts vibrate with the stiffness of a sudden change, sqrt(1 + r) times faster."""
    laws = sd.law("damping", "none")(), StandardLinearSolid(1.5, 5e-4)
    elastic, relaxing = (sd.modes(rotor(sd.Clearance(2e-4, damping=law)), count=3, joints="contact") for law in laws)
    np.testing.assert_allclose(relaxing["contact_force"], elastic["contact_force"], rtol=1e-9)
    np.testing.assert_allclose(relaxing["contact_stiffness"], 2.5 * elastic["contact_stiffness"], rtol=1e-6)
    factor = np.array([0.0, 1.0, math.sqrt(2.5)])  # it turns freely
    np.testing.assert_allclose(relaxing["frequency"], factor * elastic["frequency"], rtol=1e-6, atol=1e-3)


def test_relaxation_next_to_a_hard_contact_is_refused():
    """Contract: time stepping has no states of normal forces, and the error says so."""
    arm = sd.scissor(units=1).driven(speed=1.0).with_clearance("A", sd.Clearance(2e-4, contact="hard"))
    with pytest.raises(
        sd.InputError, match=r"'standard-linear-solid' of 'O' has states, but a contact is hard; .*without states"
    ):
        sd.simulate(arm.with_clearance("O", sd.Clearance(2e-4, damping=StandardLinearSolid())), until=1e-3)


def test_stored_energy_of_relaxation_is_no_gain():
    """The branch that relaxes is a spring too: losses fall while it returns its energy, which is no reason for a warning."""
    law = StandardLinearSolid(1.0, 1e-3)
    run = sd.simulate(in_bearing(sd.Clearance(1e-3, damping=law), position=(0.0, -1e-3)), until=2e-3, start="as-placed")
    loss = run["damping_loss"].values
    assert np.max(np.maximum.accumulate(loss) - loss) > 0.5 * loss[-1]
    assert "gives energy" not in run.attrs["warnings"]
