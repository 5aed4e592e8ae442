"""Kernels: what is compiled when."""

from __future__ import annotations

from scissordyn.kernel import kernel


@kernel
def double(x):
    """Twice a number."""
    return 2.0 * x


@kernel
def triple(x):
    """Three times a number."""
    return 3.0 * x


@kernel
def both(x):
    """Calls the others."""
    return double(x) + triple(x)


def test_a_kernel_that_another_one_calls_has_no_machine_code_of_its_own() -> None:
    """Identity: it is compiled for Python when Python calls it, with the same result."""
    assert both(3.0) == 15.0
    assert not double.overloads
    assert double(3.0) == 6.0
    assert len(double.overloads) == len(both.overloads) == 1
