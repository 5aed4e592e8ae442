#!/usr/bin/env bash
# NumPy 2.3.5 (PyPI wheels, OpenBLAS inside), 2026-11-29: chebfit returns other last digits on other processors.
#
# The least squares of np.polynomial.chebyshev.chebfit are solved by LAPACK, whose OpenBLAS kernels are chosen for the processor.
# Seen: with OPENBLAS_CORETYPE=Prescott and Haswell on one machine, the coefficients of the same data differ in the last bits. A
# table that is made in this way while a package is built is not the same in two wheels; one by sums in a fixed order is.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.3.5
cat > "$folder/fit.py" <<'PY'
import numpy as np

nodes = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
values = np.log(2.5 + nodes) * np.exp(nodes)
fitted = np.polynomial.chebyshev.chebfit(nodes, values, 24)
summed = [sum(v * np.cos(k * np.arccos(x)) for v, x in zip(values.tolist(), nodes.tolist())) * (2 - (k == 0)) / 64 for k in range(25)]
print(fitted.tobytes().hex(), np.array(summed).tobytes().hex())
PY
for core in Prescott Haswell; do
    OPENBLAS_CORETYPE=$core OPENBLAS_NUM_THREADS=1 "$folder/venv/bin/python" "$folder/fit.py" > "$folder/$core"
done
if [ "$(cut -d' ' -f1 "$folder/Prescott")" = "$(cut -d' ' -f1 "$folder/Haswell")" ]; then
    echo "chebfit returns the same digits with both kernels now"; exit 1
fi
echo "coefficients of chebfit: different last digits with Prescott and Haswell kernels"
