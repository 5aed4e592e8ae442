#!/usr/bin/env bash
# pychrono 1.1.0 and newton-physics 1.0.0 (PyPI), 2026-11-29: two names of physics engines on PyPI belong to other packages.
#
# `pip install pychrono` succeeds, and installs a library for delays and timers: Project Chrono has no package for pip under this name.
# `pip install newton-physics` succeeds as well; the engine of the GitHub organisation newton-physics is the package `newton`.
# Seen: neither package has a class of a body or a solver; `newton` does, but is not imported here.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pychrono==1.1.0 newton-physics==1.0.0
cat > "$folder/look.py" <<'PY'
import importlib.metadata as metadata

for name, word in (("pychrono", "chrono::"), ("newton-physics", "warp")):
    found = metadata.metadata(name)
    print(name, metadata.version(name), "|", found["Summary"], "| requires", metadata.requires(name))
assert "delay" in metadata.metadata("pychrono")["Summary"], "pychrono is another package now"
assert not metadata.requires("newton-physics"), "newton-physics requires a simulator now"
try:
    from pychrono import ChBody
except ImportError as error:
    print("pychrono:", error)
else:
    raise AssertionError("pychrono has bodies now")
PY
"$folder/venv/bin/python" "$folder/look.py"
