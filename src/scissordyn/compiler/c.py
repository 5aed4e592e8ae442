"""Call the C compiler of this machine, or that of the package `ziglang`."""

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

COMPILERS = ("cc", "gcc", "clang")  # C compilers in the order in which they are tried

FLAGS = ("-std=gnu11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno")
"""Products and sums are not contracted, so that results are equal with every compiler and processor."""


def compiler_command(target: str = "") -> list[str]:
    """Return the command of the C compiler, for this machine or another target."""
    zig = [sys.executable, "-m", "ziglang", "cc", "-s"] if find_spec("ziglang") else []
    wanted = os.environ.get("CC", "").split()
    if target:
        commands = [[*zig, "-target", target]] if zig else []
    else:
        commands = [wanted] if wanted else [*([name] for name in COMPILERS), zig]
    for command in commands:
        if command and shutil.which(command[0]):
            return command
    raise InputError(
        f"no C compiler found ({' '.join(wanted) or ', '.join(COMPILERS)})",
        "a C compiler on the PATH or in CC, or the package ziglang",
        "pip install ziglang",
    )


def compile_library(source: str, library: Path, flags: tuple[str, ...] = FLAGS, *, target: str = "") -> None:
    """Compile C source to a shared library; a failure leaves an existing library unchanged.

    `target` is the machine, by default this one.
    """
    command = compiler_command(target)
    name, allowed = " ".join(command), "a working C11 compiler in CC"
    with tempfile.TemporaryDirectory(dir=library.parent, prefix=".build-") as folder:
        code, compiled = Path(folder, "kernels.c"), Path(folder, "kernels.so")
        code.write_text(source, encoding="utf-8")
        words = [*command, *flags, str(code), "-o", str(compiled), *([] if "windows" in target else ["-lm"])]
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=600, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InputError(f"the C compiler '{name}' failed: {error}", allowed) from None
        if done.returncode:
            reasons = [line for line in done.stderr.splitlines() if "error" in line] or [done.stderr.strip()[-200:]]
            raise InputError(f"the C compiler '{name}' failed: {reasons[0] or f'exit status {done.returncode}'}", allowed)
        compiled.replace(library)


def load_source(source: str, *more: str) -> ctypes.CDLL:
    """Compile C source with additional flags and load the library, which stays loaded until the process ends."""
    with tempfile.TemporaryDirectory(prefix="scissordyn-", ignore_cleanup_errors=True) as folder:
        target = Path(folder, "own.so")
        compile_library(source, target, (*FLAGS, *more))
        return ctypes.CDLL(str(target))
