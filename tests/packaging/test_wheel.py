"""The wheel, and the program in an environment with nothing else."""

import os
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.components.recipes import catalogue_recipes
from scissordyn.sensitivity import library

ROOT = Path(__file__).parents[2]  # Root folder of the repository


def files_of(folder):
    """Return the files of a folder, without bytecode."""
    return [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]


def package_files():
    """Return the files of the packages, relative to their folder."""
    packages = [ROOT / "src" / name for name in ("scissordyn", "scissordyn_paper")]
    return {path.relative_to(ROOT / "src").as_posix() for folder in packages for path in files_of(folder)}


def test_files_that_setuptools_finds(monkeypatch):
    """Contract: the tables of pyproject.toml name every file of the package; the build adds the compiled kernels."""
    pytest.importorskip("setuptools", minversion="77")
    from setuptools import Distribution
    from setuptools.command.build_py import build_py
    from setuptools.config.pyprojecttoml import apply_configuration

    monkeypatch.chdir(ROOT)
    distribution = apply_configuration(Distribution({"script_name": "setup.py"}), ROOT / "pyproject.toml")
    distribution.include_package_data = False  # MANIFEST.in names no file of the package
    build = build_py(distribution)
    build.ensure_finalized()
    found = {Path(file).relative_to("src").as_posix() for _, _, file in build.find_all_modules()}
    found |= {Path(folder, name).relative_to("src").as_posix() for _, folder, _, names in build.data_files for name in names}
    assert found == {name for name in package_files() if not name.startswith("scissordyn/_kernels.")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Return the wheel, built from a copy of the sources, without libraries in dual numbers."""
    return wheel_in(tmp_path_factory, derivatives="no")


def wheel_in(tmp_path_factory, derivatives):
    """Build the wheel from a copy of the sources."""
    pytest.importorskip("setuptools", minversion="77")
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    shutil.copytree(ROOT / "src", source / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    shutil.copytree(ROOT / "examples", source / "examples", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "packaging", source / "packaging")
    target = tmp_path_factory.mktemp("wheel")
    build = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(target), str(source)]
    environment = {**os.environ, "SCISSORDYN_DERIVATIVES": derivatives}
    done = subprocess.run([sys.executable, *build], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (found,) = target.iterdir()
    return found


@pytest.mark.slow
def test_wheel_contains_the_package_and_nothing_else(wheel):
    """Contract: the wheel has every file of the package and every example, and neither tests nor documentation."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = archive.read(f"scissordyn-{sd.__version__}.dist-info/METADATA").decode()
        scripts = archive.read(f"scissordyn-{sd.__version__}.dist-info/entry_points.txt").decode()
    here = package_files()
    assert "scissordyn/py.typed" in here
    here |= {f"scissordyn/{path.relative_to(ROOT).as_posix()}" for path in files_of(ROOT / "examples")}
    assert {name for name in names if ".dist-info/" not in name} == here
    assert f"scissordyn-{sd.__version__}.dist-info/licenses/LICENSE" in names
    assert "scissordyn = scissordyn.cli.entry:run" in scripts
    assert re.search(r"^License-Expression: BSD-3-Clause$", metadata, re.MULTILINE)
    assert re.search(r"^Requires-Python: >=3.11$", metadata, re.MULTILINE)


def test_one_version(capsys):
    """Contract: the package, the citation file and the program name the same version."""
    assert re.fullmatch(r"\d+\.\d+\.\d+", sd.__version__)
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {sd.__version__}\n" in citation
    assert status_of(["--version"]) == 0
    assert capsys.readouterr().out == f"scissordyn {sd.__version__}\n"


def test_module_is_the_program():
    """Contract: `python -m scissordyn` is the program, with its exit statuses."""
    done = subprocess.run([sys.executable, "-m", "scissordyn", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, f"scissordyn {sd.__version__}\n")
    done = subprocess.run([sys.executable, "-m", "scissordyn", "nonsense"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "No such command 'nonsense'" in done.stderr


def test_libraries_in_dual_numbers(tmp_path, monkeypatch):
    """Contract: a wheel gets each library by the name under which it is looked for, and a library has all elements."""
    assert all(hasattr(library._loaded("elements"), recipe.symbol) for recipe in catalogue_recipes())
    with monkeypatch.context() as patch:
        patch.setattr(library, "source_of", '__attribute__((visibility("default"))) int made_for_{};'.format)
        library.compile_all(tmp_path)
    monkeypatch.setattr(library, "INSTALLED", tmp_path)
    for kind in library.KINDS:
        found = library._loaded.__wrapped__(kind)
        assert Path(found._name) == tmp_path / library.file_name(kind, library.vector_width())
        assert hasattr(found, f"made_for_{kind}")


@pytest.mark.slow
def test_empty_environment(tmp_path_factory, tmp_path):
    """Contract: installed alone, without a compiler or other programs, the package computes the paper's case and a gradient."""
    wheel = wheel_in(tmp_path_factory, derivatives="")
    home = tmp_path / "environment"
    venv.create(home, with_pip=True)
    programs = home / ("Scripts" if os.name == "nt" else "bin")
    python = str(programs / "python")
    install, only = [python, "-m", "pip", "install", "--quiet", str(wheel)], {**os.environ, "PYTHONPATH": ""}
    done = subprocess.run(install, env=only, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    alone = {"PATH": str(programs), "HOME": str(tmp_path)}
    if os.name == "nt":
        alone["SYSTEMROOT"] = os.environ["SYSTEMROOT"]
    program = str(programs / "scissordyn")
    for command, shown in (
        ([program, "examples", "paper", "-o", "."], "paper.toml"),
        ([program, "run", "paper.toml", "-o", "run.nc"], "Saved to"),
        ([python, "-m", "scissordyn", "run", "run.nc", "-o", "again.nc"], "Saved to"),
        ([program, "gradient", "paper.toml", "--of", "A.peak_force", "--by", "body.slider.mass"], "body.slider.mass"),
    ):
        done = subprocess.run(command, cwd=tmp_path, env=alone, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert shown in done.stdout
    show = "import scissordyn as sd; run = sd.load('again.nc'); print(run.attrs['status'], float(run['contact_start'][0]))"
    done = subprocess.run([python, "-c", show], cwd=tmp_path, env=alone, capture_output=True, text=True, check=True)
    status, start = done.stdout.split()
    assert status == "complete"
    assert float(start) == pytest.approx(0.001365125913, abs=1e-9)
