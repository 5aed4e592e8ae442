"""Compiles the kernels, and puts the examples into the wheel; everything else is in pyproject.toml.

SCISSORDYN_TARGET names another machine, as the C compiler of ziglang does: one of `TARGETS`. With
SCISSORDYN_DERIVATIVES=no, and in an installation in place, libraries in dual numbers are compiled at their first use.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
TARGETS = {
    "x86_64-linux-gnu.2.17": "manylinux_2_17_x86_64",
    "aarch64-linux-gnu.2.28": "manylinux_2_28_aarch64",
    "aarch64-macos": "macosx_11_0_arm64",
    "x86_64-windows-gnu": "win_amd64",
}
TARGET = os.environ.get("SCISSORDYN_TARGET", "")
DERIVATIVES = os.environ.get("SCISSORDYN_DERIVATIVES", "") != "no"


class BuildWithKernels(build_py):
    """An installation in place reads the examples where they are, and has the library beside its sources."""

    def run(self) -> None:
        """Build the packages, compile the kernels, copy the examples."""
        super().run()
        package = (ROOT / "src" if self.editable_mode else Path(self.build_lib)) / "scissordyn"
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        derivatives = DERIVATIVES and not self.editable_mode
        words = [*(["--target", TARGET] if TARGET else []), *(["--derivatives"] if derivatives else [])]
        # not by PYTHONPATH: pip takes a folder off the path that an earlier installation in place has put there
        run = "runpy.run_module('scissordyn.build', run_name='__main__')"
        program = f"import runpy, sys; sys.path.insert(0, {str(ROOT / 'src')!r}); {run}"
        done = subprocess.run([sys.executable, "-c", program, *words, str(package)], env=environment, check=False)
        if done.returncode:
            raise SystemExit(done.returncode)
        if not self.editable_mode:
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(ROOT / "examples", package / "examples", ignore=ignored, dirs_exist_ok=True)


class WithLibrary(Distribution):
    """A distribution for a machine."""

    def has_ext_modules(self) -> bool:
        """The library is one, though none of Python."""
        return True


class Wheel(bdist_wheel):
    """The library needs no certain version of Python, but a machine."""

    def get_tag(self) -> tuple[str, str, str]:
        """Python 3, no binary interface of Python, this machine or the target."""
        return "py3", "none", TARGETS[TARGET] if TARGET else super().get_tag()[2]


setup(distclass=WithLibrary, cmdclass={"build_py": BuildWithKernels, "bdist_wheel": Wheel})
