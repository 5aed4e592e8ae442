"""Films of oil: impedances against integrals and published numbers, energy, and runs of lubricated joints."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from tests.build import array, case_of, warnings_of

import scissordyn as sd
from scissordyn.components.film.film import FIRST_TABLE_VALUE, MODELS, Film, force
from scissordyn.components.film.impedance import finite_table, long_bearing, looked_up, short_bearing
from scissordyn.components.film.reynolds import impedance
from scissordyn.laws.oil import OILS

from .shared import shaft_in_bearing

plain = getattr(force, "py_func", force)
BEARING = ("ground", "O"), ("shaft", "centre")  # Bearing and journal points of an oil film
# Sommerfeld number by eccentricity ratio for L/D = 1 (Raimondi and Boyd 1958)
SOMMERFELD = {0.2: 0.631, 0.6: 0.121, 0.8: 0.0446, 0.9: 0.0188}


def film(model: str = "finite", **given) -> Film:
    """Return a film in a bearing whose length is one diameter."""
    return Film(
        "film", *BEARING, **{"viscosity": 0.05, "clearance": 1e-4, "radius": 0.02, "length": 0.04, "model": model, **given}
    )


@cache
def numbers_of(one: Film) -> tuple[tuple[float, ...], np.ndarray]:
    """Return the parameters of a film's kernel before its table, and all of them."""
    numbers = one.parameters((0.0, 0.0, 0.0))
    return numbers[:FIRST_TABLE_VALUE], np.array(numbers)


def acting(one: Film, x, y, x_rate=0.0, y_rate=0.0, speed=0.0):
    """Return force, torque, energy, power lost, thickness, pressure, ..., and last the force of the asperities."""
    first, row = numbers_of(one)
    return plain(x, y, 0.0, x_rate, y_rate, speed, 0.0, *first, row)


@pytest.mark.parametrize("seed", range(20))
def test_a_short_bearing_by_quadrature(seed):
    """Independent formulation: the mean of the parabola over the length is 2/3 of its top, over the half with pressure."""
    rng = np.random.default_rng(seed)
    e, psi = rng.uniform(0.0, 0.95), rng.uniform(-math.pi, math.pi)

    def mean(theta: float) -> float:
        return -2.0 * math.cos(theta - psi) / (1.0 + e * math.cos(theta)) ** 3

    ends = psi + 0.5 * math.pi, psi + 1.5 * math.pi
    wanted = [quad(lambda t, g=g: mean(t) * g(t), *ends, epsabs=1e-13, limit=400)[0] for g in (math.cos, math.sin)]
    found = short_bearing(e, math.sin(psi), math.cos(psi), False)
    np.testing.assert_allclose(found, wanted, atol=1e-11 * math.hypot(*wanted))


@pytest.mark.parametrize("seed", range(20))
def test_a_long_bearing_by_sums(seed):
    """Independent formulation: Sommerfeld's pressure where it is positive, by a fine sum over the circumference."""
    rng = np.random.default_rng(seed)
    e, psi = rng.uniform(0.0, 0.9), rng.uniform(-3.0, 3.0)
    theta = np.linspace(0.0, 2.0 * math.pi, 400001)
    h = 1.0 + e * np.cos(theta)
    wedge = -math.sin(psi) * np.sin(theta) * (2.0 + e * np.cos(theta)) / (2.0 + e * e)
    squeeze = 0.5 * math.cos(psi) * (1.0 - np.cos(theta)) * (2.0 + e + e * np.cos(theta)) / (1.0 + e) ** 2
    pressure = np.maximum(6.0 * (wedge + squeeze) / h**2, 0.0)
    wanted = [np.trapezoid(pressure * g(theta), theta) for g in (np.cos, np.sin)]
    found = long_bearing(e, math.sin(psi), math.cos(psi), False)
    np.testing.assert_allclose(found, wanted, atol=1e-7 * math.hypot(*wanted))


@pytest.mark.parametrize("e", [0.99, 0.9999])
@pytest.mark.parametrize("psi", [0.0, 1e-6, -0.4, 1.5707963, -2.2, 3.1, 3.1415])
def test_a_long_bearing_near_contact(e, psi):
    """Independent formulation: in Sommerfeld's angle by adaptive quadrature, the end of the film by Brent's method."""
    side = -1.0 if math.sin(psi) > 0.0 else 1.0  # mirrored, the film begins at theta = 0
    sine, cosine, root = -abs(math.sin(psi)), math.cos(psi), math.sqrt(1.0 - e * e)

    def pressure(s: float) -> tuple[float, float, float]:
        below = 1.0 - e * math.cos(s)
        c, q, h = (math.cos(s) - e) / below, root * math.sin(s) / below, root * root / below
        wedge = -sine * q * (2.0 + e * c) / (2.0 + e * e)
        return 6.0 * (wedge + 0.5 * cosine * (1.0 - c) * (2.0 + e + e * c) / (1.0 + e) ** 2) / h**2, c, q

    def share(s: float, which: int) -> float:
        found = pressure(s)
        return found[0] * found[which] * root / (1.0 - e * math.cos(s))

    inside = 2.0 * math.pi * np.linspace(0.0, 1.0, 20001)[100:-1] ** 3
    signs = np.array([pressure(s)[0] > 0.0 for s in inside])
    last = 2.0 * math.pi
    if not signs.all():
        k = int(np.argmin(signs))
        last = brentq(lambda s: pressure(s)[0], inside[k - 1], inside[k], xtol=1e-15) if k else 0.0
    marks = [mark for mark in (1e-3, 1e-2, 0.1, 1.0, 5.5, 6.18, 6.27) if mark < last]
    wanted = [quad(share, 0.0, last, (which,), points=marks or None, epsrel=1e-12, limit=400)[0] for which in (1, 2)]
    radial, tangential = long_bearing(e, math.sin(psi), math.cos(psi), False)
    rounding = 10.0 * np.finfo(float).eps / root**5  # the integrals are of order one before they are divided by root^5
    np.testing.assert_allclose((radial, side * tangential), wanted, rtol=0.0, atol=rounding + 1e-6 * math.hypot(*wanted))


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
def test_the_pure_wedge_of_a_long_bearing(e):
    """Closed form: 6 mu w R (R/c)^2 L (2 e^2/((2+e^2)(1-e^2)), pi e/((2+e^2) sqrt(1-e^2))), half film."""
    one = film("long", roughness=1e-9)
    fx, fy, *_ = acting(one, e * one.clearance, 0.0, speed=30.0)
    scale = 6.0 * one.viscosity * 30.0 * one.radius * one.length * (one.radius / one.clearance) ** 2
    assert -fx == pytest.approx(scale * 2.0 * e * e / ((2.0 + e * e) * (1.0 - e * e)), rel=1e-9)
    assert fy == pytest.approx(scale * math.pi * e / ((2.0 + e * e) * math.sqrt(1.0 - e * e)), rel=1e-9)


@pytest.mark.parametrize(("model", "last"), [("short", 0.95), ("long", 0.95)])
def test_a_squeeze_under_a_constant_load(model, last):
    """Closed form: a full film gives way from the centre in (pi mu R L^3/(c^2 W)) e/(1-e^2)^1.5, or 12 pi mu L R^3 ... ^.5."""
    one, load = film(model, full=True, roughness=1e-9), 1000.0

    def duration(e: float) -> float:
        """Return the time per unit of eccentricity ratio: the force at a speed of one clearance per second, over the load."""
        return -acting(one, e * one.clearance, 0.0, x_rate=one.clearance)[0] / load

    found = quad(duration, 0.0, last, epsrel=1e-12, limit=200)[0]
    if model == "short":
        factor, power = math.pi * one.radius * one.length**3, 1.5
    else:
        factor, power = 12.0 * math.pi * one.length * one.radius**3, 0.5
    wanted = factor * one.viscosity / (one.clearance**2 * load) * last / (1.0 - last**2) ** power
    assert found == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize(("e", "published"), SOMMERFELD.items())
def test_sommerfeld_numbers(e, published):
    """Published numbers: within the error of reading their tables, 1.5 %, that of the table included."""
    radial, tangential, _ = looked_up(finite_table(1.0), e, 0.5 * math.pi)
    assert 1.0 / (math.pi * e * math.hypot(radial, tangential)) == pytest.approx(published, rel=0.015)


def test_the_table_against_solutions_between_its_nodes():
    """Independent formulation: Reynolds' equation solved at other places, on a coarser mesh; between lengths, too."""
    rng = np.random.default_rng(3)
    for _ in range(12):
        ratio, e, psi = math.exp(rng.uniform(-1.3, 1.3)), rng.uniform(0.0, 0.97), rng.uniform(0.0, math.pi)
        (solved,) = impedance(e, np.array([psi]), ratio, around=160, along=16)
        radial, tangential, pressure = looked_up(finite_table(ratio), e, psi)
        size = math.hypot(solved.radial, solved.tangential)
        assert math.hypot(radial - solved.radial, tangential - solved.tangential) < 0.015 * size
        assert pressure == pytest.approx(solved.pressure, rel=0.04)


@pytest.mark.parametrize("e", [0.3, 0.9])
def test_a_finite_bearing_between_its_limits(e):
    """Limit: approached at L/D = 0.05 it is short, at 40 long."""
    psi = 0.7
    for ratio, wanted in ((0.05, short_bearing), (40.0, long_bearing)):
        (solved,) = impedance(e, np.array([psi]), ratio, around=240, along=20)
        found = np.array(wanted(e, math.sin(psi), math.cos(psi), False)) * (ratio**2 if ratio < 1.0 else 1.0)
        # where a long film's pressure would fall below zero, Guembel's condition knows one side only
        near = (0.04 if ratio < 1.0 else 0.16) * math.hypot(*found)
        assert math.hypot(solved.radial - found[0], solved.tangential - found[1]) < near


@pytest.mark.parametrize("model", MODELS)
def test_a_film_only_loses_energy_and_knows_no_direction(model):
    """Identity: power lost is never negative; a state that is turned has its force turned; energy is force times rate."""
    rng = np.random.default_rng(5)
    one = film(model)
    for _ in range(200):
        place = rng.uniform(-0.69, 0.69, 2) * one.clearance
        rate, speed = rng.normal(size=2) * 0.1, rng.normal() * 30.0
        fx, fy, torque, _, lost, thickness, pressure, *_, carried = acting(one, *place, *rate, speed)
        assert lost >= 0.0
        stored = carried * float(place @ rate) / math.hypot(*place)  # power that the asperities store
        assert lost == pytest.approx(-(fx * rate[0] + fy * rate[1] + torque * speed) - stored, rel=1e-11)
        assert thickness == pytest.approx(one.clearance - math.hypot(*place))
        assert pressure >= 0.0
        angle = rng.uniform(-3.0, 3.0)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        turned = acting(one, *(turn @ place), *(turn @ rate), speed)
        np.testing.assert_allclose(turned[:2], turn @ (fx, fy), atol=1e-9 * math.hypot(fx, fy))
        mirrored = acting(one, place[0], -place[1], rate[0], -rate[1], -speed)
        np.testing.assert_allclose(mirrored[:3], (fx, -fy, -torque), atol=1e-9 * math.hypot(fx, fy))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("ends", [(-0.9915, 0.9915), (0.9916, 1.02)])
def test_forces_have_no_jump_in_value_or_slope(model, ends):
    """Limit: along a line through the centre and the thin film, and along one in contact, steps of force shrink smoothly."""
    one = film(model, roughness=1e-6)

    places = np.linspace(*ends, 8001) * one.clearance
    forces = np.array([acting(one, x, 0.13 * one.clearance, 0.01, 0.005, 3.0)[0] for x in places])
    coarse, fine = (np.max(np.abs(np.diff(along, n=2))) for along in (forces[::2], forces))
    assert fine < 0.35 * coarse


@pytest.mark.parametrize("model", MODELS)
def test_forces_do_not_jump_at_contact(model):
    """Limit: the slope changes where the contact law sets in, an event of the run; the force and the energy do not."""
    one = film(model, roughness=1e-6)
    before, after = (np.array(acting(one, at * one.clearance, 0.0, 0.01, 0.005, 3.0)[:5]) for at in (1.0 - 1e-12, 1.0 + 1e-12))
    np.testing.assert_allclose(after, before, rtol=1e-8)


def turning(load: float, oil: sd.Lubrication) -> sd.Mechanism:
    """Return a shaft that turns ten times a second in a bearing, with a load as its weight."""
    return shaft_in_bearing(load, oil).driven(speed=20.0 * math.pi, body="shaft")


def test_a_shaft_settles_where_its_load_belongs():
    """Published numbers: eccentricity 0.8 at the load of Raimondi and Boyd's Sommerfeld number, at an attitude of 36 deg."""
    load = 0.05 * 10.0 * 0.04 * 0.04 * (0.02 / 4e-5) ** 2 / SOMMERFELD[0.8]
    run = sd.simulate(turning(load, sd.Lubrication(viscosity=0.05, roughness=1e-7)), until=0.6, samples=601)
    x, y = run["film_displacement"].values[-1, 0] / 4e-5
    assert math.hypot(x, y) == pytest.approx(0.8, abs=0.005)
    assert math.degrees(math.atan2(x, -y)) == pytest.approx(36.2, abs=1.0)
    assert run["film_full_share"].item() == 1.0
    assert run.sizes["contact"] == 0
    # friction against the torque of the drive
    assert run["drive_torque"].values[-1].item() == pytest.approx(-run["film_torque"].values[-1].item(), rel=1e-3)


def oiled(**given) -> sd.Mechanism:
    """Return the paper's array with oil in joint A."""
    oil = sd.Lubrication(**{"viscosity": 0.05, **given})
    return array(sd.Clearance(2e-4, friction=sd.LuGre(0.05), lubrication=oil))


@pytest.mark.parametrize("model", MODELS)
def test_the_energy_balance_closes(model):
    """Identity: power lost in film, friction and contacts, and the work of the drive; residual over what is turned over."""
    run = sd.simulate(oiled(bearing=model), until=0.02, rtol=1e-11, atol=1e-11)
    assert run.attrs["status"] == "complete"
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(np.abs(run["drive_work"]).max())
    assert float(run["damper_loss"].values[-1]) > 1e-3


def test_several_oils_beside_several_laws():
    """Identity: two joints, each with its oil, contact and friction law: the balance closes; each its viscosity."""
    first = sd.Clearance(2e-4, friction=sd.LuGre(0.05), lubrication=sd.Lubrication("ISO VG 32", bearing="long"))
    damping = sd.LankaraniNikravesh()
    oil = sd.Lubrication(viscosity=0.1, roughness=5e-6)
    second = sd.Clearance(1e-4, stiffness=sd.Hertz(), damping=damping, friction=sd.Ambrosio(0.1), lubrication=oil)
    arm = array(first).with_clearance("unit 1/pivot", second)
    assert [film.viscosity for film in arm.exerting] == [pytest.approx(871.0 * 31.5e-6), 0.1]
    run = sd.simulate(arm, until=0.01, rtol=1e-10, atol=1e-10)
    assert run["film"].values.tolist() == ["A", "unit 1/pivot"]
    assert np.all(run["film_peak_force"].values > 0.0)
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(np.abs(run["drive_work"]).max())


def test_two_methods_agree():
    """Independent formulation: the stiff method with its step matrix, and the explicit one."""
    smooth = array(sd.Clearance(2e-4, lubrication=sd.Lubrication(viscosity=0.02)))
    stiff, explicit = (sd.simulate(smooth, until=0.01, rtol=1e-9, atol=1e-9, method=method) for method in ("rodas5p", "dop853"))
    np.testing.assert_allclose(stiff["film_displacement"], explicit["film_displacement"], atol=2e-8)


def test_oil_softens_the_first_touch_and_is_said_to_be_thin():
    """Limit: the journal arrives slower than without oil, warnings name the thin film, and the shares of time add up to one."""
    dry = sd.simulate(array(sd.Clearance(2e-4)), until=0.05)
    run = sd.simulate(oiled(), until=0.05)
    assert run["approach_speed"].values[0] < 0.2 * dry["approach_speed"].values[0]
    said = warnings_of(run)
    least, when = run["film_least_thickness"].item(), run["film_least_thickness_time"].item()
    assert any(f"least {least:.3g} m at t = {when:.6g} s" in text for text in said)
    assert any("oil thickens" in text for text in said)
    shares = [run[f"film_{name}_share"].item() for name in ("dry", "mixed", "full")]
    assert sum(shares) == pytest.approx(1.0)
    time = run["time"].values
    dry_time = np.trapezoid(1.0 * (run["film_thickness"].values[:, 0] <= 0.0), time)
    assert shares[0] == pytest.approx(dry_time / time[-1], abs=1.0 / len(time))


def test_peaks_are_found_within_the_steps():
    """Limit: few samples give the answers of many, integrals up to the rule on steps; losses are those of the balance."""
    few, many = (sd.simulate(oiled(), until=0.01, samples=samples) for samples in (5, 20001))
    for name in ("film_least_thickness", "film_least_thickness_time", "film_peak_pressure", "film_peak_tension_time"):
        assert few[name].item() == pytest.approx(many[name].item(), rel=1e-6)
    for name, error in (
        ("heating", 2e-3),
        ("squeeze_reynolds_number", 1e-3),
        ("least_thickness_angle", 1e-4),
        ("torn_share", 2e-2),
    ):
        assert few[f"film_{name}"].item() == pytest.approx(many[f"film_{name}"].item(), rel=error)
    lost = np.trapezoid(many["film_power_lost"].values[:, 0], many["time"].values)
    assert lost == pytest.approx(few["damper_loss"].values[-1], rel=1e-4)
    assert many["film_least_thickness"].item() == pytest.approx(many["film_thickness"].min().item(), abs=1e-9)
    assert many["film_peak_pressure"].item() == pytest.approx(many["film_pressure"].max().item(), rel=1e-3)
    at = int(np.argmin(many["film_thickness"].values[:, 0]))
    x, y = many["film_displacement"].values[at, 0]
    assert many["film_least_thickness_angle"].item() == pytest.approx(math.atan2(y, x), abs=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"ambient_pressure": 0.0}, "evaporates in a vacuum"),
        ({"ambient_pressure": 2e3, "vapour_pressure": 2.3e3}, "the oil boils at the 2e+03 Pa around it"),
        ({}, "cavitates beyond the model"),
        ({"bearing": "short", "full": True}, "full = true is not possible there"),
        ({"viscosity": 1e-3}, "squeeze Reynolds number"),
        ({"viscosity": None, "oil": "ISO VG 46"}, "asperities carry part"),
    ],
)
def test_a_film_beyond_its_model_is_said(given, said):
    """Limit: each with its own line; a vacuum for which the oil is made, and surroundings that press enough, are not named."""
    run = sd.simulate(oiled(**given), until=0.008)
    assert any(said in text for text in warnings_of(run))
    many = sd.simulate_many(oiled(**given), {"A.clearance": [2e-4]}, until=0.008)
    if "vacuum" in said or "boils" in said or "asperities" in said:  # what needs no samples
        assert any(
            said.replace("asperities carry part", "thinner than three") in text for text in many["warnings"].item().splitlines()
        )
    calm = sd.simulate(oiled(ambient_pressure=1e9, vapour_pressure=1e-9), until=0.001)
    assert not any("evaporates" in text or "cavitates" in text for text in warnings_of(calm))


def test_a_squeeze_needs_the_tension_of_the_opposite_approach():
    """Identity: Reynolds' equation without cavities is odd in the velocity."""
    one = film("short", full=True)
    away, near = (acting(one, 0.5 * one.clearance, 0.0, x_rate=rate) for rate in (-0.1, 0.1))
    assert away[9] == pytest.approx(near[6], rel=1e-12)
    assert away[6] == pytest.approx(near[9], rel=1e-12)
    assert near[10] == 0.1
    assert near[8] == pytest.approx(0.5 * one.clearance)


def test_a_shaft_that_heats_its_oil_is_said():
    """Closed form: a concentric shaft loses 2 pi mu w^2 R^3 L/c, which warms 2 pi R c L of oil; so does its Reynolds number."""
    oil = sd.Lubrication("ISO VG 46", temperature=313.15)
    run = sd.simulate(turning(1e-3, oil).driven(speed=300.0, body="shaft"), until=1.0, samples=201)
    mu, density = oil.dynamic_viscosity, 876.0
    rise = mu * 300.0**2 * 0.02**2 / (4e-5) ** 2 / (2000.0 * density)
    assert run["film_heating"].item() == pytest.approx(rise, rel=1e-3)
    assert run["film_reynolds_number"].item() == pytest.approx(density * 300.0 * 0.02 * 4e-5 / mu, rel=1e-6)
    assert any("would warm the oil" in text and "evaporate and boil" in text for text in warnings_of(run))


# Case file with a lubricated joint; "{oil}" is replaced by its lubrication
CASE = """
[structure]
kind = "scissor"
units = 2
[drive]
speed = "150 rpm"
[[clearance]]
joint = "A"
clearance = "0.2 mm"
lubrication = {oil}
[run]
until = "1 ms"
"""


def test_a_case_file(tmp_path):
    """Identity: an oil by name, with its temperature in degrees Celsius, or its viscosities; and back."""
    own = '{ oil = { viscosity_40 = "46 mm^2/s", viscosity_100 = "7 mm^2/s", density = "870 kg/m^3" }, bearing = "short" }'
    for text, viscosity in (
        ('"ISO VG 46"', 876.0 * 44.2e-6),
        ('{ oil = "ISO VG 46", temperature = "100 degC", roughness = "0.5 um" }', 876.0 * 6.65e-6),
        ('{ viscosity = "20 mPa s" }', 0.02),
        ('{ viscosity = "20 mPa s", density = "1800 kg/m^3", ambient_pressure = "0 Pa", vapour_pressure = "1e-3 Pa" }', 0.02),
        (own, 870.0 * 46e-6),
    ):
        case = case_of(tmp_path, CASE.replace("{oil}", text))
        oil = case.mechanism.joint("A").clearance.lubrication
        assert oil.dynamic_viscosity == pytest.approx(viscosity, rel=1e-12)
        sd.write_case(case, tmp_path / "again.toml")
        assert sd.read_case(tmp_path / "again.toml").mechanism == case.mechanism


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"ISO VG 47"', "did you mean 'ISO VG 46'"),
        ('"grease"', "a grease does not flow below its yield stress"),
        ('{ viscosity = "0 Pa s" }', "viscosity"),
        ("{ }", "neither oil nor viscosity"),
        ('{ bearing = "short" }', "neither oil nor viscosity"),
        ('{ viscosity = "0.1 Pa s", oil = "ISO VG 46" }', "an oil and a viscosity"),
        ('{ viscosity = "0.1 Pa s", roughness = "0.03 mm" }', "at most a tenth of the clearance"),
        ('{ viscosity = "0.1 Pa s", bearing = "wide" }', "finite"),
        ('{ oil = "ISO VG 46", temperature = "400 degC" }', "temperature"),
    ],
)
def test_bad_input_is_one_line(text, said, tmp_path, answer):
    """Bad input: the error is one line, with status 2."""
    (tmp_path / "case.toml").write_text(CASE.replace("{oil}", text), encoding="utf-8")
    assert said in answer("run", tmp_path / "case.toml", "-o", tmp_path / "run.nc", status=2)


def test_a_bearing_too_short_for_the_table_names_the_other_model():
    """Limit: L/D = 0.1."""
    with pytest.raises(sd.InputError, match='bearing="short"'):
        sd.Clearance(1e-4, journal_radius=0.02, bearing_length=0.004, lubrication=sd.Lubrication(viscosity=0.1))


def test_walther():
    """Closed form: both stated viscosities, and log log linear in log T between them."""
    oil = OILS["ISO VG 46"]
    assert oil.viscosity(313.15) == pytest.approx(876.0 * 44.2e-6)
    assert oil.viscosity(373.15) == pytest.approx(876.0 * 6.65e-6)
    middle = math.sqrt(313.15 * 373.15)
    twice = [math.log10(math.log10(oil.viscosity(t) / 876.0 * 1e6 + 0.7)) for t in (313.15, middle, 373.15)]
    assert twice[1] == pytest.approx(0.5 * (twice[0] + twice[2]))


OWN = """
import scissordyn as sd


@sd.element(slot="stiffness")
def soft(indentation):
    return 1e9 * indentation**1.5
"""
"""Python file with a user-defined stiffness law."""


def test_a_picture_of_a_film_executes_nothing(tmp_path):
    """Contract: a saved run with a function of the user's is drawn without it; the dashed line is at three roughnesses."""
    (tmp_path / "own.py").write_text(OWN, encoding="utf-8")
    text = CASE.replace("{oil}", '{ viscosity = "50 mPa s", roughness = "2 um" }\nstiffness = { law = "own.py:soft" }')
    case = case_of(tmp_path, text)
    sd.save(sd.simulate(case.mechanism, until=1e-3, samples=21), tmp_path / "run.nc")
    (tmp_path / "own.py").unlink()
    drawn = sd.plot.film(sd.load(tmp_path / "run.nc"))
    (line,) = [one for one in drawn[0].lines if one.get_label() == "three roughnesses"]
    assert line.get_ydata()[0] == pytest.approx(6.0)
    assert drawn[0].get_ylabel() == "film thickness [µm]"
