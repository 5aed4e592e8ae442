"""Documentation: links, numbered equations, public names, the README, and tutorials that run."""

import ast
import doctest
import importlib
import importlib.util
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.bibliography.reference import bibliography, dois

ROOT = Path(__file__).parents[2]  # Root folder of the repository
DOCS = ROOT / "docs"  # Folder of the documentation
GENERATED = ("api/", "components/", "validation/", "theory/catalogue.md")  # Beginnings of the paths of generated pages
# Pages that are written by hand
PAGES = sorted(path for path in DOCS.rglob("*.md") if not str(path.relative_to(DOCS)).startswith(GENERATED))
README = ROOT / "README.md"  # Path of the README
NUMBERED = re.compile(r"\\tag\{([A-Z]\d+)\}")  # Pattern of the number of an equation in docs/theory


def name(path):
    return str(path.relative_to(ROOT))


def blocks(text, language):
    """Return the blocks of code in a language, without the tags of cells."""
    return re.findall(rf"^```{re.escape(language)}[^\n]*\n(?::tags:[^\n]*\n)?(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def drawn():
    """Return the pictures that are drawn when the site is built."""
    sys.path.insert(0, str(DOCS))
    try:
        pictures = importlib.import_module("_pictures")
    finally:
        sys.path.remove(str(DOCS))
    return {file for _, files, _ in pictures.drawn().values() for file in files}


@pytest.mark.parametrize("page", [*PAGES, README, ROOT / "CONTRIBUTING.md"], ids=name)
def test_links(page, drawn):
    """Contract: every link and picture of a page exists, or is made by `docs/_generate.py` or `docs/_pictures.py`."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)\s#]+)[^)]*\)", text):
        if "://" in target or target.startswith("doi:"):
            continue
        path = page.parent / target
        if page == README:  # it is shown without a build
            assert path.exists(), target
            assert subprocess.run(["git", "check-ignore", "-q", path], cwd=ROOT, check=False).returncode != 0, target
            continue
        made = str(path.relative_to(DOCS)) in ("api/index.md", "theory/catalogue.md") if DOCS in path.parents else False
        assert path.exists() or made or Path(os.path.normpath(path)) in drawn, target


def test_every_drawn_picture_has_a_page(drawn):
    """Contract: each picture that is drawn is shown by a page, and each film by the page of its mechanism."""
    shown = set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r'\]\(([^)\s#]+)\)|(?:src|href)="([^"]+)"', text):
            shown.add(Path(os.path.normpath(page.parent / "".join(target))))
    assert drawn - shown == set()


def test_every_cited_equation_exists():
    """Identity: names of equations are unique, and every cited one exists."""
    tags = [tag for page in PAGES for tag in NUMBERED.findall(page.read_text(encoding="utf-8"))]
    assert len(tags) == len(set(tags))
    assert len(tags) > 30
    cited = []
    for folder in ("src", "tests", "benchmarks", "validation"):
        for path in (ROOT / folder).rglob("*.py"):
            for line in re.findall(r"docs/theory[^\n]*", path.read_text(encoding="utf-8")):
                cited += re.findall(r"\(([A-Z]\d+)\)", line)
    assert cited
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        cited += re.findall(r"(?<![\w\\])\(([SRCGNDFIEKA]\d)\)", text)
    # benchmark problems of the IFToMM library have such names too
    missing = {one for one in cited if one not in tags} - {"A01", "A02", "A03"}
    assert not missing


def code_of(page):
    """Return the Python code of a page."""
    text = page.read_text(encoding="utf-8")
    return "\n".join(code for language in ("python", "{code-cell}") for code in blocks(text, language))


def used_names(code):
    """Return public names that code uses, by module: attributes of `sd`, and imported names that are read."""
    tree = ast.parse(code)
    read = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    found = set()
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module=str(module), names=names) if module.startswith("scissordyn"):
                found |= {(module.removeprefix("scissordyn").lstrip("."), one.name) for one in names if one.name in read}
            case ast.Attribute(value=ast.Name(id="sd"), attr=name):
                found |= {("", name), *([("studies.result", "StudyResult")] if name == "study" else [])}
            case ast.Attribute(value=ast.Attribute(value=ast.Name(id="sd"), attr="plot"), attr=name):
                found.add(("plot", name))
            case ast.Attribute(value=ast.Attribute(value=ast.Name(), attr="plot")):
                found.add(("studies.answer.report", "StudyPictures"))
            case ast.Attribute(value=ast.Name(id="regularity"), attr=name):
                found.add(("plot.regularity", name))
            case ast.Attribute(value=ast.Attribute(attr="scissordyn"), attr=name):
                found.add(("record.accessor", "RunAccessor"))
    return found


def executed():
    """Return pages whose code tests execute: those of `tests/test_documents.py`, the tutorials, and the README."""
    asked = DOCS / "decisions" / "measured" / "questions.md"
    return [*DOCS.glob("*.md"), *(DOCS / "howto").glob("*.md"), *(DOCS / "tutorials").glob("*.md"), asked, README]


def generator():
    spec = importlib.util.spec_from_file_location("_generate", DOCS / "_generate.py")
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    return generate


def test_tables_are_those_of_the_declarations(monkeypatch, capsys):
    """Contract: units, defaults and ranges in the pages are the declared ones; `python docs/_tables.py` writes them."""
    monkeypatch.setattr(sys, "argv", ["_tables.py", "--check"])
    monkeypatch.setattr(sys, "path", sys.path[:])
    runpy.run_path(str(DOCS / "_tables.py"), run_name="__main__")
    assert capsys.readouterr() == ("all tables are up to date\n", "")


def test_pages_of_old_headings_are_deleted(tmp_path):
    """Contract: the generator deletes pages of the API that it no longer makes."""
    for name in ("theory", "api"):
        (tmp_path / name).mkdir()
    (tmp_path / "api" / "old.md").write_text("# Old", encoding="utf-8")
    generate = generator()
    generate.write(tmp_path)
    made = {path.stem for path in (tmp_path / "api").glob("*.md")}
    headings = (*generate.groups(), *generate.MODULES)
    assert made == {"index", *(heading.lower().replace(" ", "_") for heading in headings)}


def test_every_public_name_is_documented_and_shown():
    """Contract: each public name has a docstring, an entry in the API and an executed example."""
    generate = generator()
    listed = [one for names in generate.groups().values() for one in names]
    assert sorted(listed) == sorted(sd.__all__)
    used = set().union(*(used_names(code_of(page)) for page in executed()))
    for one in sd.__all__:
        assert getattr(sd, one).__doc__, one
        text = re.sub(r"``.+?``|`[^`]+`|\.\. math::.*?(\n\s*\n|\Z)", "", getattr(sd, one).__doc__, flags=re.DOTALL)
        assert not re.search(r"(?<!\w)\|\w[^|]*\|", text), f"'{one}': bars outside of a literal name a substitution"
        assert ("", one) in used, f"'{one}' is in no example"
    documented = set()
    for modules in generate.MODULES.values():
        for module, names in modules.items():
            found = importlib.import_module(f"scissordyn.{module}")
            for one in names:
                assert getattr(found, one).__doc__, one
                assert (module, one) in used, f"'{one}' of {module} is in no example"
                documented.add((module, one))
    # the modules of pictures are public as a whole, and what an example imports is documented
    for module in ("plot", "plot.regularity"):
        assert {one for where, one in documented if where == module} == set(
            importlib.import_module(f"scissordyn.{module}").__all__
        )
    imported = {
        (module, one)
        for module, one in used
        if module and not (ROOT / "src" / "scissordyn" / Path(*module.split("."), f"{one}.py")).exists()
    }
    assert {(module, one) for module, one in imported if one not in sd.__all__} <= documented


def test_imported_names_are_public():
    """Contract: names that the documentation imports from modules are public there, or modules themselves."""
    imports = {
        (module, name.split(" as ")[0].strip())
        for page in PAGES
        for module, names in re.findall(r"^ *from (scissordyn\.[\w.]+) import ([^\n(]+)$", code_of(page), re.MULTILINE)
        for name in names.split(",")
    }
    assert len(imports) > 10
    for module, name in imports:
        found = importlib.import_module(module)
        if not (ROOT / "src" / Path(*module.split("."), f"{name}.py")).exists():
            assert name in getattr(found, "__all__", dir(found)), f"{module}: {name}"


@pytest.mark.slow
@pytest.mark.parametrize("page", sorted((DOCS / "tutorials").glob("*.md")), ids=name)
def test_tutorial_cells_run(page, tmp_path, monkeypatch):
    """Contract: the cells and then the commands of a tutorial run in an empty folder; cells that end with a picture show it."""
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    from scissordyn.cli.main import status_of

    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    space = {"__name__": "__main__"}
    for code in blocks(page.read_text(encoding="utf-8"), "{code-cell}"):
        *lines, last = ast.parse(code).body
        exec(compile(ast.Module(lines, []), str(page), "exec"), space)
        if isinstance(last, ast.Expr) and ".plot." in ast.unparse(last):  # what a notebook shows
            shown = eval(compile(ast.Expression(last.value), str(page), "eval"), space)
            assert shown._repr_png_().startswith(b"\x89PNG"), ast.unparse(last)
        else:
            exec(compile(ast.Module([last], []), str(page), "exec"), space)
    plt.close("all")
    for line in "".join(blocks(page.read_text(encoding="utf-8"), "sh")).splitlines():
        program, *words = shlex.split(line, comments=True)
        assert program == "scissordyn"
        assert status_of(words) == 0, line


def test_every_doi_is_in_the_bibliography():
    """Identity: pages, sources, tests and cases name only DOIs of the bibliography, which says where each was found."""
    known = {reference.doi.lower() for reference in bibliography().values() if reference.doi}
    assert all(reference.seen for reference in bibliography().values() if reference.doi)
    texts = [*PAGES, ROOT / "CITATION.cff", *(ROOT / "examples").rglob("*.toml"), *(ROOT / "src").rglob("*.toml")]
    texts += [*(ROOT / "validation").rglob("*.md"), *(ROOT / "src").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]
    for path in texts:
        named = (doi.lower() for doi in dois(path.read_text(encoding="utf-8")) if not doi.startswith("10.1000/"))  # of examples
        unknown = [doi for doi in named if doi not in known]
        assert not unknown, f"{path.relative_to(ROOT)}: {unknown}"


def test_code_of_the_readme(capsys):
    """Contract: the README's code runs and prints a peak force and a predictability horizon within the run."""
    (code,) = blocks(README.read_text(encoding="utf-8"), "python")
    assert len(code.splitlines()) <= 10
    exec(compile(code, "README.md", "exec"), {})
    found = re.fullmatch(r"(\d+) N, predictable until (0\.\d+) s\n", capsys.readouterr().out)
    assert found
    assert float(found[1]) > 1e4
    assert 0.01 < float(found[2]) <= 0.05


# Path of the browser Chromium; None if it is not installed
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
# Options of Chromium for a page without network
OFFLINE = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--virtual-time-budget=30000",
)


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
@pytest.mark.skipif(importlib.util.find_spec("myst_nb") is None, reason="the site's requirements are not installed")
def test_equations_render_without_a_network(tmp_path):
    """Contract: every displayed equation of the theory becomes a picture, without errors."""
    theory = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").rglob("*.md")))
    equations = re.findall(r"^\$\$\n.*?^\$\$\n", theory, flags=re.MULTILINE | re.DOTALL)
    assert len(equations) > 30
    source = tmp_path / "source"
    source.mkdir()
    (source / "index.md").write_text("# Equations\n\n" + "\n".join(equations), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-b",
        "html",
        "-q",
        "-c",
        str(ROOT / "docs"),
        str(source),
        str(tmp_path / "site"),
    ]
    subprocess.run(command, check=True, timeout=300, cwd=tmp_path)
    page = (tmp_path / "site" / "index.html").as_uri()
    shown = subprocess.run(
        [str(BROWSER), *OFFLINE, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", page],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    ).stdout
    assert re.findall(r'data-mjx-error="([^"]*)"', shown) == []
    assert len(re.findall(r"<mjx-container[^>]*display=\"true\"", shown)) == len(equations)


@pytest.mark.parametrize("name", ["simulate", "study", "fit"])
def test_examples_of_docstrings_print_what_they_show(name):
    """Contract: the examples of the functions that are used most."""
    function = getattr(sd, name)
    found = doctest.DocTestParser().get_doctest(function.__doc__, {}, name, None, 0)
    assert found.examples
    assert doctest.DocTestRunner(verbose=False).run(found).failed == 0


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/maintain.md"])
def test_names_of_a_guide_exist(page):
    """Contract: each file that a guide for maintainers names is there, and each other name is in the code."""
    folders = ("src", "tests", "benchmarks", "validation", "docs", "examples")
    files = [
        path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in {".py", ".toml", ".md", ".sha256"}
    ]
    names = {"/" + path.relative_to(ROOT).as_posix() for path in files} | {f"/{path.name}" for path in ROOT.iterdir()}
    code = " ".join(path.read_text(encoding="utf-8") for path in files if path.suffix in {".py", ".toml"})
    words = set(re.findall(r"\w+", code)) | set(re.findall(r"\w+", (ROOT / "Makefile").read_text(encoding="utf-8")))
    text = re.sub(r"```.*?```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    for quoted in re.findall(r"`([^`\n]+)`", text):
        if re.fullmatch(r"[\w./-]+\.(py|md|toml|sha256)", quoted):
            assert any(path.endswith("/" + quoted) for path in names), quoted
        elif re.fullmatch(r"[\w/]+/", quoted):
            assert any("/" + quoted in path for path in names), quoted
        elif re.fullmatch(r"[A-Za-z]\w+", quoted):
            assert quoted in words, quoted


def test_first_names_of_the_api_run():
    """Contract: the ten lines of the API page run one after the other, and each calls the name of its row."""
    spec = importlib.util.spec_from_file_location("_generate", DOCS / "_generate.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    assert len(generate.FIRST) == 10
    space = {"sd": sd}
    for name, line in generate.FIRST.items():
        assert f"{name.removeprefix('Mechanism')}(" in line
        ast.parse(line)
        if not line.startswith(("found", "sd.save")):  # a study of eight runs, and a file
            exec(line, space)
