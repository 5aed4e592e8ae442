"""Kernels: what runs where."""

import os
from typing import NamedTuple

import numpy as np
import pytest

import scissordyn as sd
from scissordyn import kernel
from scissordyn.compiler.c import compile_library
from scissordyn.kernel import Handle
from scissordyn.mechanics.functions import rate


def test_arrays_are_checked_before_they_are_handed_on():
    """Contract: the library reads memory by the declaration alone."""
    for wrong in (np.zeros(4, int), np.zeros((2, 2)), np.zeros(8)[::2], [0.0]):
        with pytest.raises(TypeError, match="instead of a contiguous, writable float64 array of dimension 1"):
            rate(0.0, wrong, 0, np.zeros(4))


def test_a_function_from_a_prompt_runs_in_python():
    """Contract: there is no source to compile; an error is NaN."""
    scope: dict[str, object] = {}
    exec("def spring(indentation):\n    return 1e9 * indentation", scope)
    law = sd.element(slot="stiffness")(scope["spring"])()
    loose = sd.scissor().with_clearance("A", sd.Clearance(5e-4, stiffness=law)).driven(speed=15.0)
    assert sd.simulate(loose, until=2e-3).attrs["status"] == "complete"


class Pair(NamedTuple):
    """Two numbers."""

    first: int
    second: float


def test_a_tuple_is_of_the_declared_types():
    """Contract: what is no whole number is refused by its name."""
    assert Handle(Pair(1, 2.0)).address
    with pytest.raises(TypeError, match=r"Pair.first: str instead of int"):
        Handle(Pair("1", 2.0))


def test_the_process_that_builds_the_library_uses_it(tmp_path, monkeypatch):
    """Contract: where sources have changed, what is called is the new library, which has the name of the old one."""
    path, source = tmp_path / "_kernels.so", "kernel.py"

    def make(digest: str, number: int) -> None:
        names = f'const char SOURCES[] = "{source}", DIGEST[] = "{digest}";\nint number(void) {{ return {number}; }}\n'
        text = f"#pragma GCC visibility push(default)\n{names}"
        compile_library(text, path)

    make("of others", 1)
    os.utime(path, (0.0, 0.0))
    monkeypatch.setattr(kernel, "LIBRARY", path)
    monkeypatch.setattr(kernel, "build_library", lambda _: make(kernel.digest_of([source]), 2))
    assert kernel.library.__wrapped__().number() == 2
