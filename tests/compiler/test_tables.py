"""Tables inside the library: the same on every machine, and the same as last time.

``python tests/compiler/test_tables.py`` writes their digests after an intended change.
"""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

DIGESTS = Path(__file__).with_name("tables.sha256")  # File with the digests of the generated tables


def source(folder, **environment):
    """Return the library in C as another process writes it."""
    file = folder / "kernels.c"
    command = [sys.executable, "-m", "scissordyn.build", "--c", str(file)]
    subprocess.run(command, env={**os.environ, **environment}, check=True)
    return file.read_text(encoding="utf-8")


def digests(text):
    """Return a line for each table of a C file: digest of its numbers, and its name."""
    tables = re.findall(r"^static \w+ table_\d+_(\w+)_numbers\[\] = \{(.*)\};$", text, re.MULTILINE)
    return "".join(sorted(f"{hashlib.sha256(numbers.encode()).hexdigest()}  {name}\n" for name, numbers in tables))


def test_library_is_the_same_everywhere(tmp_path):
    """Contract: the C does not depend on the kernels of linear algebra or on the order of sets, and its tables are known."""
    first = source(tmp_path, OPENBLAS_CORETYPE="Prescott", PYTHONHASHSEED="1")
    assert first == source(tmp_path, OPENBLAS_CORETYPE="SkylakeX", PYTHONHASHSEED="2")
    assert digests(first) == DIGESTS.read_text(encoding="utf-8"), "if intended: python tests/compiler/test_tables.py"


if __name__ == "__main__":
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        DIGESTS.write_text(digests(source(Path(folder))), encoding="utf-8", newline="\n")
