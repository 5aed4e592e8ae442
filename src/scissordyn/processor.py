"""Number of processors, and the threads that libraries of linear algebra start."""

from __future__ import annotations

import os

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra libraries; by default each process starts one per processor.
"""


def processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def limit_library_threads() -> list[str]:
    """Give libraries that are loaded later, and new processes, one thread; return the variables that the user has not set.

    Matrices of mechanisms are small: on a busy machine threads wait for each other longer than they compute.
    """
    added = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    return added
