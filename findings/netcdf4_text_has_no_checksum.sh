#!/usr/bin/env bash
# netCDF4 1.7.3 with libnetcdf 4.9.3 and HDF5 1.14.6 (PyPI), 2026-11-29: a text variable with fletcher32=True is created, but cannot
# be written.
#
# HDF5 applies filters to the bytes of a dataset; texts of variable length are stored elsewhere in the file, so that HDF5 refuses the
# filter for them. netCDF4 accepts `createVariable(name, str, dims, fletcher32=True)` without a word. The first assignment ends in
# "NetCDF: HDF error", which names neither the variable nor the filter. Texts that need a checksum are written as arrays of characters.
# The file cannot be opened again in that process. Seen: created, then RuntimeError; the same variable without the option, and characters with it, are written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check netCDF4==1.7.3 numpy==2.3.5
cd "$folder"
venv/bin/python - <<'PY'
import netCDF4
import numpy as np


def write(path, kind, value, **options):
    try:
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("n", len(value))
            variable = file.createVariable("material", kind, ("n",), **options)
            print("created", end=", ")
            variable[:] = value
    except RuntimeError as error:
        return str(error)
    return "written"


names = np.array(["steel", "aluminium"], object)
checked = write("checked.nc", str, names, fletcher32=True)
print("text with a checksum:", checked)
plain = write("plain.nc", str, names)
print("text without:", plain)
characters = write("characters.nc", "S1", np.array(list("steel"), "S1"), fletcher32=True)
print("characters with a checksum:", characters)
assert checked == "NetCDF: HDF error" and plain == characters == "written"
PY
