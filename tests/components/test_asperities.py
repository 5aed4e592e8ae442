"""Asperities beside the film of a rough joint: statistical integrals, an independent average flow program, runs."""

import math

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.integrate import dblquad, quad
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve
from scipy.special import ndtr
from tests.build import array, warnings_of

import scissordyn as sd
from reference.kernels import at_start, check_step_matrix, increments
from scissordyn.components.film.asperities import ASPERITY_STIFFNESS, asperity_contact, mean_gap
from scissordyn.components.film.film import FIRST_TABLE_VALUE, Film, force
from scissordyn.laws.material import MATERIALS
from scissordyn.mechanics import functions

from .shared import shaft_in_bearing

contact, gap_of, plain = (getattr(kernel, "py_func", kernel) for kernel in (asperity_contact, mean_gap, force))

ROUGHNESS = 1e-6  # [m] combined rms roughness of journal and bearing
BEARING = ("ground", "O"), ("shaft", "centre")  # Bearing and journal points of an oil film


def density(s):
    return math.exp(-0.5 * s * s) / math.sqrt(2.0 * math.pi)


def excess(power, x):
    """Return F_n(x), the mean of the powers by which normal numbers exceed x."""
    return float(quad(lambda s: (s - x) ** power * density(s), x, max(x, 0.0) + 12.0, epsabs=0.0, epsrel=1e-11, limit=200)[0])


def acting(one, e, rate=(0.0, 0.0), speed=0.0):
    """Return the results of the film kernel for a journal at the eccentricity e along x [m]."""
    numbers = one.parameters((0.0, 0.0, 0.0))
    return np.array(plain(e, 0.0, 0.0, *rate, speed, 0.0, *numbers[:FIRST_TABLE_VALUE], np.array(numbers)))


@pytest.mark.parametrize("x", [0.0, 0.7, 2.0])
def test_the_pressure_by_pairs_of_hertzian_asperities(x):
    """Independent formulation: Hertz' force of two tips with radius beta, over their heights and their sideways distance."""
    modulus, sigma, beta = 1.1e11, 1e-6, 1e-4  # sigma/beta = 0.01
    eta = 0.05 / (beta * sigma)  # [1/m^2]
    far = math.sqrt(4.0 * beta * sigma * 9.0)

    def of_pair(r, s):
        depth = sigma * (s - x) - r * r / (4.0 * beta)
        pushed = 4.0 / 3.0 * modulus * math.sqrt(0.5 * beta) * max(depth, 0.0) ** 1.5
        return pushed * 2.0 * math.pi * r * density(s)

    reach = lambda s: min(far, math.sqrt(max(4.0 * beta * sigma * (s - x), 0.0)))  # noqa: E731
    pressure = eta**2 * dblquad(of_pair, x, x + 8.0, 0.0, reach, epsabs=0.0, epsrel=1e-8)[0]
    assert ASPERITY_STIFFNESS * modulus * excess(2.5, x) == pytest.approx(pressure, rel=1e-6)


@pytest.mark.parametrize(("ratio", "error"), [(1.0 / 400.0, 2e-7), (1e-2, 2e-6), (0.1, 1.6e-4)])
@pytest.mark.parametrize("x", [0.0, 1.0, 3.0])
def test_force_and_energy_by_quadrature_over_the_arc(ratio, error, x):
    """Independent formulation: pressure and stored energy per area over the whole arc; error about (sigma/e)^2/70."""
    e = 1.0 - x * ratio
    end = min(math.pi, math.acos(max(-1.0, (1.0 - (x + 12.0) * ratio) / e)))

    def over_arc(power, weight):
        def at(t):
            return excess(power, (1.0 - e * math.cos(t)) / ratio) * weight(t)

        return 2.0 * quad(at, 0.0, end, epsrel=1e-9, limit=200)[0]

    found = contact(e, ratio)
    assert found[0] == pytest.approx(over_arc(2.5, math.cos), rel=error)
    assert found[1] == pytest.approx(over_arc(3.5, lambda t: 2.0 / 7.0 * ratio), rel=5.0 * error)


@pytest.mark.parametrize("e", [0.93, 0.99, 0.9999, 1.05])
def test_the_force_is_the_derivative_of_the_energy(e):
    """Identity: by central differences, in contact too, where the force keeps its value."""
    up, down = contact(e + 1e-6, 0.02), contact(e - 1e-6, 0.02)
    assert (up[1] - down[1]) / 2e-6 == pytest.approx(contact(e, 0.02)[0], rel=2e-5)


@pytest.mark.parametrize("distance", [-3.0, 0.0, 0.3, 1.0, 3.0, 7.9, 9.0])
def test_the_mean_gap_by_quadrature(distance):
    """Independent formulation: the mean of the positive part of a Gaussian gap; sigma/sqrt(2 pi) from contact on."""
    x = max(distance, 0.0)
    wanted = quad(lambda s: (x + s) * density(s), -x, 12.0, epsabs=0.0, epsrel=1e-12, points=[0.0], limit=200)[0]
    assert gap_of(distance, 1.0) == pytest.approx(wanted, rel=1e-10)


class AverageFlow:
    """Patir and Cheng's average flow with flow factors of one, by finite volumes over theta and z, with p >= 0.

    The conductance is the cube of the mean gap at each place, the squeeze the derivative of the mean gap by time.
    """

    def __init__(self, one, e, around, along):
        edge = np.linspace(-1.0, 1.0, around + 1)
        self.edge = math.pi * np.sinh(2.0 * edge) / math.sinh(2.0)  # from the thin side
        self.theta, self.width = 0.5 * (self.edge[1:] + self.edge[:-1]), np.diff(self.edge)
        cut = 0.5 * one.length * np.sin(0.5 * math.pi * np.linspace(0.0, 1.0, along + 1))  # half of the length
        self.z, self.height = 0.5 * (cut[1:] + cut[:-1]), np.diff(cut)
        self.one, self.e = one, e
        self.nominal = one.clearance - e * np.cos(self.theta)
        ring = np.arange(around)
        between = one.clearance - e * np.cos(self.edge[:-1])  # from the cell before to this one
        apart = 0.5 * (self.width + np.roll(self.width, 1))
        flow = self.mean(between) ** 3 / (12.0 * one.viscosity * one.radius * apart)
        sideways = sp.coo_matrix((flow, (ring, np.roll(ring, 1))), (around, around))
        sideways = sideways + sideways.T - sp.diags(flow + np.roll(flow, -1))
        apart_z = np.append(np.diff(self.z), 0.5 * one.length - self.z[-1])
        axial = sp.diags([1.0 / apart_z[:-1]] * 2, [-1, 1], (along, along)) - sp.diags(
            1.0 / apart_z + np.append(0.0, 1.0 / apart_z[:-1])
        )
        conductance = self.mean(self.nominal) ** 3 / (12.0 * one.viscosity) * one.radius * self.width
        self.matrix = sp.csr_matrix(sp.kron(sideways, sp.diags(self.height)) + sp.kron(sp.diags(conductance), axial))

    def mean(self, h):
        x = h / self.one.roughness
        return self.one.roughness * (x * ndtr(x) + np.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi))

    def force(self, rate, speed):
        """Return the force of film and asperities on the journal along the eccentricity and across it [N]."""
        one, t = self.one, self.theta
        # fluid enters with half the speed of the journal's surface, which turns with the bearing at rest
        thinning = -(rate[0] * np.cos(t) + rate[1] * np.sin(t)) + 0.5 * speed * self.e * np.sin(t)
        source = np.outer(ndtr(self.nominal / one.roughness) * thinning * one.radius * self.width, self.height).ravel()
        film, pressure = np.ones(source.size, bool), np.zeros(source.size)
        for _ in range(60):
            inside = np.flatnonzero(film)
            pressure[:] = 0.0
            pressure[inside] = spsolve(self.matrix[inside][:, inside], source[inside], permc_spec="MMD_AT_PLUS_A")
            now = np.where(film, pressure > 0.0, self.matrix @ pressure - source > 1e-12 * np.abs(source).max())
            if np.array_equal(now, film):
                break
            film = now
        over = 2.0 * one.radius * self.width * (np.maximum(pressure, 0.0).reshape(t.size, -1) @ self.height)
        metal = np.array([one.modulus * excess(2.5, x) if x < 8.0 else 0.0 for x in self.nominal / one.roughness])
        over = over + metal * one.radius * self.width * one.length
        return -np.array([over @ np.cos(t), over @ np.sin(t)])


@pytest.mark.parametrize("x", [0.0, 0.5, 1.0, 2.0, 4.0, 20.0])
@pytest.mark.parametrize(("rate", "speed"), [((1e-3, 0.0), 0.0), ((0.05, 0.0), 0.0), ((0.01, 0.02), 40.0), ((0.0, 0.0), 40.0)])
def test_film_and_asperities_against_an_average_flow_program(x, rate, speed):
    """Independent formulation: the mean gap at each place, where the package has a smooth bearing of the same least gap.

    Measured: up to 2.6 % of the force with a squeeze, 7.4 % of the wedge at contact, 0.06 % from four roughnesses on.
    """
    one = Film("film", *BEARING, viscosity=0.1, clearance=4e-4, roughness=ROUGHNESS)
    e = one.clearance - x * ROUGHNESS
    cells = (480, 24) if x >= 4.0 else (240, 12)  # their errors are 0.04 % and 0.3 % of the force
    wanted, found = AverageFlow(one, e, *cells).force(rate, speed), acting(one, e, rate, speed)[:2]
    error = 0.001 if x >= 4.0 else 0.026 if any(rate) else 0.075
    assert np.linalg.norm(found - wanted) < error * np.linalg.norm(wanted)


def loaded(load, **given):
    """Return a shaft that does not turn, in a bearing with 40 um of clearance, with a load as its weight."""
    return shaft_in_bearing(load, sd.Lubrication(viscosity=0.01, bearing="short", **given), friction=sd.NoFriction())


def test_asperities_carry_a_load_at_rest():
    """Closed form: the mean planes stay where F_3 balances the load; E* is that of the joint's materials, K that of the oil."""
    load, stiffness = 3000.0, 2e-3
    softer = {"material": sd.STEEL, "bearing_material": MATERIALS["bronze"]}
    made = loaded(load, asperities=stiffness)
    gap = made.joint("bearing").clearance
    made = made.with_clearance("bearing", sd.Clearance(**{**vars(gap), **softer}))
    run = sd.simulate(made, until=3.0, samples=201)  # six times the time in which the film leaves the gap
    modulus = stiffness / (sd.STEEL.compliance + MATERIALS["bronze"].compliance)

    def carried(h):
        arc = 5.0 * math.pi / 16.0 * math.sqrt(2.0 * ROUGHNESS / (4e-5 - h))
        return modulus * 0.02 * 0.04 * arc * excess(3.0, h / ROUGHNESS)

    wanted = brentq(lambda h: carried(h) - load, 0.0, 4e-6)
    thickness, force = run["film_thickness"].values[:, 0], run["film_asperity_force"].values[:, 0]
    assert wanted > 0.5 * ROUGHNESS
    assert thickness[-1] == pytest.approx(wanted, rel=5e-3)  # the series of the arc ends at 0.3 % here
    loaded_at = np.flatnonzero(force > 0.1 * load)[::20]
    assert force[loaded_at] == pytest.approx([carried(h) for h in thickness[loaded_at]], rel=5e-3)
    assert force[-1] == pytest.approx(load, rel=4e-3)  # the film carries the rest
    assert run["reaction"].values[-1, 0, 1] == pytest.approx(load, rel=1e-6)
    assert run.sizes["contact"] == 0
    assert float(np.abs(run["energy_residual"]).max()) < 1e-5 * load * 4e-5


def rough(roughness, viscosity, clearance=2e-4, friction=None):
    """Return the paper's array with oil and rough surfaces in joint A."""
    oil = sd.Lubrication(viscosity=viscosity, roughness=roughness)
    return array(sd.Clearance(clearance, friction=friction or sd.NoFriction(), lubrication=oil))


@pytest.mark.parametrize("distance", [0.4, 2.0])
@pytest.mark.parametrize("step", [1e-8, 1e-6, 1e-4])
def test_step_matrix_where_asperities_carry(distance, step):
    """Cross-check: W^-1 r of the structured solve against a differenced Jacobian, with the journal in the asperities."""
    system, start = at_start(rough(4e-6, 0.05))
    n, random = system.content.model.n, np.random.default_rng(4)
    moved = np.concatenate([random.normal(size=n), np.zeros(n)])
    start[n : 2 * n] += random.normal(size=n)

    def gap(size):
        """Return the distance of the mean planes in roughnesses after a displacement of `size` [m] in a random direction."""
        functions.rate(0.0, start + size * moved, system.address, np.zeros(start.size))
        return (2e-4 - math.hypot(*system.content.work.coordinates[0, :2])) / 4e-6

    state = start + brentq(lambda size: gap(size) - distance, 0.0, 1e-3) * moved
    check_step_matrix(system, state, step, increments(system, state))


@pytest.mark.parametrize(
    ("roughness", "method"), [(0.5e-6, "rodas5p"), (3e-6, "rodas5p"), (0.5e-6, "dop853"), (3e-6, "dop853")]
)
def test_the_energy_balance_closes_through_contact(roughness, method):
    """Identity: asperities store energy, the film loses it; the journal goes through the film into contact and back."""
    run = sd.simulate(rough(roughness, 0.01), until=0.01, rtol=1e-11, atol=1e-11, method=method)
    assert run.sizes["contact"] > 0
    assert float(run["film_energy"].max()) > 1e-5
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(np.abs(run["drive_work"]).max())


def test_a_largest_force_that_the_roughness_decides_is_said():
    """Limit: with the film's thickness at that instant, located; not for a film that stays thick at its largest force."""
    few, many = (sd.simulate(rough(2e-6, 0.1), until=0.01, samples=samples) for samples in (5, 20001))
    at = int(np.argmin(np.abs(many["time"].values - many["joint_peak_force_time"].values[1])))
    for run in (few, many):
        assert run["film_peak_force_thickness"].item() == pytest.approx(many["film_thickness"].values[at, 0], abs=2e-8)
    share = many["film_asperity_force"].values[at, 0] / many["joint_peak_force"].values[1]
    assert few["film_peak_force_asperity_share"].item() == pytest.approx(share, rel=0.02)

    def said(run):
        return [text for text in warnings_of(run) if "depends on the roughness" in text]

    assert few["film_peak_force_thickness"].item() < 6e-6
    assert f"in a film of {few['film_peak_force_thickness'].item():.3g} m" in said(few)[0]
    thick = sd.simulate(rough(0.2e-6, 0.1), until=0.003, samples=5)
    assert thick["film_peak_force_thickness"].item() > 0.6e-6
    assert not said(thick)
