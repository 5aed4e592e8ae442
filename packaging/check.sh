#!/usr/bin/env bash
# Build sdist and wheel, the wheel from the sdist, and check both as an index and a user would; writes dist/.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet --disable-pip-version-check build twine check-wheel-contents cffconvert
rm -rf dist
"$work/tools/bin/python" -m build --outdir dist . > "$work/log" || { cat "$work/log"; exit 1; }
"$work/tools/bin/twine" check --strict dist/*
# W009: two packages, as intended
"$work/tools/bin/check-wheel-contents" --ignore W009 dist/*.whl
"$work/tools/bin/cffconvert" --validate -i CITATION.cff
"${PYTHON:-python3}" -m venv "$work/empty"
"$work/empty/bin/pip" install --quiet --disable-pip-version-check dist/*.whl
cd "$work"
export SCISSORDYN_CACHE="$work/cache"
empty/bin/scissordyn --version
empty/bin/scissordyn examples paper -o .
empty/bin/scissordyn check paper.toml > /dev/null
empty/bin/scissordyn schema case -o case.json
empty/bin/scissordyn run paper.toml -o run.nc --quiet
empty/bin/scissordyn export run.nc run.csv
empty/bin/python - <<'PY'
from importlib.resources import files

import scissordyn as sd

assert (files("scissordyn") / "py.typed").is_file()
assert sd.load("run.nc").attrs["status"] == "complete"
print("the wheel works in an empty environment")
PY
