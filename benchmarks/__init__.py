"""Benchmarks: ``python -m benchmarks`` runs short versions of some, ``python -m benchmarks.NAME`` runs one."""

import os

# a matrix of ten rows on two threads is slower than on one, by an amount that depends on other processes
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
