"""The mechanisms of the zoo: each runs, and gives the numbers that it declares."""

import importlib.metadata
import math
from functools import cache

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from collection.closed_forms import CLOSED_FORMS
from reference.balance import Balance
from scissordyn.bibliography.reference import bibliography
from scissordyn.casefile.quantity import read_quantity
from scissordyn.cli.main import status_of
from scissordyn.collection.catalogue import DECLARATION, ENTRIES_FOLDER, Zoo, read_entry

NAMES = tuple(sd.zoo)  # Names of all mechanisms of the zoo

WRITTEN = 1e-10  # Largest relative difference of a declared value from the exact one; values have twelve digits


@pytest.mark.parametrize("name", NAMES)
def test_declared_numbers_are_met(name):
    """Cross-check: every declared number of a mechanism, by its run with ideal joints or with clearance."""
    for one in sd.zoo[name].check():
        assert one.met, f"{one.number.what}: {one.found} instead of {one.expected} +- {one.tolerance} {one.unit}"


@pytest.mark.parametrize("name", NAMES)
def test_declared_closed_forms_are_those_of_the_formula(name):
    """Closed form: what is declared is what formulas and circles that meet give, without an equation of the package."""
    entry = sd.zoo[name]
    values = CLOSED_FORMS[name]()
    assert len(values) == len(entry.numbers)
    for number, value in zip(entry.numbers, values, strict=True):
        assert (value is None) == (number.origin != "closed form"), number.what
        if value is not None:
            unit = number.value.partition(" ")[2]
            assert read_quantity(number.value, sd.Quantity(unit)) == pytest.approx(float(value), rel=WRITTEN, abs=1e-15), (
                number.what
            )


@cache
def run_of(name):
    """Return a short run of a mechanism with its clearances."""
    case = sd.zoo[name].case
    return sd.simulate(case.mechanism, **case.run.keywords | {"until": case.run.until / 20.0, "samples": 11})


@pytest.mark.parametrize("name", NAMES)
def test_each_runs_with_its_clearances(name):
    """Contract: the case runs to its end, its energy balance closes, forces are what bodies need."""
    run = run_of(name)
    assert run.attrs["status"] == "complete"
    scale = float(run["kinetic_energy"].max() + abs(run["drive_work"]).max() + abs(run["potential_energy"]).max())
    assert float(abs(run["energy_residual"]).max()) <= 1e-5 * max(scale, 1e-12)
    assert max(Balance(run, sd.zoo[name].mechanism).residual()) < 1e-9


def test_files_of_the_zoo(tmp_path):
    """Identity: files are the runs, with every variable of the zoo in every form: type, and no, one or more values in a row."""
    saved = set()
    for name in sorted(NAMES, key=lambda name: -len(run_of(name).variables)):
        run = run_of(name)
        forms = {
            (key, variable.dtype.kind, tuple((axis, min(size, 2)) for axis, size in variable.sizes.items()))
            for key, variable in run.variables.items()
        } | {(key, type(value)) for key, value in run.attrs.items()}
        if forms - saved:
            xr.testing.assert_identical(sd.load(sd.save(run, tmp_path / f"{name}.nc")), run)
            saved |= forms


def test_squeezer_has_the_published_angles():
    """Published number: the test set's angles at 0.03 s, as `validation/squeezer` has them."""
    from validation.squeezer.reference import TEST_SET

    declared = [read_quantity(number.value, sd.Quantity("rad")) for number in sd.zoo["a03-squeezer"].numbers]
    assert declared == [pytest.approx(TEST_SET[k], rel=1e-15) for k in (0, 2, 6)]


def test_woodpecker_touches_the_pole_when_its_free_flight_does():
    """Cross-check: instant and speed of the first contact as declared, by Lagrange's equations of the free flight."""
    from reference.woodpecker import first_contact

    declared = [read_quantity(each.value, sd.Quantity(each.value.split()[1])) for each in sd.zoo["woodpecker"].numbers]
    assert first_contact(np.array([0.0, 0.0, 0.0, 0.0, 0.0, -0.34, 0.0, -7.5])) == pytest.approx(declared, rel=2e-9)


@pytest.mark.slow
def test_woodpecker_descends_as_its_page_says_with_rigid_contact():
    """Cross-check: 154 mm/s by Moreau's time stepping in Glocker's coordinates, 0.3 million steps."""
    from reference.woodpecker import march

    heights, hits = march(np.zeros(3), np.array([-0.34, 0.0, -7.5]), 1e-5, 3.0, np.full(3, 0.3))
    assert heights[2 * (len(heights) // 3)] - heights[-1] == pytest.approx(0.154, abs=1e-3)
    assert len(hits) > 15


def test_names_are_found_however_they_are_spelt():
    """Contract: spaces, hyphens, underscores and capital letters make no difference; every sequence method agrees."""
    assert sd.zoo["flores slider-crank"].name == sd.zoo["Flores_Slider-Crank"].name == "flores-slider-crank"
    assert "Flores slider crank" in sd.zoo
    assert "slider" not in sd.zoo
    assert len(NAMES) == len(sd.zoo) >= 24
    with pytest.raises(sd.InputError, match=r"did you mean 'peaucellier'\?"):
        sd.zoo["peaucelier"]


def test_every_entry_is_whole():
    """Contract: a source or a word on where its sizes are from, a licence, numbers; no case file that no entry has."""
    used = set()
    for entry in sd.zoo.values():
        assert entry.title
        assert entry.licence
        assert entry.references or "own" in entry.about or "boim" in entry.about, entry.name
        assert all(reference.key in bibliography() for reference in entry.references), entry.name
        used.add(entry.case_file.parent)
    assert {path.parent for path in ENTRIES_FOLDER.rglob("case.toml")} <= used


# File `zoo.toml` of a mechanism that a test adds to the zoo
DECLARED = """title = "A pendulum"
kind = "toy"
about = "Own sizes."

[[number]]
what = "start"
variable = "position"
where = { body = "mass", axis = "x" }
at = "start"
value = "-1 m"
tolerance = "1 nm"
origin = "closed form"
reason = "as placed"
"""


def made(folder, name, text=DECLARED):
    """Write a mechanism with this text to a folder of mechanisms; return the folder."""
    place = folder / name
    place.mkdir(parents=True)
    (place / DECLARATION).write_text(text, encoding="utf-8")
    (place / "case.toml").write_text(sd.zoo["a01-pendulum"].text, encoding="utf-8")
    return folder


class Point:
    """Stand-in for an entry point by which another package offers its elements."""

    name = "theirs"
    dist = None

    def __init__(self, value):
        self.value = value

    def load(self):
        """Return the object that it names, or raise the error of its import."""
        if isinstance(self.value, Exception):
            raise self.value
        return self.value


def test_other_packages_add_theirs(tmp_path, monkeypatch):
    """Contract: by an entry point; a package that fails, or that takes a name of ours, is named and does no harm."""
    theirs, taken = made(tmp_path / "one", "swing"), made(tmp_path / "two", "peaucellier")
    points = [Point(theirs), Point(taken), Point(ImportError("no module named 'gone'")), Point(tmp_path / "empty")]
    monkeypatch.setattr(
        "scissordyn.collection.catalogue.entry_points", lambda group: points if group == "scissordyn.zoo" else []
    )
    found = Zoo()
    assert len(found) == len(NAMES) + 1
    assert found["swing"].package == "theirs"
    assert all(one.met for one in found["swing"].check())
    assert found["peaucellier"].case_file.is_relative_to(ENTRIES_FOLDER)
    clash, broken, empty = found.problems
    assert "'peaucellier' is the name of a mechanism of scissordyn" in clash
    assert "no module named 'gone'" in broken
    assert "has no subfolder with a file zoo.toml" in empty
    assert importlib.metadata.entry_points(group="scissordyn.zoo") is not None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kind = "toy"', 'kind = "toys"', "did you mean 'toy'?"),
        ('title = "A pendulum"\n', "", "missing key 'title'"),
        ('what = "start"', 'wath = "start"', "did you mean 'what'?"),
        ('origin = "closed form"', 'origin = "a guess"', "origin"),
        ('where = { body = "mass", axis = "x" }', 'where = "mass"', "not a table of names"),
        ('about = "Own sizes."', 'about = "Own sizes."\nexample = "nothing"', "does not exist"),
        ("[[number]]", "[[number", "not valid TOML"),
        ('variable = "position"', 'variable = "positon"', "did you mean 'position'?"),
        ('axis = "x"', 'axis = "z"', "unknown axis 'z'"),
        ('body = "mass", axis = "x"', 'body = "mass"', "has the dimensions axis"),
        ('body = "mass"', 'joint = "mass"', "has no dimension 'joint'"),
        ('\nat = "start"', '\nat = "1.2345678 ms"', "between two samples"),
        ('value = "-1 m"', 'value = "-1 kg"', "'-1 kg'"),
    ],
)
def test_wrong_declarations_are_one_line(tmp_path, old, new, said):
    """Bad input: a fault is named with its file, a number that a run does not have, or in another unit, with its name."""
    assert old in DECLARED
    folder = made(tmp_path, "swing", DECLARED.replace(old, new, 1))
    with pytest.raises(sd.InputError) as caught:
        read_entry(folder / "swing", "theirs").check()
    assert said in str(caught.value)
    assert DECLARATION in str(caught.value) or "number 'start'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_wrong_number_is_not_met(tmp_path):
    """Contract: the comparison can fail."""
    folder = made(tmp_path, "swing", DECLARED.replace('"-1 m"', '"-1.1 m"'))
    (found,) = read_entry(folder / "swing", "theirs").check()
    assert not found.met
    assert found.difference == pytest.approx(0.1)
    assert math.isclose(found.tolerance, 1e-9)


def test_commands(tmp_path, answer, capsys):
    """Contract: list, show, print, copy, check; bad input is one line and status 2."""
    assert status_of(["zoo"]) == 0
    first = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.split()]
    assert [word for word in first if word in NAMES] == list(NAMES)
    shown = answer("zoo", "peaucellier")
    assert "Lipkin 1871" in shown
    assert "0.25 m" in shown
    assert status_of(["zoo", "Peaucellier", "--case"]) == 0
    assert capsys.readouterr().out == sd.zoo["peaucellier"].text
    copy = tmp_path / "mine.toml"
    answer("zoo", "peaucellier", "-o", copy)
    assert "exists with other content" in answer("zoo", "umbrella", "-o", copy, status=2)
    assert copy.read_text(encoding="utf-8") == sd.zoo["peaucellier"].text
    assert answer("zoo", "peaucellier", "--check").count(" met") == 3
    for words in (["peaucelier"], ["--case"]):
        assert answer("zoo", *words, status=2)


def test_all_are_checked_without_a_name(tmp_path, answer, monkeypatch):
    """Contract: a table for each mechanism, and status 3 where one number of one of them differs."""
    right = read_entry(made(tmp_path, "swing", DECLARED) / "swing", "theirs")
    wrong = read_entry(made(tmp_path, "other", DECLARED.replace('"-1 m"', '"-1.1 m"')) / "other", "theirs")
    for entries, status in ((("peaucellier",), 0), (("peaucellier", "other"), 3)):
        known = {"peaucellier": right, "other": wrong}
        monkeypatch.setattr("scissordyn.collection.catalogue.zoo", {name: known[name] for name in entries})
        assert answer("zoo", "--check", status=status).count("allowed") == len(entries)
