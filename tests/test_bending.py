"""Bars that bend: closed forms, a second formulation, limits and identities."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.component.beam import force
from scissordyn.config.file import read_case
from scissordyn.model.section import read_section
from scissordyn.plan.bending import dissected

LENGTH, MASS, RIGIDITY, AXIAL = 2.0, 5.68, 2252.0, 7.5e7
BETA = 1.87510406871196, 4.69409113297417, 7.85475743823761


def cantilever(elements: int, *, gravity: float = 0.0, speed: float = 0.0, rigidity: float = RIGIDITY) -> sd.Mechanism:
    """A bar clamped by its drive."""
    made = sd.Mechanism(
        bodies=(sd.bar("bar", length=LENGTH, mass=MASS),),
        joints=(sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)),),
        gravity=gravity,
        input_body="bar",
    )
    return made.with_bending("bar", bending_stiffness=rigidity, axial_stiffness=AXIAL, elements=elements).driven(speed=speed)


def scissor() -> sd.Mechanism:
    """The array of the paper with a frictionless clearance at A."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3))


def test_elements_give_the_elastica() -> None:
    """Closed form: a cantilever with a tip force, P L^2/EI = 1 and 10 (elliptic integrals)."""
    for load, expected, bound in (
        (1.0, (0.056433236283377, 0.30172077379981, 0.46135194971188), 1e-7),
        (10.0, (0.55499559775375, 0.8106090248803, 1.4302855388039), 1e-5),
    ):
        found = _tip(8, load)
        assert np.max(np.abs(np.array(found) - expected)) < bound


def _tip(elements: int, load: float) -> tuple[float, float, float]:
    """Shortening, deflection and angle at the tip: forces of the elements in balance, by Newton's method."""
    length, q = 1.0 / elements, np.zeros(3 * elements)
    q[0::3] = np.arange(1, elements + 1) * length

    def residual(q: np.ndarray, tip: float) -> np.ndarray:
        place, balance = np.vstack([np.zeros(3), q.reshape(-1, 3)]), np.zeros((elements + 1, 3))
        for k in range(elements):
            one, other = place[k], place[k + 1]
            cos, sin = math.cos(one[2]), math.sin(one[2])
            x, y = other[:2] - one[:2]
            f = force(cos * x + sin * y, cos * y - sin * x, other[2] - one[2], 0, 0, 0, 1, 0, length, 1e7, 1.0, *[0.0] * 6)
            fx, fy = cos * f[0] - sin * f[1], sin * f[0] + cos * f[1]
            balance[k + 1] += fx, fy, f[2]
            balance[k] -= fx, fy, f[2] + x * fy - y * fx
        balance[-1, 1] += tip
        return balance[1:].ravel()

    for tip in np.linspace(0.1, 1.0, 10) * load:
        for _ in range(12):
            steps = 1e-6 * np.eye(q.size)
            slope = np.stack([(residual(q + h, tip) - residual(q - h, tip)) / 2e-6 for h in steps], axis=1)
            change = np.linalg.solve(slope, -residual(q, tip))
            q = q + change
            if np.max(np.abs(change)) < 1e-10:
                break
    return 1.0 - float(q[-3]), float(q[-2]), float(q[-1])


def test_frequencies_of_a_cantilever_converge_with_the_fourth_order() -> None:
    """Closed form and order of convergence: beta L of a clamped bar."""
    errors = []
    for elements in (4, 8, 16):
        omega = sd.modes(cantilever(elements), position="concentric")["angular_frequency"].values[:3]
        errors.append(np.sqrt(omega * math.sqrt(MASS / LENGTH * LENGTH**4 / RIGIDITY)) / BETA - 1.0)
    assert abs(errors[2][0]) < 1e-7
    order = np.log2(np.array(errors[1]) / np.array(errors[2]))
    assert np.all(np.abs(order - 4.0) < 0.2)


def test_a_bar_on_three_pins_has_twice_pi_first() -> None:
    """Closed form: beta L = 2 pi, the antisymmetric mode of a bar pinned at both ends and its middle (no axial restraint)."""
    bar = sd.bar("bar", length=LENGTH, mass=MASS)
    made = sd.Mechanism(
        bodies=(bar,),
        joints=(sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
        guides=(sd.Guide("middle", ("bar", "middle")), sd.Guide("end", ("bar", "end"))),
        ground=(("O", (0.0, 0.0)),),
        gravity=0.0,
    ).with_bending(bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, elements=16)
    omega = float(sd.modes(made, position="concentric")["angular_frequency"][0])
    beta = math.sqrt(omega * math.sqrt(MASS / LENGTH * LENGTH**4 / RIGIDITY))
    assert beta == pytest.approx(2.0 * math.pi, rel=1e-5)


def test_axial_force_changes_the_frequency_down_to_buckling() -> None:
    """Closed form: omega^2 = omega_0^2 (1 - P/P_cr) of a bar on two pins, P_cr = pi^2 EI/L^2; geometric stiffness."""
    critical = math.pi**2 * RIGIDITY / LENGTH**2
    first = (math.pi / LENGTH) ** 2 * math.sqrt(RIGIDITY * LENGTH / MASS)
    for part in (-0.5, 0.3, 0.9):
        made = sd.Mechanism(
            bodies=(sd.bar("bar", length=LENGTH, mass=MASS),),
            joints=(sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
            guides=(sd.Guide("end", ("bar", "end")),),
            components=(sd.Force("load", ("bar", "end"), (-part * critical, 0.0)),),
            ground=(("O", (0.0, 0.0)),),
            gravity=0.0,
        ).with_bending(bending_stiffness=RIGIDITY, axial_stiffness=1e9, elements=8)
        omega = float(sd.modes(made, count=1)["angular_frequency"][0])
        assert (omega / first) ** 2 == pytest.approx(1.0 - part, abs=5e-5)  # of the fourth order in the element length


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_released_cantilever_keeps_its_energy(method: str) -> None:
    """Identity: the energy balance with strain energy, and the reaction at the clamp as momentum demands it."""
    run = sd.simulate(cantilever(2, gravity=9.81), until=0.05, samples=101, method=method)
    assert run.attrs["status"] == "complete"
    turned_over = float(np.ptp(run["potential_energy"].values))
    assert float(np.max(np.abs(run["energy_residual"].values))) < 1e-7 * turned_over
    assert float(run["stored_energy"].max()) > 0.1 * turned_over


def test_static_start_has_the_deflection_under_weight() -> None:
    """Closed form: w = q L^4/(8 EI) of a stiff cantilever, reaction = weight, moment = q L^2/2."""
    stiff = 1e6
    run = sd.simulate(cantilever(8, gravity=9.81, rigidity=stiff), until=1e-4, samples=2, start="static", method="dop853")
    weight = MASS * 9.81
    sag = -float(run["position"].sel(body="bar/8", axis="y")[0])
    assert sag == pytest.approx(weight * LENGTH**3 / (8.0 * stiff), rel=1e-4)
    assert float(run["reaction"].sel(joint="O", axis="y")[0]) == pytest.approx(weight, rel=1e-6)
    assert float(run["drive_torque"].isel(time=0).values.ravel()[0]) == pytest.approx(0.5 * weight * LENGTH, rel=1e-5)


def test_first_contact_tends_to_that_of_rigid_bars_as_one_over_the_stiffness() -> None:
    """Limit, with its order: the array of the paper, started unbent at the velocities of rigid bars.

    At EI = 4e8 N m^2, EA = 7.5e11 N the contact comes at 1.344 ms, as in a second program with other elements.
    """
    rigid = sd.simulate(scissor().driven(speed=sd.rpm(150)), until=1.5e-3)
    starts = []
    for rigidity, axial in ((4e8, 7.5e11), (4e9, 7.5e12), (4e10, 7.5e13)):
        bent = scissor().with_bending(bending_stiffness=rigidity, axial_stiffness=axial, elements=2)
        run = sd.simulate(bent.driven(speed=sd.rpm(150)), until=1.6e-3, samples=5, method="dop853")
        starts.append(float(run["contact_start"][0]))
    assert starts[0] == pytest.approx(1.344e-3, abs=5e-7)
    errors = np.abs(np.array(starts) - float(rigid["contact_start"][0]))
    assert abs(math.log10(errors[1] / errors[2]) - 1.0) < 0.05


@pytest.mark.parametrize(
    ("section", "area", "second", "depth"),
    [
        ("tube 60x60x1.56 mm", 0.06**2 - 0.05688**2, (0.06**4 - 0.05688**4) / 12.0, 0.06),
        ("tube 50x2 mm", math.pi / 4 * (0.05**2 - 0.046**2), math.pi / 64 * (0.05**4 - 0.046**4), 0.05),
        ("solid 2x3 cm", 6e-4, 0.02 * 0.03**3 / 12.0, 0.03),
        ("strip 30x2 mm", 6e-5, 0.03 * 0.002**3 / 12.0, 0.002),
    ],
)
def test_sections(section: str, area: float, second: float, depth: float) -> None:
    """Closed form: area and second moment of area."""
    found = read_section(section)
    assert (found.area, found.second_moment, found.depth) == pytest.approx((area, second, depth), rel=1e-12)


CASE = """
[structure]
kind = "scissor"
bar_mass = "5.68 kg"
[drive]
speed = "150 rpm"
[[bending]]
section = "tube 60x60x1.56 mm"
material = "steel"
elements = 2
[run]
until = "1 ms"
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("60x60x1.56", "60x60x40", "wall"),
        ("tube", "tub", "tube"),
        ('"steel"', '"stel"', "steel"),
        ('material = "steel"\n', "", "material"),
        ("5.68", "9", "bar_mass"),
        ("tube 60x60x1.56 mm", "tube 90x90x1.56 cm", "beam theory"),
        ('section = "tube 60x60x1.56 mm"\nmaterial = "steel"', 'bending_stiffness = "2 kN m^2"', "axial_stiffness (EA)"),
        ('section = "tube 60x60x1.56 mm"\nmaterial = "steel"', 'axial_stiffness = "2 MN"', "bending_stiffness (EI)"),
        ("elements = 2", "elements = 0", "elements"),
        ("elements = 2", 'damping = "-1 s"', "damping"),
        ("elements = 2", 'temperature_rise = "5000 K"', "temperature_rise"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str) -> None:
    """Contract: what cannot be right ends with status 2 and one line that names it."""
    file = tmp_path / "case.toml"
    file.write_text(CASE.replace(old, new, 1), encoding="utf-8")
    assert status_of(["run", str(file), "-o", str(tmp_path / "run.nc")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") <= 1


def test_case_file_and_python_agree(tmp_path: Path) -> None:
    """Identity: the table [[bending]] and `with_bending` describe the same mechanism; the written case reads back."""
    file = tmp_path / "case.toml"
    file.write_text(CASE, encoding="utf-8")
    read = read_case(file)
    base = sd.scissor(bar_mass=5.68)
    built = base.with_bending(section="tube 60x60x1.56 mm", material="steel", elements=2).driven(speed=sd.rpm(150))
    assert read.mechanism == built
    again = tmp_path / "again.toml"
    again.write_text(read.mechanism.to_case(read.run), encoding="utf-8")
    assert read_case(again).mechanism == built


def test_guides_on_a_bending_bar_are_refused() -> None:
    """Contract: nothing unsupported is accepted."""
    with pytest.raises(sd.InputError, match="platform"):
        sd.mast(units=1, platform_mass=3.0).with_bending("platform", bending_stiffness=1e4, axial_stiffness=1e7)


def test_dissection_leaves_few_coordinates_in_each_other():
    """Identity and bound: all coordinates, and a row of the inverse factor has as many entries as the chain halvings."""
    count = 127
    chain = sp.csr_array(sp.diags_array([1.0, 4.0, 1.0], offsets=[-1, 0, 1], shape=(count, count)))
    order = dissected(chain)
    assert sorted(order.tolist()) == list(range(count))
    lower = np.linalg.cholesky(chain[order][:, order].toarray())
    entries = np.count_nonzero(np.abs(np.linalg.inv(lower)) > 1e-15, axis=0)
    assert entries.max() <= math.log2(count + 1) + 6  # below six coordinates a part is not divided


@pytest.mark.parametrize("elements", [None, 3])
@pytest.mark.parametrize("unplaced", ["coupler", "coupler rocker", "crank coupler rocker"])
def test_bars_without_a_place_bend_where_rigid_ones_are_assembled(unplaced: str, elements: int | None) -> None:
    """Identity: at the start straight bars that bend close a linkage as rigid ones do, on the same branch, to 1e-9."""
    linkage = sd.four_bar()
    bodies = (
        dataclasses.replace(body, points={k: v for k, v in body.points.items() if k != "point"}) for body in linkage.bodies
    )
    placed = (dataclasses.replace(body, position=None, angle=None) if body.name in unplaced else body for body in bodies)
    rigid = dataclasses.replace(linkage, bodies=tuple(placed)).driven(speed=sd.rpm(60))
    bent = rigid.with_bending("coupler", bending_stiffness=100.0, axial_stiffness=1e6, elements=elements)
    angles = [
        sd.simulate(case, until=1e-3, samples=2)["angle"].sel(body=["crank", "coupler", "rocker"])[0] for case in (rigid, bent)
    ]
    np.testing.assert_allclose(np.exp(1j * angles[1]), np.exp(1j * angles[0]), atol=1e-9)
