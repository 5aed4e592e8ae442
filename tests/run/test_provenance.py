"""Provenance of stored results: every source that can affect them, and the libraries."""

import json
import os
import shutil
import subprocess
import sys
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
# Program that prints the provenance of results
ASK = "from scissordyn.file.provenance import provenance as p; print(p(), p({skip}), sep='\\n')"


def asked(packages, skip):
    """Return the digests of a copy of the package: for diagrams, and with other sources left out."""
    environment = {**os.environ, "PYTHONPATH": str(packages), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", ASK.replace("{skip}", repr(skip))]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    first, second = (json.loads(line)["sources"] for line in done.stdout.splitlines())
    return first, second


def test_every_source_counts(tmp_path):
    """Contract: an edit of any module that can affect results changes the digest; one of a display module does not."""
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = asked(tmp_path, PRESENTATION_SOURCES)
    parts = sorted(path.name for path in copy.iterdir() if path.is_dir() or path.suffix == ".py")
    assert {"model", "run", "studies", "config", "plugin", "units.py", "kernel.py", "laws", "errors.py"} <= set(parts)
    for part in [*parts, "new_part"]:
        place = copy / part
        file = place if part.endswith(".py") else place / "added.py"
        file.parent.mkdir(exist_ok=True)
        text = file.read_text() if file.exists() else None
        file.write_text((text or "") + "\n# edited\n")
        after = asked(tmp_path, PRESENTATION_SOURCES)
        assert (after[0] != before[0]) == (part not in DISPLAY_SUBPACKAGES), part
        assert (after[1] != before[1]) == (part not in DISPLAY_SUBPACKAGES), part
        file.unlink() if text is None else file.write_text(text)
    assert asked(tmp_path, PRESENTATION_SOURCES) == before


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
