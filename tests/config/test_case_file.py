"""Case files: what they describe, and what is refused."""

import inspect
import math
from pathlib import Path
from typing import get_type_hints

import pytest

import scissordyn as sd
from scissordyn.casefile.structure import STRUCTURES, BuiltTable
from scissordyn.plugin.element import element_class

EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
SMALLEST_CASE = '[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms"\n'  # Smallest case file


def test_paper_case_is_the_one_built_in_python():
    """Cross-check: the file against the same case through the Python interface, to the last bit or two of a unit's factor."""
    case = sd.read_case(EXAMPLES / "paper.toml")
    array = sd.scissor(units=2, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=sd.degrees(30))
    clearance = sd.Clearance(
        0.5e-3,
        journal_radius=10e-3,
        bearing_length=15e-3,
        material=sd.STEEL,
        stiffness=sd.Liu(),
        damping=sd.Flores(restitution=0.9),
        friction=sd.LuGre(kinetic=0.05),
        reference="onset",
    )
    assert case.mechanism.joints == array.with_clearance("A", clearance).joints
    assert [body.name for body in case.mechanism.bodies] == [body.name for body in array.bodies]
    for read, built in zip(case.mechanism.bodies, array.bodies, strict=True):
        assert read.mass == built.mass
        assert read.placed_angle == pytest.approx(built.placed_angle, rel=1e-15)
        assert read.placed_position == pytest.approx(built.placed_position, rel=1e-15)
    motion = case.mechanism.drives[0].motion
    assert isinstance(motion, sd.ConstantSpeed)
    assert motion.speed == pytest.approx(sd.rpm(150), rel=1e-15)
    assert (case.run.until, case.run.start, case.run.trust) == (0.05, "concentric", False)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_are_whole(path):
    """Contract: each example is read, is moved by something, and begins with what it is."""
    mechanism = sd.read_case(path).mechanism
    assert mechanism.drives or mechanism.components
    assert path.read_text(encoding="utf-8").startswith("# ")


def test_the_slider_crank_meets_its_bearing_as_it_should():
    """Cross-check: the first contact of the example against the second formulation's, in docs/reference.md."""
    case = sd.read_case(EXAMPLES / "slider_crank.toml", ["run.until=0.4 ms", "run.samples=3"])
    run = sd.simulate(case.mechanism, **case.run.keywords)
    found = [float(run[name][0]) for name in ("contact_start", "approach_speed", "contact_angle")]
    assert found == pytest.approx([2.27286032e-4, 4.38578315, math.radians(177.912104)], rel=1e-7)
    assert float(run["peak_force"][0]) == pytest.approx(45872.3, rel=2e-6)


@pytest.mark.parametrize("kind", [kind for kind, table in STRUCTURES.items() if issubclass(table, BuiltTable)])
def test_every_argument_of_a_builder_has_its_key(kind):
    """Contract: keys and defaults of [structure] against the signature of the function, and a unit for every number."""
    table = STRUCTURES[kind]
    assert issubclass(table, BuiltTable)
    parameters = inspect.signature(table.function).parameters
    assert {name: field.default for name, field in table.declared_keys().items() if name not in ("kind", "bars", "source")} == {
        name: parameter.default for name, parameter in parameters.items()
    }
    numbers = [name for name, hint in get_type_hints(table.function).items() if hint in (float, float | None)]
    assert all(table.declared_keys()[name].quantity is not None for name in numbers)


def test_left_out_keys_take_the_defaults_of_the_model(case_of):
    """Contract: the shortest case file against the defaults in Python."""
    case = case_of(SMALLEST_CASE + '[[clearance]]\njoint = "A"\nclearance = "1 mm"\n')
    assert case.mechanism == sd.scissor().with_clearance("A", sd.Clearance(1e-3))
    assert (case.run.samples, case.run.rtol, case.run.method) == (2001, 1e-8, "auto")


def test_laws_and_materials_by_name_and_by_table(case_of):
    """Contract: names, tables of parameters with units, and the restitution of the joint."""
    text = """
[[clearance]]
joint = "A"
clearance = "1 mm"
restitution = 0.6
stiffness = "hertz"
damping = { law = "lankarani-nikravesh" }
friction = { law = "lugre", kinetic = 0.1, stribeck_speed = "2 mm/s", bristle_stiffness = "2e5 1/m" }
material = { youngs_modulus = "70 GPa", poisson_ratio = 0.33, density = "2.7 g/cm^3" }
bearing_material = "steel"
"""
    gap = case_of(SMALLEST_CASE + text).mechanism.joint("A").clearance
    assert gap is not None
    assert gap.stiffness == sd.Hertz()
    assert gap.damping == sd.LankaraniNikravesh(restitution=0.6)
    assert gap.friction == sd.LuGre(kinetic=0.1, stribeck_speed=2e-3, bristle_stiffness=2e5)
    assert isinstance(gap.material, sd.Material)
    assert gap.material.youngs_modulus == pytest.approx(70e9, rel=1e-15)
    assert gap.material.density == pytest.approx(2700.0, rel=1e-15)
    assert gap.bearing_material == sd.STEEL


def test_tables_of_motion_from_file_and_inline_agree(tmp_path, case_of):
    """Cross-check: the same table in a file beside the case file, and in the case file."""
    (tmp_path / "motion.csv").write_text("time [ms], angle [deg]\n0, 30\n10, 31\n20, 34\n\n30, 39\n40, 46\n50, 55\n")
    from_file = case_of(SMALLEST_CASE + '[drive]\ntable = "motion.csv"\n').mechanism.drives[0].motion
    text = '[drive]\ntable = { time = "0 10 20 30 40 50 ms", angle = "30 31 34 39 46 55 deg" }\n'
    inline = case_of(SMALLEST_CASE + text).mechanism.drives[0].motion
    assert isinstance(from_file, sd.Tabulated)
    assert from_file == inline
    assert from_file.times[-1] == pytest.approx(0.05, rel=1e-15)
    assert from_file.values[0] == pytest.approx(math.pi / 6.0, rel=1e-15)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("0, 30\n1, 31\n", "does not begin with the heading"),
        ("time [ms], angle [mm]\n0, 30\n", "wrong dimension"),
        ("time [ms], angle [deg]\n0, 30\n1, thirty\n", "line 3 does not have two numbers"),
        ("time [ms], angle [deg]\n0, 30, 1\n", "line 2"),
        ("time [ms], angle [deg]\n0, 30\n1, 31\n", "2 times and 2 values"),
        ("time [ms], angle [deg]\n0 30\n1 31\n2 nan\n3 3\n4 4\n5 5\n", "several numbers from"),
        ("", "does not begin with the heading"),
    ],
)
def test_a_bad_table_of_motion_is_refused(tmp_path, content, reason, case_of):
    """Contract: the message names the file, or the line in it."""
    (tmp_path / "motion.csv").write_text(content)
    with pytest.raises(sd.InputError, match=r"drive\.table") as caught:
        case_of(SMALLEST_CASE + '[drive]\ntable = "motion.csv"\n')
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("change", "place", "says"),
    [
        ("drive.sped=150 rpm", "drive", "did you mean 'speed'"),
        ("strukture.units=3", "", "did you mean 'structure'"),
        ("structure.angle=30", "structure.angle", 'for example angle = "30 deg"'),
        ("clearance.A.journal_radius='10'", "clearance.A.journal_radius", 'for example journal_radius = "10 mm"'),
        ("drive.speed=150", "drive.speed", 'for example speed = "150 rpm"'),
        ("clearance.A.stiffness=xyz", "clearance.A.stiffness", 'for example stiffness = "liu"'),
        ("clearance.A.stiffness=hertzz", "clearance.A.stiffness", 'for example stiffness = "hertz"'),
        ("clearance.A.clearance=0.0005", "clearance.A.clearance", 'for example clearance = "0.0005 m"'),
        ("clearance.A.clearance=0.5 s", "clearance.A.clearance", "wrong dimension"),
        ("clearance.A.clearance=-0.5 mm", "clearance.A.clearance", "from 1e-12 to 1e+06 [m]"),
        ("clearance.A.clearance=nan mm", "clearance.A.clearance", "a number from 1e-12"),
        ("clearance.A.clearance=20 mm", "clearance.A", "smaller than the journal radius"),
        ("structure.angle=95 deg", "structure", "cannot be assembled"),
        ("structure.units=2.5", "structure.units", "whole number"),
        ("structure.units=0", "structure.units", "a number from 1 to 10000"),
        ("structure.kind=sissor", "structure.kind", "did you mean 'scissor'"),
        ("structure.driven_bar=C", "structure.driven_bar", "'pinned' or 'slider'"),
        ("clearance.A.joint=unit 1/pvot", "clearance.unit 1/pvot", "did you mean 'unit 1/pivot'"),
        ("clearance.A.friction=lugr", "clearance.A.friction", "did you mean 'lugre'"),
        ("clearance.A.material=stel", "clearance.A.material", "did you mean 'steel'"),
        ("clearance.A.friction.kinetik=0.1", "clearance.A.friction", "did you mean 'kinetic'"),
        ("clearance.A.friction.kinetic=-0.1", "clearance.A.friction.kinetic", "from 1e-06"),
        ("clearance.A.friction.static=0.01", "clearance.A.friction", "static >= kinetic"),
        ('clearance.A.material={youngs_modulus="200 GPa"}', "clearance.A.material", "missing key 'poisson_ratio'"),
        ("clearance.A.restitution=1.5", "clearance.A.restitution", "to 1"),
        ('clearance.A.restitution="0.9"', "clearance.A.restitution", "plain number"),
        ('clearance.A.damping={law="flores", restitution=0.5}', "clearance.A.damping", "for the joint and for its damping"),
        ("clearance.A.stiffness=3", "clearance.A.stiffness", "the stiffness law has no name"),
        ("clearance=3", "clearance", "[[clearance]]"),
        ("drive=3", "drive", "not a table"),
        ("drive.body=unit 1/bar 9", "drive", "did you mean"),
        ("drive.body=slider", "drive", "does not rotate"),
        ('drive.harmonic={mean="1 deg", amplitude="1 deg", angular_frequency="1 Hz"}', "drive", "exactly one of"),
        ("drive.table=none.csv", "drive.table", "cannot read"),
        ("run.start=concentrik", "run.start", "did you mean 'concentric'"),
        ("run.samples=1", "run.samples", "from 2"),
        ("run.method=rodas", "run", "did you mean 'rodas5p'"),
        ("run.trust=1", "run.trust", "true or false"),
    ],
)
def test_bad_values_are_refused_with_their_place(change, place, says):
    """Contract: the message names the file and the place, and says what is allowed."""
    path = EXAMPLES / "paper.toml"
    with pytest.raises(sd.InputError) as caught:
        sd.read_case(path, [change])
    message = str(caught.value)
    assert message.startswith(f"{path}: {place}")
    assert says in message
    assert "expected " in message
    assert "\n" not in message


def test_unreadable_files_are_refused(tmp_path):
    """Contract: no file, a folder, and bytes that are no text."""
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    for path, says in (
        (tmp_path / "no.toml", "No such file"),
        (tmp_path, "it is a folder"),
        (tmp_path / "bytes.toml", "not a text"),
    ):
        with pytest.raises(sd.InputError, match=says):
            sd.read_case(path)


# Python file with a user-defined stiffness law
USER_LAW = """
import scissordyn as sd


@sd.element(slot='stiffness')
def soft(indentation, k, n=1.5):
    return k * indentation**n
"""


def test_a_law_in_the_users_own_file(tmp_path, case_of):
    """Contract: the file beside the case file is found, numbers of its law reach the function, a missing one is named."""
    (tmp_path / "my_laws.py").write_text(USER_LAW)
    law = '{ law = "my_laws.py:soft", k = 2e9 }'
    gap = (
        case_of(SMALLEST_CASE + f'[[clearance]]\njoint = "A"\nclearance = "1 mm"\nstiffness = {law}\n')
        .mechanism.joint("A")
        .clearance
    )
    assert gap is not None
    assert gap.stiffness == element_class("stiffness", "my_laws.py:soft", tmp_path)(2e9)
    assert gap.stiffness.parameters() == (2e9, 1.5)
    with pytest.raises(sd.InputError, match=r"clearance\.A\.stiffness .*did you mean 'soft'"):
        sd.read_case(tmp_path / "case.toml", ["clearance.A.stiffness=my_laws.py:sof"])
    with pytest.raises(sd.InputError, match=r"stiffness\.k = \"1 N\": text instead of a plain number"):
        sd.read_case(tmp_path / "case.toml", ['clearance.A.stiffness={ law = "my_laws.py:soft", k = "1 N" }'])


def test_a_clearance_guide_and_its_laws(case_of):
    """Contract: [[guide_clearance]] against the same clearance guide in Python, by size and by corners."""
    slider = '[structure]\nkind = "slider-crank"\nslider_inertia = "2e-5 kg m^2"\n[drive]\nspeed = "60 rpm"\n'
    table = '[[guide_clearance]]\nguide = "guide"\nclearance = "0.1 mm"\nrestitution = 0.7\n'
    end = '[run]\nuntil = "1 ms"\n'
    built = sd.slider_crank(slider_inertia=2e-5).driven(speed=sd.rpm(60))
    described = {"corner_radius": 2e-3, "damping": sd.Flores(0.7), "friction": sd.LuGre(0.1)}
    friction = 'corner_radius = "2 mm"\nfriction = { law = "lugre", kinetic = 0.1 }\n'
    sized = slider + table + 'length = "40 mm"\nwidth = "20 mm"\n' + friction + end
    wanted = built.with_clearance("guide", sd.GuideClearance(1e-4, 0.04, 0.02, **described))
    assert case_of(sized).mechanism.contact_points == wanted.contact_points
    outlined = slider + table + 'corners = ["-0.018, -0.008 m", "0.018, -0.008 m", "0, 0.009 m"]\n' + friction + end
    corners = ((-0.018, -0.008), (0.018, -0.008), (0.0, 0.009))
    wanted = built.with_clearance("guide", sd.GuideClearance(1e-4, corners=corners, **described))
    assert case_of(outlined).mechanism.contact_points == wanted.contact_points
    changed = case_of(sized, ["guide_clearance.guide.clearance=0.2 mm"]).mechanism
    assert changed.guide("guide").clearance == sd.GuideClearance(2e-4, 0.04, 0.02, **described)
    with pytest.raises(sd.InputError, match=r"guide_clearance\.guide.*liu.*plane guide surface"):
        case_of(sized, ['guide_clearance.0.stiffness="liu"'])


def test_addresses_reach_what_the_file_makes():
    """Contract: the parameter paths of Python and of studies change a case too, by the names of parts, with units."""
    path = EXAMPLES / "paper.toml"
    case = sd.read_case(path, ["A.clearance=0.2 mm", "unit 1/bar 2.mass=6 kg", "body.slider.mass=4 kg", "drive.speed=100 rpm"])
    assert case.mechanism.joint("A").clearance.clearance == pytest.approx(2e-4, rel=1e-15)
    assert (case.mechanism.body("unit 1/bar 2").mass, case.mechanism.body("slider").mass) == (6.0, 4.0)
    assert sd.read_case(path, ["A.clearance=0.2 mm"]).mechanism == sd.read_case(path).mechanism.replace("A.clearance", 0.2e-3)
    for change, says in (("unit 1/bar 9.mass=6 kg", "no part"), ("slider.mass=6 m", "kg"), ("slider.points=3", "not a number")):
        with pytest.raises(sd.InputError, match=says):
            sd.read_case(path, [change])
