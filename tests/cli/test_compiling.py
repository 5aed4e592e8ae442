"""Compiling before a run: what is compiled beside, and what becomes of that process."""

from __future__ import annotations

import time

import numba
import pytest

from scissordyn.cli import compiling
from scissordyn.integrate.integration import make_problem, problem_type
from scissordyn.mechanics import functions
from scissordyn.run import compiled


def test_the_type_of_a_problem_is_known_without_its_functions() -> None:
    """Identity: the loop is compiled for the type that numba finds for the pointers themselves."""
    assert problem_type() == numba.typeof(make_problem(functions.FUNCTIONS))


def test_what_is_on_disk_is_not_compiled_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: no process is started once the loop has been compiled."""
    compiled.compiled_loop()
    monkeypatch.setattr(compiling, "_beside", lambda code: pytest.fail("a process is started"))
    assert compiled.loop_is_on_disk()
    compiling.compile_kernels()


def test_a_process_beside_that_fails_is_passed_over() -> None:
    """Limit: this process compiles then what the other one was to compile."""
    with compiling._beside("raise SystemExit(3)"):
        pass


def test_a_process_beside_ends_with_what_it_is_beside() -> None:
    """Limit: an error or Ctrl-C is not kept waiting."""
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt), compiling._beside("import time; time.sleep(600)"):
        raise KeyboardInterrupt
    assert time.monotonic() - began < 60.0
