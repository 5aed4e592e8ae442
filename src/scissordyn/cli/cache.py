"""``scissordyn cache``: where compiled kernels are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.cache.generation import Generation

__all__ = ["cache"]


def cache(
    clean: Annotated[bool, typer.Option("--clean", help="Delete what no process uses and no package needs any more.")] = False,
) -> int:
    """Show where compiled kernels are kept and how much room they take."""
    from scissordyn.cache.folder import cache_root
    from scissordyn.cache.generation import clean as cleaned
    from scissordyn.cache.generation import generations
    from scissordyn.cache.private import folder_fault
    from scissordyn.cli.show import console

    to, root = console(), cache_root()
    fault = folder_fault(root) if root.is_dir() else ""
    if fault and clean:
        raise InputError(f"the kernel cache '{root}' is not used, and not cleaned: {fault}")
    if clean:
        for generation in cleaned():
            to.print(f"Deleted {generation.folder} ({_size(generation.size)})")
    to.print(f"Compiled kernels are in {root}", soft_wrap=True, markup=False)
    if fault:
        to.print(f"They are not used: {fault}", soft_wrap=True, markup=False)
    found = generations()
    for generation in found:
        to.print(f"  {generation.folder.name}  {_size(generation.size):>9}  {_words(generation)}", soft_wrap=True)
    if any(generation.old for generation in found):
        to.print("scissordyn cache --clean deletes the old ones.")
    return 0


def _size(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _words(generation: Generation) -> str:
    if generation.current:
        return "of this version"
    whose = "of an unknown package" if generation.package is None else f"of {generation.package}"
    if generation.in_use:
        return f"{whose}, in use"
    return f"{whose}, old" if generation.old else whose
