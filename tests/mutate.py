"""Multiply one constant of a law by 1.01 and see whether a physics test notices: for every constant of every law.

Run by hand: ``python tests/mutate.py [NAME ...]``. Every float in the body of a law's methods and kernels is changed in turn,
and the first number that a law hands to its kernel, in a copy of the package that runs without the compiler. Prints a table;
ends with status 1 if there is a law of which no change is seen.
"""

from __future__ import annotations

import argparse
import ast
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from scissordyn.laws import catalogue

HERE = Path(__file__).parent
PACKAGE = HERE.parent / "src" / "scissordyn"
FACTOR = 1.01


class Spot(ast.NodeTransformer):
    """Counts the constants that can be changed and changes the one with a given number."""

    def __init__(self, target=None):
        self.target, self.count, self.changed, self.method = target, 0, "", ""

    def _here(self):
        self.count += 1
        return self.count - 1 == self.target

    def visit_AnnAssign(self, node):
        """Defaults and declarations are not physics."""
        return node

    def visit_FunctionDef(self, node):
        """Remember where we are; __post_init__ only checks."""
        if node.name == "__post_init__":
            return node
        self.method = node.name
        return self.generic_visit(node)

    def visit_Raise(self, node):
        """Nor are messages."""
        return node

    def _scaled(self, node):
        self.changed = f"line {node.lineno}: {ast.unparse(node)}"
        return ast.BinOp(ast.Constant(FACTOR), ast.Mult(), node)

    def visit_Return(self, node):
        """The first number of a row."""
        if self.method == "parameters" and isinstance(node.value, ast.Tuple) and node.value.elts and self._here():
            node.value.elts[0] = self._scaled(node.value.elts[0])
            return node
        return self.generic_visit(node)

    def visit_Constant(self, node):
        """Any float but zero."""
        if isinstance(node.value, float) and node.value != 0.0 and self._here():
            return self._scaled(node)
        return node


def noticed(copy, name):
    """Whether a test that names the law fails."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    chosen = f"({name} or {name.replace('-', '_')}) and not whole_table"
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-k", chosen]
    command += [str(HERE / "laws" / f"test_{part}.py") for part in ("elastic", "damping", "friction")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=HERE.parent, check=False)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{name}: pytest ended with {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 1


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="laws to try; all if none is given")
    names = parser.parse_args().names
    unseen = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        shutil.copytree(PACKAGE, copy / "scissordyn", ignore=shutil.ignore_patterns("__pycache__"))
        for kind, laws in catalogue.BY_KIND.items():
            for name, law in laws.items():
                if (names and name not in names) or name == "none":
                    continue
                file = Path(sys.modules[law.__module__].__file__).relative_to(PACKAGE)
                text = (PACKAGE / file).read_text()
                everything = Spot()
                everything.visit(ast.parse(text))
                seen, lost = 0, []
                for target in range(everything.count):
                    spot = Spot(target)
                    (copy / "scissordyn" / file).write_text(ast.unparse(ast.fix_missing_locations(spot.visit(ast.parse(text)))))
                    if noticed(copy, name):
                        seen += 1
                    else:
                        lost.append(spot.changed)
                (copy / "scissordyn" / file).write_text(text)
                if noticed(copy, name):
                    raise RuntimeError(f"{name}: the tests fail on the law as it is")
                print(f"{kind:10} {name:26} {seen:3} of {everything.count:3} noticed  {'; '.join(lost)}", flush=True)
                if not seen:
                    unseen.append(name)
    print("not noticed at all:", ", ".join(unseen) or "none")
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
