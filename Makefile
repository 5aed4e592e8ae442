# Everything below runs from a fresh checkout: it needs Python 3.11 or newer, make and a C compiler.
PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

.PHONY: paper test check slow browser bench clean

paper: .venv/.installed
	$(BIN)/scissordyn paper -o $(OUT)

test: .venv/.dev
	$(BIN)/pytest -n 2

slow: .venv/.dev
	$(BIN)/pytest -n 2 -m slow

# needs Debian's browser: apt-get install chromium
browser: .venv/.dev
	$(BIN)/pytest tests/explore

check: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/codespell src docs benchmarks examples README.md CHANGELOG.md

bench: .venv/.dev
	$(BIN)/python -m benchmarks

.venv/bin/python:
	$(PYTHON) -m venv .venv

.venv/.installed: .venv/bin/python pyproject.toml requirements.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	touch $@

.venv/.dev: .venv/.installed requirements-dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-dev.txt
	touch $@

clean:
	rm -rf .venv out
