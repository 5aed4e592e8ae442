"""The JSON Schema of case and study files takes what the program takes, and refuses what it refuses, as far as it can see."""

import copy
import json
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

import scissordyn as sd
from scissordyn.casefile.case import CaseTable
from scissordyn.casefile.part import PARTS
from scissordyn.casefile.quantity import SI_UNITS, NumbersText, unit_factor
from scissordyn.casefile.structure import STRUCTURES
from scissordyn.casefile.table import instance
from scissordyn.config.schema import pattern_of, schema
from scissordyn.config.study import StudyText
from scissordyn.config.template import template

ROOT = Path(__file__).parents[2]  # Root folder of the repository
IGNORED_FOLDERS = {".venv", "out", "build"}  # Folders without files of the project
# Content of all TOML files of the project, by path
FILES = {
    path: tomllib.loads(path.read_text(encoding="utf-8"))
    for path in sorted(ROOT.glob("**/*.toml"))
    if not IGNORED_FOLDERS & set(path.relative_to(ROOT).parts)
}
# Paths of the case files of the project
CASES = [path for path, tree in FILES.items() if isinstance(tree.get("structure"), dict)]
STUDIES = [path for path, tree in FILES.items() if isinstance(tree.get("case"), str)]  # Paths of the study files of the project


@cache
def validator_of(kind):
    """Return the validator of a kind of file, with the schema of the program; a fixture is made again for each parameter."""
    made = schema(kind)
    Draft7Validator.check_schema(made)
    return Draft7Validator(made)


@pytest.fixture(params=["case"])
def validator(request):
    return validator_of(request.param)


@pytest.mark.parametrize(
    ("validator", "tree"),
    [
        *(pytest.param("case", FILES[path], id=str(path.relative_to(ROOT))) for path in CASES),
        *(pytest.param("study", FILES[path], id=str(path.relative_to(ROOT))) for path in STUDIES),
        *(pytest.param("case", tomllib.loads(template(kind)), id=kind) for kind in STRUCTURES),
    ],
    indirect=["validator"],
)
def test_what_the_program_reads_is_valid(validator, tree):
    """Contract: every case and study of the repository, and a printed case of each structure."""
    assert not list(validator.iter_errors(tree))


def test_samples_of_every_key_are_valid(validator):
    """Contract: the example that help shows for each key of each table is one that the schema takes."""
    definitions, checked = validator.schema["definitions"], 0
    for section, part in PARTS.items():
        table = part.table
        properties = validator.schema["properties"][section]
        reference = next((value for key, value in _walk(properties) if key == "$ref"), None)
        if reference is None:  # [[component]], whose keys depend on its type
            continue
        written = definitions[reference.rpartition("/")[2]]
        for key in table.declared_keys():
            text = table.declared_keys()[key].sample
            if text and text not in ("None", '""'):
                value = tomllib.loads(f"x = {text}")["x"]
                if value == []:  # the default of a key that is left out
                    continue
                one = {**written["properties"][key], "definitions": definitions}
                assert not list(Draft7Validator(one).iter_errors(value)), (section, key, value)
                checked += 1
    assert checked > 100


def _walk(schema):
    if isinstance(schema, dict):
        for key, value in schema.items():
            yield key, value
            yield from _walk(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from _walk(value)


def test_every_key_says_what_it_is(validator):
    """Contract: editors show a description of every key of structures, parts and options."""
    tables = [
        name for name in validator.schema["definitions"] if name in ("scissor", "four_bar", "Options", "Body", "Clearance")
    ]
    assert len(tables) == 5
    for name in tables:
        for key, value in validator.schema["definitions"][name]["properties"].items():
            assert value.get("description"), (name, key)


WRONG = [
    # structure
    ("paper", "structure.kind", "scisor"),
    ("paper", "structure.units", "two"),
    ("paper", "structure.units", 2.5),
    ("paper", "structure.units", 0),
    ("paper", "structure.bar_length", 2.0),
    ("paper", "structure.bar_length", "2 kg"),
    ("paper", "structure.bar_length", "-2 m"),
    ("paper", "structure.bar_length", "2"),
    ("paper", "structure.bar_mass", "5.68 m"),
    ("paper", "structure.angle", "30 mm"),
    ("paper", "structure.gravity", "9.81 m"),
    ("paper", "structure.gravity", True),
    ("paper", "structure.driven_bar", "both"),
    ("paper", "structure.barlength", "2 m"),
    ("paper", "structure", 3),
    # drive
    ("paper", "drive.speed", "150 mm"),
    ("paper", "drive.speed", 150),
    ("paper", "drive.harmonic", {"mean": "45 deg"}),
    ("paper", "drive.speeed", "150 rpm"),
    ("paper", "drive", "150 rpm"),
    # clearance
    ("paper", "clearance.0.clearance", "0.5 s"),
    ("paper", "clearance.0.clearance", 0.0005),
    ("paper", "clearance.0.clearance", "0,5 mm"),
    ("paper", "clearance.0.material", "cheese"),
    ("paper", "clearance.0.stiffness", "lui"),
    ("paper", "clearance.0.damping", {"law": "flores", "restitutoin": 0.9}),
    ("paper", "clearance.0.restitution", 1.5),
    ("paper", "clearance.0.restitution", "0.9"),
    ("paper", "clearance.0.friction", {"kinetic": 0.05}),
    ("paper", "clearance.0.friction", {"law": "lugre", "kinetic": -0.05}),
    ("paper", "clearance.0.joint", 1),
    ("paper", "clearance", {"joint": "A"}),
    # run
    ("paper", "run.until", "50 mm"),
    ("paper", "run.until", None),
    ("paper", "run.start", "anywhere"),
    ("paper", "run.samples", "many"),
    ("paper", "run.samples", 1),
    ("paper", "run.rtol", 1.0),
    ("paper", "run.trust", "yes"),
    ("paper", "runs", {"until": "50 ms"}),
    # parts, controllers, guides
    ("press", "body.0.mass", "1 m"),
    ("press", "body.0.points", {"tip": "0.2 m"}),
    ("press", "body.0.points", {"a.b": "0.2, 0 m"}),
    ("press", "body.0.name", None),
    ("press", "joint.0.journal", "crank"),
    ("press", "joint.0.bearing", None),
    ("press", "ground.0.position", "0, 0, 0 m"),
    ("controlled", "control.controller", {"name": "pidd"}),
    ("controlled", "control.controller", "pidd"),
    ("controlled", "control.feed_forward", "perfect"),
    ("clearance_guide", "guide_clearance.0.clearance", "1 N"),
    ("self_deploying", "torsion_spring.0.stiffness", "2 N/m^2 kgg"),
    ("self_deploying", "torsion_spring.0.body", None),
]
"""Files with one fault each: the example, the place of the fault, and the wrong value there; None deletes the value."""

assert len(WRONG) >= 50, "as many as docs/claims.md says"


def spoilt(name, place, value):
    """Return an example with one fault."""
    tree = tomllib.loads((ROOT / "examples" / f"{name}.toml").read_text(encoding="utf-8"))
    *path, last = (int(word) if word.isdigit() else word for word in place.split("."))
    inner = tree
    for word in path:
        inner = inner[word]
    if value is None:
        del inner[last]
    else:
        inner[last] = copy.deepcopy(value)
    return tree


@pytest.mark.parametrize(("name", "place", "value"), WRONG, ids=lambda each: str(each)[:30])
def test_wrong_files_are_refused(validator, name, place, value):
    """Contract: the schema and the program refuse each of fifty files with one fault, and the schema says where."""
    tree = spoilt(name, place, value)
    errors = list(validator.iter_errors(tree))
    assert errors
    first = str(place.split(".")[0])
    assert any(first in map(str, error.absolute_path) or first in error.message for error in errors)
    with pytest.raises(sd.InputError):
        instance(CaseTable, tree, {"folder": ROOT / "examples"}).case()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("measures", "peak_force"),
        ("members", "3"),
        ("vary", {"A.clearance": 3}),
        ("case", None),
        ("desing", {"kind": "grid"}),
        ("set", [1]),
    ],
)
@pytest.mark.parametrize("validator", ["study"], indirect=True)
def test_wrong_studies_are_refused(validator, key, value):
    """Contract: the schema and the program refuse studies with one fault."""
    tree = tomllib.loads((ROOT / "examples/studies/solar_array.toml").read_text(encoding="utf-8"))
    if value is None:
        del tree[key]
    else:
        tree[key] = value
    assert list(validator.iter_errors(tree))
    with pytest.raises(sd.InputError):
        instance(StudyText, tree, {"folder": ROOT})


# Units that the schema accepts
UNITS = "m mm inch ft s ms min kg g t rad deg ° turn rpm Hz N kN lbf Pa MPa bar J kW degC K".split()  # noqa: SIM905
# Composed units that the schema accepts
COMPOSED = "N/m,kN/mm,N m,N*m,N m s/rad,kg m^2,kg*m**2,mm²,1/s,m/s^2,N/(m/s),kg/m³,N m/(rad s)".split(",")  # noqa: SIM905


@pytest.mark.parametrize("unit", sorted({*SI_UNITS, "m"} - {"1"}))
def test_patterns_take_every_unit_that_fits(unit):
    """Contract: of many units a pattern takes those that the program converts, and of single ones no other."""
    pattern = re.compile(pattern_of(NumbersText(unit)))
    for typed in (*UNITS, *COMPOSED):
        try:
            fits = bool(unit_factor(typed, unit)) or True
        except sd.InputError:
            fits = typed == "degC" and unit == "K"
        found = pattern.search(f"-1.5e3 {typed}") is not None
        assert found or not fits, typed
        assert not found or fits or typed in COMPOSED, typed
    assert not pattern.search("1.5")
    assert not pattern.search("1.5 furlong")
    assert not re.search(pattern_of(NumbersText(unit, negative=False)), f"-1 {unit}")
    assert re.search(pattern_of(NumbersText(unit, negative=False)), f"-0.0 {unit}")


def test_command_prints_and_writes(tmp_path):
    """Contract: the command writes what the function gives, and no other kind of file."""
    from scissordyn.cli.main import status_of

    path = tmp_path / "study.json"
    assert status_of(["schema", "study", "-o", str(path)]) == 0
    assert json.loads(path.read_text(encoding="utf-8")) == schema("study")
    assert status_of(["schema", "study", "-o", str(path)]) == 0
    assert status_of(["schema", "cases"]) == 2
    (tmp_path / "other.json").write_text("{}")
    assert status_of(["schema", "study", "-o", str(tmp_path / "other.json")]) == 2
