"""Named factors: every combination is the mechanism of a case file with these names, and names are not treated as numbers."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.config.studies import refine_study
from scissordyn.plot.study import feasibility_map, response_curves
from scissordyn.studies.answer.conclusion import conclude
from scissordyn.studies.compute.table import column

# Case file with a flexible bar
CASE = """
[structure]
kind = "scissor"
units = 1
bars = { section = "tube 60x60x1.5 mm", material = "steel", modes = 1 }

[drive]
speed = "50 rpm"

[[clearance]]
joint = "A"
clearance = "0.5 mm"
friction = "none"

[run]
until = "2 ms"
"""

MATERIAL, SECTION = "structure.bars.material", "structure.bars.section"  # Parameter paths of material and section of the bars
MATERIALS = ["steel", "aluminium", "titanium"]  # Names of materials, values of a factor
SECTIONS = ["tube 60x60x1.5 mm", "tube 50x50x2 mm"]  # Texts of sections, values of a factor

# Arguments of a study with twelve cases
TWELVE = {
    "factors": {MATERIAL: MATERIALS, "A.clearance": [0.3e-3, 0.5e-3], SECTION: SECTIONS},
    "measures": ["peak_drive_torque", "peak_bar_stress", "mass"],
    "requirements": {"peak_bar_stress": 1.2e6},
}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Write an array of one unit whose bars bend."""
    path = tmp_path_factory.mktemp("names") / "case.toml"
    path.write_text(CASE)
    return path


@pytest.fixture(scope="module")
def found(case):
    """Return a study of three materials, two sections and two clearances."""
    return sd.study(case, **TWELVE, store=case.parent / "names.db")


def test_each_case_is_the_run_of_its_case_file(case, found):
    """Identity: a run of the case file with these names by `simulate`, bit for bit."""
    table = found.table
    assert list(table[MATERIAL].unique()) == MATERIALS
    for row in (0, 5, 11):
        changes = [f"{MATERIAL}={table[MATERIAL][row]}", f"{SECTION}={table[SECTION][row]}"]
        changes.append(f"A.clearance={float(table['A.clearance [m]'][row])!r} m")
        read = sd.read_case(case, changes)
        run = sd.simulate(read.mechanism, until=2e-3)
        bars = [str(bar) for bar in run["bar"].values]
        assert [table[f"{bar}.peak_bar_stress [Pa]"][row] for bar in bars] == list(np.abs(run["bar_largest_stress"].values))
        assert table["mass [kg]"][row] == sum(body.mass for body in read.mechanism.bodies)
        assert found.mechanism(row) == read.mechanism


def test_mass_is_that_of_sections_and_materials(found):
    """Closed form: two bars of density times area, and the slider."""
    density = dict(zip(MATERIALS, (7850.0, 2700.0, 4430.0), strict=True))
    area = dict(zip(SECTIONS, (60e-3**2 - 57e-3**2, 50e-3**2 - 46e-3**2), strict=True))
    bars = np.array([2 * 2.0 * density[m] * area[s] for m, s in zip(found.table[MATERIAL], found.table[SECTION], strict=True)])
    rest = found.table["mass [kg]"].values - bars
    assert rest == pytest.approx(rest[0], rel=1e-12)


def test_names_in_answers(found):
    """Contract: texts, tables and the mechanism of the best point have names, not their indices."""
    assert found.best[MATERIAL] == "aluminium"
    assert found.worst(1)[0].numbers[MATERIAL] == "steel"
    assert [part.youngs_modulus for part in found.design.components] == [70e9, 70e9]
    said = conclude(found, "x.db")
    assert (MATERIAL, "aluminium", "steel, aluminium, titanium", "aluminium, titanium") in said.point.rows
    assert f"{MATERIAL}=[aluminium]" in said.next[0][1]
    texts = (*said.trends.head, *(row[0] for row in said.trends.rows))
    assert f"{MATERIAL} = aluminium instead of steel" in texts
    assert any(cell.startswith("x 0.") for row in said.trends.rows for cell in row)


def test_trends_are_ratios_of_names(found):
    """Limit: the ratio of masses is between that of the densities and one, because of the slider."""
    trend = found.trends["mass"]
    k = trend.numbers.index(f"{MATERIAL} = aluminium instead of steel")
    assert 2700.0 / 7850.0 < np.exp(trend.slopes[k]) < 1.0


def test_store_with_names(case, found):
    """Contract: the same call finds all cases; the store knows the names; a refined study has some of them."""
    again = sd.study(case, **TWELVE, store=found.store.path, compute=False)
    assert again.counts["pending"] == 0
    opened = sd.open_study(found.store.path)
    assert opened.mechanism(7) == found.mechanism(7)
    fewer = refine_study(opened.built(), vary={MATERIAL: "[titanium]", SECTION: f"[{SECTIONS[1]}]", "A.clearance": "0.5 mm"})
    assert fewer.variants == (found.mechanism(11),)
    with pytest.raises(sd.InputError, match="did you mean 'titanium'"):
        refine_study(opened.built(), vary={MATERIAL: "[titan]"})


def test_export_writes_names(found, tmp_path):
    """Contract: CSV has the names, NetCDF their indices and the names as an attribute."""
    table = pd.read_csv(found.export(tmp_path / "names.csv"))
    assert list(table[SECTION][:4]) == [*SECTIONS, *SECTIONS]
    data = xr.open_dataset(found.export(tmp_path / "names.nc"))
    assert list(data[column(MATERIAL)].attrs["labels"]) == MATERIALS


def test_pictures_have_names_at_their_axes(found):
    """Contract: ticks are the names, each with a median, and maps have a cell for each pair."""
    axes = response_curves(found.points)
    assert [label.get_text() for label in axes[-3].get_xticklabels()] == MATERIALS
    medians = next(line for line in axes[0].lines if line.get_label() == "median")
    assert list(medians.get_xdata()) == [0.0, 1.0, 2.0]
    (drawn,) = feasibility_map(found.points, x=MATERIAL, y=SECTION, colour="mass")
    assert [label.get_text() for label in drawn.get_yticklabels()] == SECTIONS
    assert drawn.collections[0].get_array().size == 6


def test_search_over_names_tries_all(case):
    """Closed form: the lightest pair is aluminium with the smaller area."""
    found = sd.study(case, {MATERIAL: MATERIALS, SECTION: SECTIONS}, measures="mass", goals="minimise mass")
    assert found.counts["complete"] == 6
    assert found.best == {MATERIAL: "aluminium", SECTION: SECTIONS[0]}


def test_names_may_stand_for_objects():
    """Contract: named laws are the given objects, for chosen and uncertain factors."""
    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=5.0)
    laws = {"none": sd.NoFriction(), "lugre": sd.LuGre(kinetic=0.1)}
    dampings = {"lankarani-nikravesh": sd.LankaraniNikravesh(0.9), "flores": sd.Flores(0.9)}
    found = sd.study(arm, {"A.friction": laws}, until=1e-3, uncertain={"A.damping": dampings}, samples=4, sampling="random")
    names = found.table
    assert set(names["A.damping"]) == set(dampings)
    for row in range(8):
        made = arm.replace("A.friction", laws[names["A.friction"][row]]).replace("A.damping", dampings[names["A.damping"][row]])
        assert found.mechanism(row) == made


def test_wall_thickness_as_a_factor(case):
    """Identity: mass and stress of each wall are those of ``tube 60x60xW mm`` bit for bit; the wall is a number."""
    wall = f"{SECTION}.wall"
    found = sd.study(
        case,
        {wall: "1..3 mm, 3 values", MATERIAL: MATERIALS[:2], SECTION: [SECTIONS[0], "tube 70x60x9 mm"]},
        measures=["peak_bar_stress", "mass"],
        goals="minimise mass",
        requirements=["peak_bar_stress < 1 MPa"],
    )
    table = found.table
    assert list(table[f"{wall} [m]"].unique()) == [1e-3, 2e-3, 3e-3]
    for row in (0, 3, 6, 11):
        text = table[SECTION][row].rpartition("x")[0] + f"x{1e3 * table[f'{wall} [m]'][row]:g} mm"
        made = sd.read_case(case, [f"{SECTION}={text}", f"{MATERIAL}={table[MATERIAL][row]}"]).mechanism
        run = sd.simulate(made, until=2e-3)
        bars = [str(bar) for bar in run["bar"].values]
        assert [table[f"{bar}.peak_bar_stress [Pa]"][row] for bar in bars] == list(np.abs(run["bar_largest_stress"].values))
        assert table["mass [kg]"][row] == sum(body.mass for body in made.bodies)
    assert found.best == {wall: 1e-3, MATERIAL: "aluminium", SECTION: SECTIONS[0]}
    assert found.trends["mass"].numbers[0] == wall
    fewer = refine_study(found.built(), vary={wall: "2 mm", SECTION: f"[{SECTIONS[0]}]"})
    assert [each.components[0].axial_stiffness for each in fewer.variants] == pytest.approx(
        [modulus * (60e-3**2 - 56e-3**2) for modulus in (210e9, 70e9)], rel=1e-12
    )
    with pytest.raises(sd.InputError, match="values of the study: 1 mm, 2 mm, 3 mm"):
        refine_study(found.built(), vary={wall: "2.5 mm"})


def test_numbers_of_the_structure_vary(case):
    """Closed form: mass grows linearly with the bar length of the case file."""
    found = sd.study(case, {"structure.bar_length": "1, 2, 4 m"}, measures="mass")
    mass = found.table["mass [kg]"].values
    assert (mass[2] - mass[1]) == pytest.approx(2.0 * (mass[1] - mass[0]), rel=1e-12)
    assert list(found.table["structure.bar_length [m]"]) == [1.0, 2.0, 4.0]


def test_names_by_probability():
    """Closed form: names have equal or given probabilities."""
    u = np.linspace(0.0, 1.0, 10, endpoint=False) + 0.05
    assert list(sd.Names(("a", "b")).quantile(u)) == [0.0] * 5 + [1.0] * 5
    assert list(sd.Names(("a", "b", "c"), (0.2, 0.7, 0.1)).quantile(u)) == [0.0] * 2 + [1.0] * 7 + [2.0]


@pytest.mark.parametrize(
    ("vary", "more", "said"),
    [
        ({MATERIAL: ["steel", "aluminum"]}, {}, "'aluminum' .did you mean 'aluminium'"),
        ({"structure.bars.materiel": ["steel"]}, {}, "did you mean 'material'"),
        ({MATERIAL: ["steel", "steel"]}, {}, "the name 'steel' twice"),
        ({MATERIAL: []}, {}, "at least one"),
        ({"run.method": ["auto", "dopri5"]}, {}, "the names change the options of the runs"),
        ({MATERIAL: MATERIALS}, {"design": "morris", "points": 8}, "names, which have no order"),
        ({MATERIAL: MATERIALS[1:]}, {"design": "one-at-a-time"}, "names and levels that include those of the case"),
        ({MATERIAL: MATERIALS, "A.clearance": (1e-4, 2e-4)}, {"goals": "minimise mass"}, "lists of all that is chosen"),
        ({MATERIAL: MATERIALS}, {"goals": f"minimise {MATERIAL}"}, "a measure or a number as goal"),
        ({f"{SECTION}.wal": "1..3 mm"}, {}, "no 'wal' .did you mean 'wall'"),
        ({f"{SECTION}.wall": "1..40 mm"}, {}, "a wall below 30 mm"),
        ({f"{SECTION}.wall": "1..3 K"}, {}, "section.wall"),
        ({f"{SECTION}.wall": "norm(loc=1, scale=0.1) mm"}, {}, "a range with a number of values"),
        ({f"{SECTION}.wall": "1..3 mm, 65 values"}, {}, "65 combinations of"),
        ({"structure.units": list("12")}, {"measures": "peak_bar_stress"}, "measures of each bar"),
    ],
)
def test_refused_names(case, vary, more, said):
    """Contract: wrong names are refused before anything is computed."""
    with pytest.raises(sd.InputError, match=said):
        sd.study(case, vary, **more)
