"""Puts the examples into the wheel, below the package; everything else is in pyproject.toml."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

EXAMPLES = Path(__file__).parent / "examples"


class BuildWithExamples(build_py):
    """An installation in place reads the folder where it is."""

    def run(self) -> None:
        """Build the packages, then copy the examples."""
        super().run()
        if not self.editable_mode:
            target = Path(self.build_lib) / "scissordyn" / "examples"
            shutil.copytree(EXAMPLES, target, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)


setup(cmdclass={"build_py": BuildWithExamples})
