#!/usr/bin/env bash
# Build sdist and wheel, the wheel from the sdist, and check both as an index and a user would; writes dist/.
# The wheel alone runs a case in an empty environment, and all tutorials as notebooks in one that has Jupyter's parts as well.
# With `all`, wheels for every target of setup.py are made on this machine, by the C compiler of ziglang; that for this machine is run.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet --disable-pip-version-check build twine check-wheel-contents cffconvert myst-nb
rm -rf dist
"$work/tools/bin/python" -m build --sdist --outdir dist . > "$work/log" || { cat "$work/log"; exit 1; }
targets=("")
if [ "${1:-}" = all ]; then
    mapfile -t targets < <(sed -nE 's/^    "([a-z0-9_.-]+)": "[a-z0-9_]+",$/\1/p' setup.py)
fi
for target in "${targets[@]}"; do
    SCISSORDYN_TARGET="$target" "$work/tools/bin/pip" wheel --quiet --disable-pip-version-check --no-deps -w dist dist/*.tar.gz
done
"$work/tools/bin/pip" download --quiet --disable-pip-version-check --no-deps --no-index --only-binary :all: --find-links dist \
    -d "$work/this" scissordyn
wheel=$(echo "$work"/this/*.whl)
"$work/tools/bin/twine" check --strict dist/*
# W009: two packages, as intended
"$work/tools/bin/check-wheel-contents" --ignore W009 dist/*.whl
"$work/tools/bin/cffconvert" --validate -i CITATION.cff
"$work/tools/bin/python" docs/_notebooks.py "$work/notebooks"
"${PYTHON:-python3}" -m venv "$work/empty"
"$work/empty/bin/pip" install --quiet --disable-pip-version-check "$wheel"
"${PYTHON:-python3}" -m venv "$work/plain"
"$work/plain/bin/pip" install --quiet --disable-pip-version-check nbclient ipykernel "$wheel[study]"
cd "$work"
unset PYTHONPATH
empty/bin/scissordyn --version
empty/bin/scissordyn examples paper -o .
empty/bin/scissordyn check paper.toml > /dev/null
empty/bin/scissordyn schema case -o case.json
empty/bin/scissordyn run paper.toml -o run.nc --quiet
empty/bin/scissordyn export run.nc run.csv
empty/bin/scissordyn gradient paper.toml --of A.peak_force --by body.slider.mass > /dev/null
empty/bin/scissordyn zoo flores-slider-crank --check
empty/bin/python - <<'PY'
from importlib.resources import files

import scissordyn as sd

assert (files("scissordyn") / "py.typed").is_file()
assert len(sd.zoo) >= 24
assert sd.load("run.nc").attrs["status"] == "complete"
print("the wheel works in an empty environment")
PY
cd notebooks
for notebook in *.ipynb; do
    PATH="$work/plain/bin:$PATH" jupyter execute --inplace --timeout=1800 "$notebook" > "$work/log" 2>&1 || { cat "$work/log"; exit 1; }
    echo "$notebook runs from the wheel"
done
