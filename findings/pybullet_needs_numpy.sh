#!/usr/bin/env bash
# pybullet 3.2.7 (PyPI), 2026-11-29: `pip install pybullet` leaves a package that fails without NumPy, which it does not require.
#
# The wheel is compiled against NumPy, but its metadata name no dependency. In a new environment pip installs pybullet alone.
# Seen: ImportError "numpy._core.multiarray failed to import", which does not say that NumPy is missing. With numpy 1.26.4 next to it
# the same program runs.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
pip=("$folder/venv/bin/pip" install --quiet --disable-pip-version-check)
"${pip[@]}" pybullet==3.2.7
program="import pybullet as pb; pb.connect(pb.DIRECT); pb.setGravity(0, 0, -9.81); print('runs, API', pb.getAPIVersion())"
if "$folder/venv/bin/python" -c "$program" 2> "$folder/error"; then
    echo "pybullet runs without NumPy now"
    exit 1
fi
tail -n 1 "$folder/error"
grep -q "numpy" "$folder/error"
"${pip[@]}" numpy==1.26.4
"$folder/venv/bin/python" -c "$program"
