"""The C compiler of this machine, or the one of the package `ziglang`."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from scissordyn.errors import InputError

COMPILERS = ("cc", "gcc", "clang")

FLAGS = ("-std=gnu11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno")
"""Products and sums are not contracted: numbers are the same with every compiler and processor."""

LIMIT = 600
"""Longest time that a compiler may take [s]."""


def compiler_command() -> list[str]:
    """How the C compiler is called.

    Raises
    ------
    InputError
        If there is none.
    """
    wanted = os.environ.get("CC", "").split()
    for command in [wanted] if wanted else [[name] for name in COMPILERS]:
        if shutil.which(command[0]):
            return command
    if not wanted and find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise InputError(
        f"no C compiler ({' '.join(wanted) or ', '.join(COMPILERS)})",
        "one on the PATH or in CC, or that of ziglang",
        "pip install ziglang",
    )


def compile_library(source: str, target: Path, flags: tuple[str, ...] = FLAGS) -> None:
    """Compile a file of C to a shared library; the target is replaced as a whole or stays as it is.

    Raises
    ------
    InputError
        If there is no compiler, or it fails.
    """
    command = compiler_command()
    name, allowed = " ".join(command), "a C compiler for C11 that works, in CC"
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".build-") as folder:
        code, library = Path(folder, "kernels.c"), Path(folder, "kernels.so")
        code.write_text(source, encoding="utf-8")
        try:
            done = subprocess.run(
                [*command, *flags, str(code), "-o", str(library), "-lm"],
                capture_output=True,
                text=True,
                timeout=LIMIT,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InputError(f"the C compiler '{name}' failed: {error}", allowed) from None
        if done.returncode:
            line = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[-200:])
            raise InputError(
                f"the C compiler '{name}' failed: {line or f'exit status {done.returncode}'}", "a C compiler for C11, in CC"
            )
        library.replace(target)


def loaded(source: str) -> ctypes.CDLL:
    """The library of a file of C that lives as long as this process."""
    with tempfile.TemporaryDirectory(prefix="scissordyn-", ignore_cleanup_errors=True) as folder:
        target = Path(folder, "own.so")
        compile_library(source, target)
        return ctypes.CDLL(str(target))
