# Everything below runs from a fresh checkout: it needs Python 3.11 or newer and make.
PYTHON ?= python3
# an environment for each Python that is named: PYTHON=python3.13 has .venv/python3.13
VENV := .venv$(if $(filter-out python3,$(PYTHON)),/$(notdir $(PYTHON)))
BIN := $(VENV)/bin
OUT ?= out
PYTHONS ?= python3.11 python3.12 python3.13

# byte code is kept as modules are first imported: the tests start hundreds of processes, and compiling takes each of them 4 s
export PYTHONDONTWRITEBYTECODE =

.PHONY: paper test pythons kernels newest check slow bounds browser bench validate docs distributions workflows clean

paper: $(VENV)/.installed
	$(BIN)/scissordyn paper -o $(OUT)

# two workers, in which threads of linear algebra would wait for each other; each has one half of the tests, so that few fixtures
# are made twice
test: $(VENV)/.dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal

# tests on every one of PYTHONS that is installed, and the same source of the library in C from all of them
pythons:
	rm -rf $(OUT)/kernels
	mkdir -p $(OUT)/kernels
	failed=; for python in $(PYTHONS); do \
		$$python -c "" 2> /dev/null || { echo "$$python is not installed"; continue; }; \
		$$python -V; \
		$(MAKE) --no-print-directory PYTHON=$$python kernels test || failed="$$failed $$python"; \
	done; \
	set -- $(OUT)/kernels/*.c; for file; do cmp "$$1" "$$file" || failed="$$failed $$file"; done; \
	test -z "$$failed" || { echo "failed:$$failed"; exit 1; }

kernels: $(VENV)/.dev
	mkdir -p $(OUT)/kernels
	$(BIN)/python -m scissordyn.build --c $(OUT)/kernels/$(notdir $(PYTHON)).c

# tests with the newest versions of all dependencies
newest:
	$(PYTHON) -m venv --clear .venv/newest
	.venv/newest/bin/python -m pip install --quiet --no-compile --disable-pip-version-check --editable ".[dev,study]"
	OPENBLAS_NUM_THREADS=1 .venv/newest/bin/python -m pytest -n 2 --dist worksteal

slow: $(VENV)/.dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist worksteal -m slow

# kernels in Python, where every index is checked: 5 min of one processor
bounds: $(VENV)/.dev
	SCISSORDYN_ENGINE=python $(BIN)/pytest -q tests/integrate tests/mechanics/test_linearisation.py \
		tests/mechanics/test_plane_contact.py tests/control/test_torque.py

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	MYPY_NUM_WORKERS=2 $(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tests/plain.py
	$(BIN)/codespell src docs benchmarks validation examples README.md CHANGELOG.md CONTRIBUTING.md

# the site, in $(OUT)/docs; a warning is an error, and notebooks are executed when they or the package have changed
docs: $(VENV)/.docs
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m sphinx -b html -W --keep-going docs $(OUT)/docs

# cases with known answers, and other codes on them; one that does not install is shown as not installed (numbalsoda is built
# from source: apt-get install gfortran)
validate: $(VENV)/.dev
	-$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --constraint requirements.txt "exudyn>=1.13"
	-$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --constraint requirements.txt "numbalsoda>=0.3.4"
	$(BIN)/python -m validation --write

# needs Debian's browser: apt-get install chromium
browser: $(VENV)/.dev
	$(BIN)/pytest tests/explore

bench: $(VENV)/.dev
	$(BIN)/python -m benchmarks

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# kernels are compiled when the package is installed; where there is no C compiler, ziglang has one, here and later
$(VENV)/.installed: $(BIN)/python pyproject.toml setup.py requirements.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements.txt
	command -v $${CC:-cc} > /dev/null || command -v gcc > /dev/null || command -v clang > /dev/null || \
		$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check ziglang==0.17.1
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --no-deps -e .
	touch $@

$(VENV)/.dev: $(VENV)/.installed requirements-dev.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements-dev.txt
	touch $@

$(VENV)/.docs: $(VENV)/.installed requirements-docs.txt
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -r requirements-docs.txt
	touch $@

# sdist and wheel in dist/, checked and installed into an empty environment; WHEELS=all makes those of other machines too
distributions:
	PYTHON="$(PYTHON)" packaging/check.sh $(WHEELS)

# needs zizmor from PyPI, which is not pinned here: its rules follow what is found
workflows: $(VENV)/.dev
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check zizmor
	$(BIN)/zizmor --offline --persona=regular .github

clean:
	rm -rf .venv out
