"""Kernels as other kernels call them: translated once, and optimised where they are called.

Numba optimises each function and makes machine code of it before it hands its intermediate code to a caller, where that is
optimised again, once for each level of calls. Machine code of a function that only other kernels call is never run, and most of
a compiler's time would go into it.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, PassManager, register_pass
from numba.core.typed_passes import NativeLowering

__all__ = ["CalleeCompiler"]


class _Nowhere:
    """In place of the engine that runs machine code."""

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing runs that could ask for its constants."""


class _CalleeLibrary(JITCodeLibrary):
    """The intermediate code of a function and of all that it calls; there is no machine code."""

    @property
    def codegen(self) -> Any:
        """Whom numba tells where the constants of the function lie."""
        return _Nowhere()

    def finalize(self) -> None:
        """Put the intermediate code of all functions together."""
        self._raise_if_finalized()  # type: ignore[no-untyped-call]
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Nowhere: it cannot be called from Python."""
        self._ensure_finalized()  # type: ignore[no-untyped-call]
        return 0


@register_pass(mutates_CFG=False, analysis_only=True)
class _WithoutMachineCode(AnalysisPass):
    """Has a function translated into a library that makes no machine code."""

    _name = "without_machine_code"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Choose the library."""
        library: Any = _CalleeLibrary
        state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
        return False


class CalleeCompiler(CompilerBase):
    """Numba's compiler, for functions as other kernels call them."""

    def define_pipelines(self) -> list[PassManager]:
        """Its own passes, and the choice of the library before the code is written into it."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        before = next(k for k, (kind, _) in enumerate(passes.passes) if kind is NativeLowering)
        passes.passes.insert(before, (_WithoutMachineCode, "without machine code"))
        passes.finalize()
        return [passes]
