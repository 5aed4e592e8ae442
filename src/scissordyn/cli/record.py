"""What commands say for other programs: JSON in SI units."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

__all__ = ["JointSummary", "joint_summaries", "print_json", "run_record"]


class JointSummary(NamedTuple):
    """The contacts of one joint in a run.

    Parameters
    ----------
    name : str
    contacts : int
    fraction : float
        Of the time, in contact.
    largest : float
        Largest normal force [N].
    when : float
        Its instant [s].
    """

    name: str
    contacts: int
    fraction: float
    largest: float
    when: float


def joint_summaries(run: xr.Dataset) -> list[JointSummary]:
    """The joints of a run that had contacts, in the order of their first ones.

    Parameters
    ----------
    run : Dataset

    Returns
    -------
    list of JointSummary
    """
    end, found = float(run.attrs["end"]), []
    for joint in dict.fromkeys(run["contact_joint"].values.tolist()):
        here = run.isel(contact=np.flatnonzero(run["contact_joint"].values == joint))
        start, lasting = here["contact_start"].values, here["contact_duration"].values
        lasting = np.where(np.isnan(lasting), end - start, lasting)
        peaks = here["peak_force"].values
        highest = int(np.argmax(peaks))
        when = float(start[highest] + here["peak_time"].values[highest])
        fraction = float(lasting.sum()) / end if end > 0.0 else 0.0
        found.append(JointSummary(str(joint), here.sizes["contact"], fraction, float(peaks[highest]), when))
    return found


def run_record(run: xr.Dataset, files: Sequence[Path | str] = ()) -> dict[str, Any]:
    """A run in plain data.

    Parameters
    ----------
    run : Dataset
    files : sequence of path
        That were written.

    Returns
    -------
    dict
        Forces in N, times in s, energies in J.
    """
    trusted = float(run.attrs.get("trusted_until", math.nan))
    residual = float(np.abs(run["energy_residual"].values).max()) if run.sizes["time"] else math.nan
    return {
        "status": run.attrs["status"],
        "cause": run.attrs["cause"],
        "end": float(run.attrs["end"]),
        "statistics": json.loads(run.attrs["statistics"]),
        "joints": [joint._asdict() for joint in joint_summaries(run)],
        "energy_residual": residual if math.isfinite(residual) else None,
        "trusted_until": trusted if math.isfinite(trusted) else None,
        "warnings": json.loads(run.attrs["warnings"]),
        "files": [str(path) for path in files],
    }


def print_json(record: dict[str, Any]) -> None:
    """Print plain data as one line of JSON, with every character beyond ASCII as its code.

    Parameters
    ----------
    record : dict
    """
    print(json.dumps(record, allow_nan=False))
