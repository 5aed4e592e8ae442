"""Provenance of stored results: every source that can affect them, and the libraries."""

import json
import shutil
from pathlib import Path

import grimp
import numpy as np
import pytest

import scissordyn
import scissordyn as sd
from scissordyn.file.provenance import DISPLAY_SUBPACKAGES, provenance
from scissordyn.periodic import bifurcation as bifurcation_module
from scissordyn_paper.cache import PRESENTATION_SOURCES

PACKAGE = Path(scissordyn.__file__).parent  # Folder of the package's sources


def digests(package):
    """Return the digests of a package's sources: for diagrams, and with the sources left out that only draw."""
    provenance.cache_clear()
    return tuple(json.loads(provenance(skip, (package,)))["sources"] for skip in (DISPLAY_SUBPACKAGES, PRESENTATION_SOURCES))


def test_every_source_counts(tmp_path):
    """Contract: an edit of any module that can affect results changes the digest; one of a display module does not."""
    copy = tmp_path / PACKAGE.name
    parts = sorted(path.name for path in PACKAGE.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists())
    for part in parts:  # the first file of each, so that a digest is quick
        file = part if part.endswith(".py") else f"{part}/__init__.py"
        (copy / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PACKAGE / file, copy / file)
    before = digests(copy)
    assert {"model", "run", "studies", "config", "plugin", "units.py", "kernel.py", "laws", "errors.py"} <= set(parts)
    for part in [*parts, "new_part"]:
        place = copy / part
        file = place if part.endswith(".py") else place / "added.py"
        file.parent.mkdir(exist_ok=True)
        text = file.read_text() if file.exists() else None
        file.write_text((text or "") + "\n# edited\n")
        after = digests(copy)
        assert (after[0] != before[0]) == (part not in DISPLAY_SUBPACKAGES), part
        assert (after[1] != before[1]) == (part not in DISPLAY_SUBPACKAGES), part
        file.unlink() if text is None else file.write_text(text)
    assert digests(copy) == before
    assert json.loads(provenance())["sources"] == digests(PACKAGE)[0]


def test_excluded_sources_are_not_imported():
    """Contract: modules that compute stored results import no source that the digest excludes."""
    graph = grimp.build_graph("scissordyn", "scissordyn_paper")
    entries = {
        ("periodic.bifurcation", "periodic.ensemble", "periodic.lyapunov"): DISPLAY_SUBPACKAGES,
        ("runs", "periodic", "controlled", "parameter_sets", "cache"): PRESENTATION_SOURCES,
    }
    for modules, skipped in entries.items():
        package = "scissordyn_paper" if skipped is PRESENTATION_SOURCES else "scissordyn"
        left_out = [
            f"{owner}.{name.removesuffix('.py').replace('/', '.')}" for owner in {package, "scissordyn"} for name in skipped
        ]
        for module in modules:
            used = upstream(graph, f"{package}.{module}")
            wrong = [name for name in used if any(name == one or name.startswith(f"{one}.") for one in left_out)]
            assert not wrong, (module, wrong)


def upstream(graph, module):
    """Return the direct and indirect imports of a module, without the package's own init file."""
    found, waiting = {module}, [module]
    while waiting:
        for name in graph.find_modules_directly_imported_by(waiting.pop()):
            if name not in found and name != "scissordyn":
                found.add(name)
                waiting.append(name)
    return found


def test_libraries_are_named():
    """Contract: the provenance has the versions of the computing libraries."""
    assert {"scissordyn", "numpy", "scipy", "xarray", "sources"} == set(json.loads(provenance()))


def test_diagram_of_other_sources_is_refused(tmp_path, monkeypatch):
    """Contract: a stored diagram is continued only with the sources and libraries of its start."""
    arm, other = (sd.four_bar(rocker=rocker).driven(sd.Harmonic(1.0, 0.2, 20.0)) for rocker in (0.15, 0.151))
    options = {"over": "drive.angular_frequency", "values": np.array([20.0, 21.0]), "cycles": 1, "keep": 1, "engine": 1}
    store = tmp_path / "diagram.nc"
    first = sd.bifurcation(arm, store=store, **options)
    again = sd.bifurcation(arm, store=store, **options)
    assert again["total_steps"].equals(first["total_steps"])
    now = json.loads(provenance())
    for name in ("sources", "numpy", "scipy"):
        monkeypatch.setattr(bifurcation_module, "provenance", lambda name=name: json.dumps({**now, name: "other"}))
        with pytest.raises(sd.InputError, match=f"differs in {name}"):
            sd.bifurcation(arm, store=store, **options)
    monkeypatch.undo()
    with pytest.raises(sd.InputError, match="differs in cases, mechanism"):
        sd.bifurcation(other, store=store, **options)
