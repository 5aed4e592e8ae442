"""Journals in worn bearings: the limit of a round bearing, derivatives, momenta, energy, and wear by given loads."""

import dataclasses
import math

import numpy as np
import pytest
from tests.build import momenta

import scissordyn as sd
from reference.kernels import check_step_matrix, check_time_derivative, increments, touching
from scissordyn.laws.catalogue import ELASTIC
from scissordyn.laws.damping.standard_linear_solid import StandardLinearSolid
from scissordyn.laws.evaluate import elastic_force
from scissordyn.laws.foundation import pressure_table
from scissordyn.laws.friction.threlfall import Threlfall
from scissordyn.mechanics import functions
from scissordyn.mechanics.contour import DEPTH, deepest, place_under, press_at, wear_out
from scissordyn.plan.numbers import contour_table
from scissordyn.plugin.element import pointers, row_of


def lobed(count=720, depth=2e-5):
    """Return a contour with three lobes of different depths."""
    angle = 2.0 * np.pi * np.arange(count) / count
    depths = sum(depth * share * np.maximum(0.0, np.cos(angle - at)) ** 6 for share, at in ((1.0, 0.4), (0.6, 2.5), (0.3, 5.0)))
    return tuple(depths.tolist())


def floating(**laws):
    """Return two free bodies that rotate at different speeds and are joined by a worn bearing."""
    inner = sd.Body("inner", 2.0, 4e-3, {"pin": (0.01, -0.02)}, centre=(0.02, 0.01), position=(0.03, 0.02), angle=0.4)
    outer = sd.Body("outer", 5.0, 0.05, {"hole": (0.05, 0.02)}, centre=(0.1, -0.03), position=(-0.01, -0.03), angle=0.3)
    inner = dataclasses.replace(inner, velocity=(0.5, 0.3), angular_velocity=20.0)
    outer = dataclasses.replace(outer, velocity=(0.2, -0.1), angular_velocity=3.0)
    joint = sd.Revolute("joint", ("inner", "pin"), ("outer", "hole"))
    clearance = sd.Clearance(**{"clearance": 5e-4, "contour": lobed(), "friction": Threlfall(0.1)} | laws)
    return sd.Mechanism((inner, outer), joints=(joint,), gravity=0.0).with_clearance("joint", clearance)


def array(joint, **laws):
    """Return a moving array with a worn joint with friction."""
    drive = sd.Harmonic(mean=0.5, amplitude=0.3, angular_frequency=40.0, phase=0.2)
    arm = sd.scissor(units=2, angle=0.5 + 0.3 * np.sin(0.2)).driven(drive)
    return arm.with_clearance(joint, sd.Clearance(**{"clearance": 5e-4, "contour": lobed(), "friction": sd.LuGre(0.1)} | laws))


WORN_JOURNALS = pytest.mark.parametrize("worn", [{}, {"journal_contour": lobed()}, {"contour": (), "journal_contour": lobed()}])


@pytest.mark.parametrize("joint", ["A", "unit 1/pivot"])
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
@WORN_JOURNALS
def test_step_matrix_is_the_derivative(joint, step, worn):
    """Cross-check: W^-1 r from the structured solve equals that of a differenced Jacobian (relative error of differences)."""
    handle, state = touching(array(joint, **worn), 11)
    assert np.all(handle.content.parameters.contact["clearance"] > 0.0)  # otherwise the bearing does not exist
    check_step_matrix(handle, state, step, increments(handle, state))


@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
@WORN_JOURNALS
def test_step_matrix_of_two_moving_bodies(step, worn):
    """Cross-check: the same where the bearing's body turns freely."""
    handle, state = touching(floating(friction=sd.LuGre(0.1), **worn), 5)
    check_step_matrix(handle, state, step, increments(handle, state))


@WORN_JOURNALS
def test_step_matrix_with_states_of_the_normal_force(worn):
    """Cross-check: the same where the surfaces relax."""
    handle, state = touching(array("A", damping=StandardLinearSolid(1.5, 3e-4), **worn), 11)
    assert np.all(handle.content.parameters.contact["clearance"] > 0.0)
    state[-1] = 40.0
    sizes = increments(handle, state)
    sizes[-1] = 1e-3
    check_step_matrix(handle, state, 1e-5, sizes)


def test_time_derivative():
    """Cross-check: the partial derivative by time equals a central difference at fixed state."""
    handle, state = touching(array("A"), 3)
    assert np.any(check_time_derivative(handle, state, 1e-9))


@WORN_JOURNALS
def test_rate_of_the_gap_is_its_derivative(worn):
    """Contract: the guard's rate is the change of the largest indentation along the motion (error of central differences)."""
    handle, state = touching(floating(**worn), 5)
    n = handle.content.model.n
    value, rate = np.zeros(1), np.zeros(1)
    functions.guards(0.0, state, handle.address, value, rate)
    ends, h = [], 1e-8
    for sign in (1.0, -1.0):
        moved, there = state.copy(), np.zeros(1)
        moved[:n] += sign * h * state[n : 2 * n]
        functions.guards(0.0, moved, handle.address, there, np.zeros(1))
        ends.append(there)
    np.testing.assert_allclose(rate, (ends[0] - ends[1]) / (2.0 * h), rtol=1e-6)


@WORN_JOURNALS
def test_a_floating_joint_keeps_momenta_and_energy(worn):
    """Identity: nothing from outside acts; energy goes where damping and friction take it (integration at 1e-9)."""
    mechanism = floating(**worn)
    run = sd.simulate(mechanism, until=0.1, rtol=1e-9, atol=1e-9, trust=False)
    assert run.attrs["status"] == "complete"
    linear, angular = momenta(run, mechanism)
    assert run.sizes["contact"] > 5
    assert np.max(run["friction_loss"].values) > 1e-3 * run["kinetic_energy"].values[0]
    assert np.max(np.abs(linear - linear[0])) < 1e-12 * np.max(np.abs(linear[0]))
    assert np.max(np.abs(angular - angular[0])) < 1e-11
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-7 * run["kinetic_energy"].values[0]


BORE = sd.Clearance(5e-5, journal_radius=10e-3 - 5e-5, bearing_length=15e-3)  # Clearance of a bearing with a radius of 10 mm


def bearing(clearance, count):
    """Return contour, pressures, radial clearance and area of a cell of a round bearing."""
    surfaces = clearance.surfaces
    area = 2.0 * math.pi * surfaces.bearing_radius * surfaces.length / count
    return contour_table([0.0] * count), pressure_table(clearance.stiffness, surfaces), surfaces.clearance, area


def pressed_by(made, x, y):
    """Return force, energy and largest indentation at an eccentricity."""
    out = np.zeros(4)
    press_at(x, y, *made, np.zeros(0), out)
    return out


@pytest.mark.parametrize("name", ELASTIC)
def test_pressures_give_the_law(name):
    """Limit: a round contour has the force of each law; half the cell has a quarter of the error, as linear cells do."""
    clearance = sd.Clearance(2e-4, stiffness=ELASTIC[name]())
    delta, surfaces = 5e-6, clearance.surfaces
    force = elastic_force(pointers(clearance.stiffness)["force"], delta, row_of(clearance.stiffness, surfaces))
    errors = []
    for count in (360, 720, 1440):
        x, y, _, depth = pressed_by(bearing(clearance, count), clearance.clearance + delta, 0.0)
        assert depth == pytest.approx(delta, rel=1e-9)
        assert abs(y) < 1e-9 * x
        errors.append(abs(x / force - 1.0))
    assert errors[2] < 2e-4
    assert errors[0] / errors[1] > 3.0


def test_force_is_the_gradient_of_the_energy():
    """Identity: f = dU/de on a worn contour, also where the contact ends within cells (central differences)."""
    made = (contour_table(lobed()), *bearing(sd.Clearance(5e-4), 720)[1:])
    place, h = np.array([5.4e-4 * math.cos(0.45), 5.4e-4 * math.sin(0.45)]), 1e-10
    force = pressed_by(made, *place)[:2]
    differences = [
        (pressed_by(made, *(place + h * axis))[2] - pressed_by(made, *(place - h * axis))[2]) / (2.0 * h) for axis in np.eye(2)
    ]
    assert np.hypot(*force) > 1e3
    np.testing.assert_allclose(force, differences, rtol=1e-6)


def test_place_under_a_force():
    """Cross-check: the journal at the place found for a force presses with that force."""
    made = (contour_table(lobed()), *bearing(sd.Clearance(5e-4), 720)[1:])
    out = np.zeros(3)
    place_under(300.0, 400.0, *made, out)
    np.testing.assert_allclose(pressed_by(made, *out[:2])[:2], (300.0, 400.0), rtol=1e-8)


def wear_by(contours, loads, coefficients, substeps=20_000, turn=0.0, spread=0.0):
    """Wear contours of shape (surfaces, angles) by (index, energy, force) of loads on each; return the completed fraction."""
    count, both = len(contours[0]), np.zeros((2, len(contours), 180))
    tables, (_, table, clearance, area) = np.array([contour_table(depths) for depths in contours]), bearing(BORE, count)
    for surface, listed in enumerate(loads):
        for index, energy, force in listed:
            both[:, surface, index] = energy, force
    turns, spreads, shape = np.full(both[0].shape, turn), np.full(both[0].shape, spread), (len(contours), 180, 2)
    done = wear_out(
        *(tables, table, clearance, area, np.full(len(contours), area), *both, turns, spreads, np.full(shape, np.nan)),
        *(np.array(coefficients), substeps, np.zeros((6, count)), np.zeros((count, 3))),
    )
    return tables[..., DEPTH], area * tables[..., DEPTH].sum(axis=-1), done


def worn_by(energy, force, count=720, substeps=20_000):
    """Return contour and worn volume of a bearing for k = 1e-9 m^2/N and a load at 40 degrees, and the completed fraction."""
    depths, volume, done = wear_by(np.zeros((1, count)), [[(20, energy, force)]], [1e-9], substeps)
    return depths[0], volume[0], done


@pytest.mark.parametrize("spread", [0.0, 0.4, math.pi])
def test_wear_against_a_turned_surface(spread):
    """Identity: a surface wears as it does alone with the mean depths of the other one added, for both; V = k F s of both.

    The journal has turned by 100 degrees relative to the bearing, on average, and the load acts at 40 degrees of the bearing.
    """
    own, other, count = np.array(lobed(360)), np.array(lobed(360, 1e-5)), 360
    cells = round(math.degrees(spread))
    box = np.ones(1) if not cells else np.array([0.5, *np.ones(2 * cells - 1), 0.5]) if cells < 180 else np.ones(count)
    for side, turn in enumerate((100, -100)):
        mean = np.roll(np.convolve(np.tile(other, 3), box / box.sum(), "same")[count : 2 * count], turn)
        load = (20, 1e-4, 50.0)
        alone, _, _ = wear_by([own + mean], [[load]], [1e-9])
        contours, loads = [own, other], [[load], []]
        depths, volume, done = wear_by(
            contours[:: 1 - 2 * side], loads[:: 1 - 2 * side], [1e-9, 1e-9], turn=math.radians(100), spread=math.radians(cells)
        )
        assert done == 1.0
        np.testing.assert_allclose(depths[side] - own, alone[0] - own - mean, atol=1e-4 * np.max(alone[0] - own - mean))
        assert volume[side] - bearing(BORE, 360)[3] * own.sum() == pytest.approx(1e-13, rel=1e-8)
        np.testing.assert_array_equal(depths[1 - side], other)


def test_worn_volume_is_archards():
    """Identity: V = k F s for a load of constant direction, whatever the number of cells (round-off)."""
    for count in (90, 360):
        _, volume, done = worn_by(0.2, 50.0, count)
        assert done == 1.0
        assert volume == pytest.approx(2e-10, rel=1e-13)


def test_worn_in_profile():
    """Closed form: a round journal wears V = 2 R L (sqrt(e^2 - c^2) - c acos(c/e)) where elasticity is negligible.

    c = 0.05 mm, R = 10 mm, L = 15 mm, V = 1 mm^3: depth e - c = 8.98746112485 um over a half arc of 32.044338 deg. Under 10 N
    the elastic indentation is 1e-3 of the depth; it rounds the edges of the profile only.
    """
    depths, volume, done = worn_by(1.0, 10.0)
    assert done == 1.0
    assert volume == pytest.approx(1e-9, rel=1e-12)
    assert np.max(depths) == pytest.approx(8.98746112485e-6, rel=1e-4)
    assert math.degrees(math.acos(5e-5 / (5e-5 + np.max(depths)))) == pytest.approx(32.044338, rel=1e-4)
    angle = 2.0 * np.pi * np.arange(depths.size) / depths.size - math.radians(40.0)
    exact = np.maximum(0.0, (5e-5 + 8.98746112485e-6) * np.cos(angle) - 5e-5)
    assert np.max(np.abs(depths - exact)) < 1e-3 * np.max(depths)


def test_a_weak_load_next_to_a_strong_one():
    """Identity: V = k F s of all loads, though the strong load wears the contour by more than the weak one indents it."""
    _, volume, done = wear_by(np.zeros((1, 360)), [[(20, 0.2, 500.0), (21, 1e-6, 0.05)]], [1e-9])
    assert done == 1.0
    assert volume[0] == pytest.approx(1e-9 * 0.200001, rel=1e-12)


def test_wear_by_many_unequal_loads():
    """Identity: V = k sum F s for loads of all sizes and directions, in which each load stays in contact with the bearing."""
    numbers = np.random.default_rng(32)
    for _ in range(20):
        loaded = numbers.choice(180, 30, replace=False)
        energies, forces = 10.0 ** numbers.uniform(-6.0, 0.0, 30), 10.0 ** numbers.uniform(-2.0, 3.5, 30)
        _, volume, done = wear_by(np.zeros((1, 90)), [zip(loaded, energies, forces, strict=True)], [1e-11], 100)
        assert volume[0] == pytest.approx(done * 1e-11 * energies.sum(), rel=1e-9)


def test_wear_stops_at_its_substeps():
    """Contract: the fraction of the wear that was done is reported, and the volume is that fraction."""
    _, volume, done = worn_by(1.0, 10.0, substeps=20)
    assert 0.0 < done < 0.5
    assert volume == pytest.approx(done * 1e-9, rel=1e-12)


@pytest.mark.parametrize(
    ("laws", "said"),
    [
        ({"contour": (0.0,) * 12}, "contour: 12 depths"),
        ({"contour": (-1e-6,) * 360}, "a depth that is negative"),
        ({"contour": (0.0,) * 360, "slip": "contact-points"}, "slip of the contact points"),
    ],
)
def test_contours_that_a_contact_cannot_have(laws, said):
    with pytest.raises(sd.InputError, match=said):
        sd.Clearance(5e-4, **laws)


def test_a_round_contour_is_a_round_bearing():
    """Limit: events and peaks of a run with a contour of zero depth are those of the round bearing (1440 cells: 1e-4)."""
    arm = sd.scissor(units=2).driven(speed=15.0)
    runs = [
        sd.simulate(arm.with_clearance("A", sd.Clearance(5e-4, contour=contour)), until=5e-3, rtol=1e-9, atol=1e-9, trust=False)
        for contour in ((), (0.0,) * 1440)
    ]
    assert runs[0].sizes["contact"] >= 2
    for name in ("contact_start", "peak_force", "approach_speed"):
        np.testing.assert_allclose(runs[1][name].values[:2], runs[0][name].values[:2], rtol=1e-4)


def test_an_angle_that_turns_under_a_resting_journal():
    """Closed form: a contact begins at e cos(phi) = c and e w sin(phi), though the journal itself moves away from the surface.

    The bearing turns, and the journal rests between two of its angles by less than a cell's sagitta.
    """
    gap, turning, away = 1e-4, 10.0, 1e-6
    e = 1.0003 * gap
    journal = sd.Body("journal", 1.0, 1e-3, {"pin": (0.0, 0.0)}, position=(e, 0.0), velocity=(-away, 0.0))
    ring = sd.Body("ring", 1.0, 1e-3, {"hole": (0.0, 0.0)}, angle=math.pi / 90, angular_velocity=turning)
    joints = (sd.Revolute("joint", ("journal", "pin"), ("ring", "hole")),)
    mechanism = sd.Mechanism((journal, ring), joints=joints, gravity=0.0)
    run = sd.simulate(mechanism.with_clearance("joint", sd.Clearance(gap, contour=(0.0,) * 90)), until=0.02, start="as-placed")
    assert run.attrs["status"] == "complete"
    start = float(run["contact_start"][0])
    e -= away * start
    phi = math.acos(gap / e)
    assert start == pytest.approx((math.pi / 90 - phi) / turning, rel=1e-6)
    assert float(run["approach_speed"][0]) == pytest.approx(e * turning * math.sin(phi) - away * math.cos(phi), rel=1e-6)


def test_a_journal_without_a_place():
    """Contract: NaN, which a step that is rejected may contain, gives NaN and reads no memory outside the contour."""
    clearance, out = sd.Clearance(1e-4), np.zeros(4)
    table = pressure_table(clearance.stiffness, clearance.surfaces)
    press_at(math.nan, 0.0, contour_table([0.0] * 90), table, 1e-4, 1e-5, np.zeros(0), out)
    assert math.isnan(out[3])
    # the function itself, in which NaN as an index is an error; in C it is the index -2^63, beyond the array
    value, at = deepest(math.nan, 0.0, contour_table([0.0] * 90), 1e-4)
    assert math.isnan(value)
    assert at == 0
