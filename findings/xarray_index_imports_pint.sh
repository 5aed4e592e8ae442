#!/usr/bin/env bash
# xarray 2026.9.0 with pandas 3.1.1 and pint 0.25.3 (PyPI), 2026-11-30: an index made from a NumPy array imports pint.
#
# xarray asks whether the array is of another library, and imports every such library that is installed to find its class. The first
# Dataset with a coordinate therefore takes as long as the import of pint, in a program that only writes units as text. Seen: pint is
# in sys.modules after an index was made of an array, and not after one was made of a pandas index with the same values.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check xarray==2026.9.0 pandas==3.1.1 pint==0.25.3
cat > "$folder/index.py" <<'PY'
import sys

import numpy as np
import pandas as pd
import xarray as xr

times = np.linspace(0.0, 1.0, 5)
xr.indexes.PandasIndex(pd.Index(times), "time")
before = "pint" in sys.modules
xr.indexes.PandasIndex(times, "time")
print("pint imported: of a pandas index", before, "of an array", "pint" in sys.modules)
assert not before and "pint" in sys.modules, "the behaviour has changed"
PY
"$folder/venv/bin/python" "$folder/index.py"
