"""Machine code from disk in processes that compile nothing: every part runs, and none needs what a compiler brings along."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from kept_parts import CONTROLLED, TIME_FUNCTIONS, cases, package_parts
from scissordyn.cache.folder import current_generation
from scissordyn.cache.kernel import HEAD
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.time_function import TimeFunction
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.laws.catalogue import BY_KIND

SCRIPT = Path(__file__).with_name("kept_parts.py")


def process(group: str) -> dict[str, Any]:
    """What a fresh process computes; fails with the part at which it ended otherwise."""
    command = [sys.executable, str(SCRIPT), group]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    assert done.returncode == 0, f"ended with status {done.returncode} at: {done.stderr[-500:]}"
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def compiled() -> dict[str, Any]:
    """What a process computes whose kernels may have to be compiled, and are kept."""
    return process("package")


def test_every_part_is_there() -> None:
    """Identity: the parts that are run are all of the catalogues: components, laws, controllers, time functions."""
    names = {name for name, _, _ in package_parts()}
    assert set(CONTROLLED) == set(CONTROLLERS)
    assert set(TIME_FUNCTIONS) == set(TimeFunction.__args__)
    assert set(cases()) == set(COMPONENTS) - {"actuator"}
    assert names >= {f"[[{section}]]" for section in COMPONENTS} - {"[[actuator]]"}
    assert names >= {f"{kind} {name}" for kind, laws in BY_KIND.items() for name in laws}
    assert names >= {f"controller {name}" for name in CONTROLLERS}


def test_every_part_runs_from_kept_kernels(compiled: dict[str, Any]) -> None:
    """Identity: a process that never compiles ends with status 0 and the same bits, for every part of the package."""
    kept = process("package")
    assert not kept["compiled"]
    assert kept["found"] == compiled["found"]


def test_parts_of_a_user_s_own_run_on_kept_kernels(compiled: dict[str, Any]) -> None:
    """Identity: laws, a controller and a component of a user's own on kept kernels, and the package's parts after them."""
    found = process("user")["found"]
    assert len(found) > len(compiled["found"])
    assert {name: value for name, value in found.items() if name in compiled["found"]} == compiled["found"]


def test_no_kept_kernel_needs_numba_s_allocator(compiled: dict[str, Any]) -> None:
    """Identity: no file of machine code names a function that numba introduces to the linker only when it compiles."""
    files = list(current_generation().glob("*.nbc"))
    assert len(files) >= 30
    naming = 0
    for file in files:
        packed = file.read_bytes()[len(HEAD) + 32 :]
        _, foreign, ((_, _, (machine_code, _)), *_) = pickle.loads(packed)
        assert b"NRT_" not in machine_code, file.name
        assert not [name for name in foreign if name.startswith("NRT_")], file.name
        naming += bool(foreign)
    assert naming >= 30  # the kernels of some laws and components are arithmetic alone and name nothing


ALLOCATING = """
import sys
import numpy as np
from numba import types
from numba.core.ccallback import CFunc
from scissordyn.cache.kernel import KernelCache

def total(count):
    return np.arange(count).sum()

made = CFunc(total, ((types.float64,), types.float64), locals={}, options={})
made._cache = KernelCache(total)
made.compile()
print(made.ctypes(4.0), made.cache_hits)
"""


def test_machine_code_that_needs_more_is_compiled_anew(tmp_path: Path) -> None:
    """Identity: a file that names a function this process does not have is never handed to the linker, which would end it."""
    script = tmp_path / "allocating.py"
    script.write_text(ALLOCATING)
    for _ in range(2):
        environment = {**os.environ, "SCISSORDYN_CACHE": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, str(script)], env=environment, capture_output=True, text=True, check=False, timeout=120
        )
        assert (done.returncode, done.stdout) == (0, "6.0 0\n"), done.stderr
    assert list(tmp_path.rglob("*.nbc"))
