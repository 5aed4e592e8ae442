#!/usr/bin/env bash
# Exudyn 1.13.6 (PyPI), 2026-11-29: a sensor of the rotation of a 2-D rigid body leaves out its reference angle, that of the position does not.
#
# A body with referenceCoordinates [0.3, 0.2, 1.0] rests. Seen: the sensor of Position gives 0.3, 0.2; that of Rotation gives 0, not 1.
# RotationMatrix contains the reference angle: its first column is cos 1, sin 1. Who draws a linkage from Position and Rotation sees
# joints that are open.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check exudyn==1.13.6 numpy==2.4.6
cat > "$folder/rest.py" <<'PY'
import exudyn as exu
from exudyn import itemInterface as item

system = exu.SystemContainer()
mbs = system.AddSystem()
node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[0.3, 0.2, 1.0]))
body = mbs.AddObject(item.ObjectRigidBody2D(mass=1.0, inertia=0.1, nodeNumber=node))
mbs.Assemble()
kind = exu.OutputVariableType
place, turn, matrix = (
    mbs.GetObjectOutputBody(body, wanted, [0, 0, 0]) for wanted in (kind.Position, kind.Rotation, kind.RotationMatrix)
)
print("position", place, "rotation", turn, "first column of the matrix", matrix[0], matrix[3])
angle = float(turn if not hasattr(turn, "__len__") else turn[-1])
assert abs(place[0] - 0.3) < 1e-12 and abs(matrix[3] - 0.8414709848) < 1e-9
assert abs(angle) < 1e-12, "the rotation contains the reference angle now"
PY
"$folder/venv/bin/python" "$folder/rest.py" 2> "$folder/warnings" || { cat "$folder/warnings"; exit 1; }
