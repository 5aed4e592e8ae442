"""Cases with known answers: each has a case file, a page, an independent reference and sometimes other codes."""

import sys
from pathlib import Path

# second formulations that tests and validation share
sys.path.append(str(Path(__file__).parent.parent / "tests"))
