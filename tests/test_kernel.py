"""Kernels: what runs where."""

import importlib.util
import os
from typing import NamedTuple

import numpy as np
import pytest

import scissordyn as sd
from scissordyn import kernel
from scissordyn.compiler.c import compile_library
from scissordyn.kernel import F2, I1, Handle, Template
from scissordyn.laws.evaluate import elastic_force
from scissordyn.mechanics.functions import rate
from scissordyn.plugin.element import pointers, row_of


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


def test_a_kernel_that_the_library_lacks_is_compiled(tmp_path):
    """Contract: a law in a new file of the package works before the library is built again."""
    file = tmp_path / "newest.py"
    file.write_text("def spring(indentation):\n    return 1e9 * indentation\n", encoding="utf-8")
    found = importlib.util.spec_from_file_location("scissordyn.laws.elastic.newest", file)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    law = sd.element(slot="stiffness")(module.spring)()
    assert elastic_force(pointers(law)["force"], 2e-6, row_of(law)) == 1e9 * 2e-6


class Pair(NamedTuple):
    """Two numbers."""

    first: int
    second: float


def test_a_tuple_is_of_the_declared_types():
    """Contract: what is no whole number is refused by its name."""
    assert Handle(Pair(1, 2.0)).address
    with pytest.raises(TypeError, match=r"Pair.first: str instead of int"):
        Handle(Pair("1", 2.0))


class Integers(NamedTuple):
    """Two arrays of integers."""

    shared: I1
    own: I1


class Nested(NamedTuple):
    """An array, a number and arrays that copies share or are given."""

    own: F2
    inner: Integers
    number: int


def test_copies_of_a_template():
    """Contract: a copy has its own arrays in memory, except shared ones; a handle of the same content has the same shapes."""
    shared, content = np.arange(3), Nested(np.eye(2), Integers(np.arange(3), np.arange(5)), 7)
    template = Template(content, {"Integers.shared"})
    first, second = template.copy({}), template.copy({"Integers.shared": shared})
    first.content.own[:], first.content.inner.own[:] = 3.0, 4
    assert first.content.inner.shared is content.inner.shared
    assert second.content.inner.shared is shared
    np.testing.assert_equal(second.content, Nested(np.eye(2), Integers(shared, np.arange(5)), 7))
    words, addresses = Handle(second.content)._memory, [0, 6]
    np.testing.assert_array_equal(second._memory, words)
    assert not np.any(first._memory[addresses] == words[addresses])


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
