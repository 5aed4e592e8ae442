#!/usr/bin/env bash
# pychrono 1.1.0 (PyPI), 2026-11-29: `pip install pychrono` succeeds, and installs a library for delays and timers.
#
# Project Chrono's Python module is called pychrono too, but is not on PyPI. Seen: the summary of the package names delays and timing;
# it has no class ChBody.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pychrono==1.1.0
cat > "$folder/look.py" <<'PY'
import importlib.metadata as metadata

print("pychrono", metadata.version("pychrono"), "|", metadata.metadata("pychrono")["Summary"])
assert "delay" in metadata.metadata("pychrono")["Summary"], "pychrono is another package now"
try:
    from pychrono import ChBody
except ImportError as error:
    print(str(error).partition(" (")[0])
else:
    raise AssertionError("pychrono has bodies now")
PY
"$folder/venv/bin/python" "$folder/look.py"
