"""Cases with known answers: each is a case file, a page, a reference of its own and, where it means something, other codes."""

import sys
from pathlib import Path

# the second formulations that tests and validation share
sys.path.append(str(Path(__file__).parent.parent / "tests"))
