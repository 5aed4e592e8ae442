"""What commands say for other programs: JSON in SI units."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.run.answer.advice import warning_lines, warnings_of
from scissordyn.run.answer.summary import joint_summaries, summary_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scissordyn.run.results import Run


def run_record(run: Run, files: Sequence[Path | str] = ()) -> dict[str, Any]:
    """A run in plain data."""
    trusted = float(run.attrs.get("trusted_until", math.nan))
    residual = float(np.abs(run["energy_residual"].values).max()) if run.sizes["time"] else math.nan
    return {
        "status": run.attrs["status"],
        "cause": run.attrs["cause"],
        "end": float(run.attrs["end"]),
        "statistics": json.loads(run.attrs["statistics"]),
        "summary": summary_of(run).plain(),
        "joints": [joint.plain() for joint in joint_summaries(run)],
        "energy_residual": residual if math.isfinite(residual) else None,
        "trusted_until": trusted if math.isfinite(trusted) else None,
        "warnings": json.loads(run.attrs["warnings"]),
        "warnings_in_short": warning_lines(warnings_of(run)),
        "warning_data": [warning.data for warning in warnings_of(run)],
        "files": [str(path) for path in files],
    }


def print_json(record: dict[str, Any]) -> None:
    """Print plain data as one line of JSON, with every character beyond ASCII as its code."""
    print(json.dumps(record, allow_nan=False))
