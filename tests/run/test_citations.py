"""Citations of a run: every law, controller, component and method names publications of the bibliography."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.bibliography.reference import bibliography, references
from scissordyn.cli.main import status_of
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.integrate.method import METHODS
from scissordyn.laws.catalogue import BY_KIND, MATERIALS
from scissordyn.laws.oil import OILS
from scissordyn.model.options import TIME_STEPPING
from scissordyn.record.citations import METHODS as CITED
from scissordyn.record.citations import citations

ROOT = Path(__file__).parents[2]  # Root folder of the repository

# Source of each law, controller and component
SOURCES = {
    **{f"{kind} {name}": law.source for kind, known in BY_KIND.items() for name, law in known.items()},
    **{f"controller {name}": controller.source for name, controller in CONTROLLERS.items()},
}


@pytest.mark.parametrize("part", SOURCES)
def test_every_declared_source_is_in_the_bibliography(part):
    """Contract: each publication of a law or controller is found by its DOI, or by first author and year."""
    source = SOURCES[part]
    found = references(source)
    assert found or source.partition(";")[0] == "definition"
    assert all(each.key in bibliography() for each in found), [each.key for each in found]
    named = re.findall(r"10\.\d{4}/[^\s;,\"')]+(?:\)[^\s;,\"')]+)*", source)
    assert {doi.lower() for doi in named} <= {each.doi.lower() for each in found}


def test_components_and_methods_are_in_the_bibliography():
    """Contract: every reference of a component's description is found, and one for every method of integration."""
    from scissordyn.record.citations import _of_docstring

    named = [references(_of_docstring(kind)) for kind in COMPONENTS.values()]
    assert sum(map(bool, named)) >= 12
    assert all(each.key in bibliography() for found in named for each in found)
    assert {*METHODS, TIME_STEPPING} == set(CITED)
    assert set(CITED.values()) <= set(bibliography())


def test_two_spellings_find_the_same():
    """Contract: accents, umlauts, particles and the form of co-authors make no difference."""
    (astrom,) = references("Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7")
    assert references("Åström, Hägglund 1995") == (astrom,)
    assert [each.key for each in references("Braendlein, Eschmann 1995; Brändlein and co-workers 1995")] == ["braendlein1995"]
    assert [each.key for each in references("definition; K as in Flores and co-workers 2006")] == ["flores2006"]
    assert references("definition") == references("") == references("the user") == ()


def test_unknown_publications_are_cited_as_given():
    """Contract: the source of a user's law is neither lost nor taken for another publication."""
    (own,) = references("Doe 2031, doi:10.1000/xyz123")
    assert (own.doi, own.year) == ("10.1000/xyz123", 2031)
    assert "Doe 2031" in own.text
    assert "doi = {10.1000/xyz123}" in own.bibtex
    (other,) = references("Flores 1999, My thesis")
    assert "My thesis" in other.text


def test_bibliography_is_sound():
    """Contract: keys, years and DOIs find one entry each; text and BibTeX are complete, with balanced braces."""
    known = bibliography().values()
    dois = [each.doi.lower() for each in known if each.doi]
    assert len(dois) == len(set(dois))
    for each in known:
        assert references(f"x, doi:{each.doi}") == (each,) if each.doi else True
        assert each.title in each.text
        assert each.bibtex.startswith("@")
        assert each.bibtex.count("{") == each.bibtex.count("}")
        assert each.bibtex.isascii(), each.key
        assert not each.seen or each.doi


def run_of(name: str) -> object:
    """Return a short run of an example."""
    case = sd.read_case(ROOT / "examples" / f"{name}.toml")
    return sd.simulate(case.mechanism, **case.run.keywords | {"until": 1e-3, "samples": 2})


def test_citations_of_a_run():
    """Contract: a run cites its mechanism, laws, coordinates and method, and nothing else."""
    found = citations(run_of("paper"))
    uses = {each.reference.key: each.uses for each in found}
    assert uses["li2020"] == ("mechanism",)
    assert uses["liu2007"] == ("stiffness law liu",)
    assert uses["flores2011"] == ("damping law flores",)
    assert uses["canudas1995"] == ("friction law lugre",)
    assert uses["jalon1994"] == ("natural coordinates",)
    assert uses["steinebach2023"] == ("method rodas5p",)
    assert found.entries[0].reference.key == "scissordyn"
    assert found.entries[0].reference.version == sd.__version__
    assert uses["flores2006"] == ("material steel",)
    laws = {"liu2007", "flores2011", "canudas1995", "canudas1997", "flores2006"}
    assert set(uses) == {"scissordyn", "li2020", *laws, "jalon1994", "steinebach2023"}
    assert len(found) == len(uses)


def test_components_controllers_and_starts_are_cited():
    """Contract: an end stop, a controller's source, a static start, and the handbook of materials are cited."""
    lift = {each.reference.key: each.uses for each in citations(run_of("lift"))}
    assert "travel stop" in lift["flores2011"]
    assert lift["kelley1998"] == ("static equilibrium",)
    servo = {each.reference.key: each.uses for each in citations(run_of("solar_array"))}
    assert "controller feed-forward" in servo["astrom1995"]
    sources = [references(each.source) for each in (*MATERIALS.values(), *OILS.values())]
    assert any(found and found[0].key == "asm1990" for found in sources)


def test_law_without_a_publication(tmp_path):
    """Contract: a law without a publication is listed as such, also when its file is gone."""
    file = tmp_path / "my_laws.py"
    law = "def soft(indentation, stiffness):\n    return stiffness * indentation**1.5\n"
    file.write_text(f"import scissordyn as sd\n\n\n@sd.element(slot='stiffness')\n{law}", encoding="utf-8")
    case = sd.read_case(ROOT / "examples" / "paper.toml")
    own = case.mechanism.replace("A.stiffness", sd.law("stiffness", f"{file}:soft")(1e10))
    sd.save(sd.simulate(own, until=1e-3, samples=2), tmp_path / "run.nc")
    file.unlink()
    found = sd.load(tmp_path / "run.nc").scissordyn.citations()
    assert len(found.without) == 1
    assert "Without a publication" in str(found)
    assert "liu2007" not in {each.reference.key for each in found}


def test_command(tmp_path, capsys):
    """Contract: text and BibTeX of a saved run; bad input gives one line and status 2."""
    saved = tmp_path / "run.nc"
    sd.save(run_of("paper"), saved)
    assert status_of(["cite", str(saved)]) == 0
    text = capsys.readouterr().out
    assert "doi:10.1177/1369433220971728" in text
    assert "friction law lugre" in text
    assert status_of(["cite", str(saved), "--bibtex"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("@article{") >= 5
    target = tmp_path / "references.bib"
    assert status_of(["cite", str(saved), "-o", str(target)]) == 0
    assert target.read_text(encoding="utf-8") == printed[:-1]
    capsys.readouterr()
    for words in (
        ["cite", str(tmp_path / "none.nc")],
        ["cite", str(ROOT / "examples" / "paper.toml")],
        ["cite", str(saved), "-o", str(saved)],
    ):
        assert status_of(words) == 2
        assert capsys.readouterr().err.count("\n") == 1
