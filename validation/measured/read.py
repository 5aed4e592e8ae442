"""Read measured oscillations of pendula from a copy of their repository, which is not part of this package.

Source: https://github.com/dynamicslab/MultiArm-Pendulum, MIT licence, Copyright (c) 2022 dynamicslab, commit e99a7e1. The
cart is fixed, angles are measured from the upward vertical by encoders, and velocities are filtered by the authors. Get it by

    git clone https://github.com/dynamicslab/MultiArm-Pendulum pendula
"""

from __future__ import annotations

import io
import subprocess
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from scissordyn.analysis.agreement import Measured

__all__ = ["estimated", "free_decay", "records"]

NAMES = {1: "Single", 2: "Double", 3: "Triple"}


def _content(copy: Path, path: str) -> io.BytesIO:
    """Return a file of a work tree or of a bare copy."""
    if (copy / path).is_file():
        return io.BytesIO((copy / path).read_bytes())
    return io.BytesIO(subprocess.run(["git", "-C", str(copy), "show", f"HEAD:{path}"], check=True, capture_output=True).stdout)


def records(copy: Path, arms: int, which: str, every: int) -> list[Measured]:
    """Return the pieces that the authors fit ("id") or predict ("vad").

    Parameters
    ----------
    copy : Path
    arms : {1, 2, 3}
    which : {"id", "vad"}
    every : int
        Use every n-th of their instants, which are 1 ms apart.
    """
    folder = f"ParameterEstimation/{NAMES[arms]}Pendulum"
    data = loadmat(_content(copy, f"{folder}/{NAMES[arms]}PendulumDataForParameterEstimation.mat"), squeeze_me=True)
    headings = [f"{name} of arm {k + 1}" for name in ("angle", "angular_velocity") for k in range(arms)]
    units = ["rad"] * arms + ["rad/s"] * arms
    found = []
    for values, time in zip(data[f"Y_{which}"], data[f"Time_{which}"], strict=True):
        rows = np.ascontiguousarray(values.T[::every].astype(float))
        found.append(Measured(time[::every].astype(float), tuple(headings), rows, tuple(units), f"{NAMES[arms]} {which}"))
    return found


def free_decay(copy: Path, every: int) -> Measured:
    """Return the angle of the single pendulum until it is at rest; the time starts at zero."""
    data = loadmat(_content(copy, "Datas/SinglePendulum/SingleDataFreeSwing_1_Dt_0_0001.mat"), squeeze_me=True)["Theta1"]
    time, angle = data["time"].item(), data["signals"].item()["values"].item()
    return Measured((time - time[0])[::every], ("angle of arm 1",), angle[::every, None].astype(float), ("rad",), "free decay")


def estimated(copy: Path, arms: int) -> np.ndarray:
    """Return the parameters that the authors estimated, in their order."""
    path = f"ParameterEstimation/{NAMES[arms]}Pendulum/EstimatedParameters_{NAMES[arms]}Pendulum.mat"
    return np.asarray(loadmat(_content(copy, path))["EstimatedParameters"]).ravel()
