#!/usr/bin/env bash
# pint 0.25.2 (PyPI), 2026-11-29: "30 Grad", degrees in German, is read as 30 gigaradians, and "30 grad" as a unit called grade.
#
# A prefix and a unit form a unit: G and rad are giga and radian. The quantity is a valid angle, so that no check of dimensions sees
# the factor of 5.7e10 between the angle that was meant and the one that was read. A program that accepts angles from users has to
# limit their size or refuse prefixes. Seen: 3e+10 rad, and 0.471239 rad for "30 grad", which is 27 degrees.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pint==0.25.2
"$folder/venv/bin/python" - <<'PY'
import pint

units = pint.UnitRegistry()
angles = {text: units(text).to("rad").magnitude for text in ("30 deg", "30 Grad", "30 grad")}
print({text: float(f"{angle:.6g}") for text, angle in angles.items()})
assert units("30 Grad").check("[]"), "it has a dimension now"
assert abs(angles["30 Grad"] - 3e10) < 1.0
assert abs(angles["30 grad"] - 0.471238898) < 1e-6
PY
