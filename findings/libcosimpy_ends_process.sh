#!/usr/bin/env bash
# libcosimpy 0.0.6 (PyPI), 2026-11-30: a unit that cannot be loaded ends the process, without an exception.
#
# CosimLocalSlave accepts every path. add_local_slave then passes the null pointer of a slave that was not made to the library. Seen:
# signal 11 for a path without a file, and for a unit of FMI 3.0, which the library does not support.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check libcosimpy==0.0.6
cat > "$folder/load.py" <<'PY'
import sys
import zipfile

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimSlave import CosimLocalSlave

TEXT = """<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="{1}">
<CoSimulation modelIdentifier="m"/><ModelVariables><Float64 name="time" valueReference="0" causality="independent"
variability="continuous"/></ModelVariables><ModelStructure/></fmiModelDescription>"""
if sys.argv[1] == "unit.fmu":
    with zipfile.ZipFile("unit.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", TEXT)
execution = CosimExecution.from_step_size(1_000_000)
slave = CosimLocalSlave(fmu_path=sys.argv[1], instance_name="unit")
print("slave made", flush=True)
print("index", execution.add_local_slave(slave), flush=True)
PY
cd "$folder"
for path in no_such_file.fmu unit.fmu; do
    status=0
    venv/bin/python load.py "$path" > out 2>&1 || status=$?
    echo "$path: $(grep "slave made" out), ended with status $status"
    [ "$status" -eq 139 ] || { echo "the process goes on now"; exit 1; }
done
