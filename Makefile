# Everything below runs from a fresh checkout: it needs Python 3.11 or newer and make.
PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

# byte code is kept as modules are first imported: the tests start hundreds of processes, and compiling takes each of them 4 s
export PYTHONDONTWRITEBYTECODE =

.PHONY: paper test check slow bounds browser bench validate docs distributions workflows clean

paper: .venv/.installed
	$(BIN)/scissordyn paper -o $(OUT)

# two workers, in which threads of linear algebra would wait for each other
test: .venv/.dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2

slow: .venv/.dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 -m slow

# kernels in Python, where every index is checked: 5 min of one processor
bounds: .venv/.dev
	SCISSORDYN_ENGINE=python $(BIN)/pytest -q tests/integrate tests/mechanics/test_linearisation.py \
		tests/mechanics/test_plane_contact.py tests/control/test_torque.py

check: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tests/plain.py
	$(BIN)/codespell src docs benchmarks validation examples README.md CHANGELOG.md CONTRIBUTING.md

# the site, in $(OUT)/docs; a warning is an error, and notebooks are executed when they or the package have changed
docs: .venv/.docs
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m sphinx -b html -W --keep-going docs $(OUT)/docs

# cases with known answers, and other codes on them; one that does not install is shown as not installed (numbalsoda is built
# from source: apt-get install gfortran)
validate: .venv/.dev
	-$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --constraint requirements.txt "exudyn>=1.13"
	-$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --constraint requirements.txt "numbalsoda>=0.3.4"
	$(BIN)/python -m validation --write

# needs Debian's browser: apt-get install chromium
browser: .venv/.dev
	$(BIN)/pytest tests/explore

bench: .venv/.dev
	$(BIN)/python -m benchmarks

.venv/bin/python:
	$(PYTHON) -m venv .venv

# kernels are compiled when the package is installed; where there is no C compiler, ziglang has one, here and later
.venv/.installed: .venv/bin/python pyproject.toml setup.py requirements.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements.txt
	command -v $${CC:-cc} > /dev/null || command -v gcc > /dev/null || command -v clang > /dev/null || \
		$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check ziglang==0.17.1
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --no-deps -e .
	touch $@

.venv/.dev: .venv/.installed requirements-dev.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements-dev.txt
	touch $@

.venv/.docs: .venv/.installed requirements-docs.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements-docs.txt
	touch $@

# sdist and wheel in dist/, checked and installed into an empty environment; WHEELS=all makes those of other machines too
distributions:
	PYTHON="$(PYTHON)" packaging/check.sh $(WHEELS)

# needs zizmor from PyPI, which is not pinned here: its rules follow what is found
workflows: .venv/.dev
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check zizmor
	$(BIN)/zizmor --offline --persona=regular .github

clean:
	rm -rf .venv out
