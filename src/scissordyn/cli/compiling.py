"""Compiling before anything is computed that would wait for it when the user wants to stop."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from scissordyn.laws.friction.lugre import LuGre
from scissordyn.model.clearance import Clearance
from scissordyn.model.scissor import scissor
from scissordyn.run import compiled
from scissordyn.run.interrupt import pass_on
from scissordyn.run.simulate import simulate

__all__ = ["compile_kernels"]

LOOP = f"from {compiled.__name__} import compiled_loop; compiled_loop()"


def compile_kernels() -> None:
    """Have all kernels compiled, the loop in a process of its own: it has nothing in common with what it calls by pointers."""
    if not compiled.loop_is_on_disk():
        with _beside(LOOP):
            compiled.compiled_mechanics()
    array = scissor(units=1).with_clearance("A", Clearance(1e-4, friction=LuGre())).driven(speed=1.0)
    pass_on(simulate(array, until=1e-4, samples=2))


@contextmanager
def _beside(code: str) -> Iterator[None]:
    """Run Python code in another process, which is awaited; if it fails, this process compiles what it was to compile."""
    quiet = subprocess.DEVNULL
    with subprocess.Popen([sys.executable, "-c", code], stdin=quiet, stdout=quiet, stderr=quiet) as process:
        try:
            yield
            process.wait()
        finally:
            process.kill()
