"""Measured speed: ``python -m benchmarks`` runs all of it, ``python -m benchmarks.NAME`` one."""

import os

# a matrix of ten rows on two threads is slower than on one, by an amount that depends on other processes
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
