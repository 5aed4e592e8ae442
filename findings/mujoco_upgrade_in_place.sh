#!/usr/bin/env bash
# MuJoCo 4.0.0 over 3.3.7 (PyPI), 2026-11-29: `pip install --upgrade mujoco` leaves a package that cannot be imported.
#
# From 4.0.0 on the bindings are in the package mujoco-core, which shares a folder with mujoco. When pip removes the old mujoco, files of
# mujoco-core go as well. Seen: ImportError, whose text names the repair, `pip install --force-reinstall --no-deps mujoco mujoco-core mujoco-studio`; after it the import works. A new environment is not
# affected.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
pip=("$folder/venv/bin/pip" install --quiet --disable-pip-version-check)
"${pip[@]}" mujoco==3.3.7
"$folder/venv/bin/python" -c "import mujoco; print('before:', mujoco.__version__)"
"${pip[@]}" mujoco==4.0.0
if "$folder/venv/bin/python" -c "import mujoco" 2> "$folder/error"; then
    echo "the upgraded package can be imported now"
    exit 1
fi
echo "upgraded: $(grep -o "ModuleNotFoundError.*" "$folder/error" | head -n 1)"
"${pip[@]}" --force-reinstall --no-deps mujoco==4.0.0 mujoco-core==4.0.0 mujoco-studio==4.0.0
"$folder/venv/bin/python" -c "import mujoco; print('repaired:', mujoco.__version__)"
